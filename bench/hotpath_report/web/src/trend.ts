// SPDX-License-Identifier: Apache-2.0
// Latency over time.

import uPlot from "uplot";
import { axis } from "./curves";
import type { Output, Store, StoredRepetition, Target } from "./data";
import { h, NS_PER_MS, onTheme, onWidth } from "./dom";

const NS_PER_S = 1e9;

export class Trend {
  readonly element = h("section", { class: "trend", "aria-label": "Latency over time" });
  private readonly latencies = h("div", { class: "plot" });
  private readonly choice = h("select", { id: "trend-repetition" });
  private plot: uPlot | undefined;
  private target: Target | undefined;
  private visible: number[] = [];
  private outputs: Output[] = [];

  constructor(private readonly store: Store, private readonly pick: (output: Output) => void) {
    this.choice.addEventListener("change", () => this.draw());
    this.element.append(
      h("h3", {}, "Over time"),
      h("div", { class: "controls" }, h("label", { for: "trend-repetition" }, "Repetition: "), this.choice),
      this.latencies,
    );
    onWidth(this.latencies, () => this.plot?.width, () => this.draw());
    onTheme(() => this.draw());
  }

  show(target: Target, visible: number[]): void {
    this.target = target;
    this.visible = visible;
    const numbers = new Set(visible.flatMap((s) => this.store.repetitions(s).map((r) => r.repetition)));
    const kept = this.choice.value;
    this.choice.replaceChildren(...[...numbers].map((n) => h("option", { value: n }, String(n))));
    if (numbers.has(Number(kept)) && kept !== "") this.choice.value = kept;
    this.element.hidden = numbers.size === 0;
    this.draw();
  }

  private get repetition(): number {
    return Number(this.choice.value);
  }

  private stored(): StoredRepetition[] {
    return this.visible.flatMap((s) => this.store.repetitions(s).filter((r) => r.repetition === this.repetition));
  }

  private draw(): void {
    this.plot?.destroy();
    this.plot = undefined;
    const width = Math.floor(this.latencies.clientWidth);
    if (!this.target || width === 0 || this.element.hidden) return;
    const { target } = this;
    const length = Math.max(1, ...this.stored().map((r) => r.length_ns)) / NS_PER_S;
    this.outputs = [];
    const tables: [number[], number[]][] = this.visible.map((s) => {
      const of = this.store.outputs(target, s).filter((o) => o.repetition === this.repetition);
      of.sort((a, b) => a.end - b.end);
      this.outputs.push(...of);
      return [of.map((o) => o.end / NS_PER_S), of.map((o) => o.latency / NS_PER_MS)];
    });
    this.plot = this.scatter(width, length, target.measure, tables);
    this.latencies.setAttribute("role", "img");
    this.latencies.setAttribute("aria-label", `${target.title} over time, repetition ${this.repetition}`);
  }

  private scatter(width: number, length: number, label: string, tables: [number[], number[]][]): uPlot {
    const series: uPlot.Series[] = this.visible.map((s) => {
      const { colour, label: name } = this.store.document.series[s];
      return { label: name, stroke: colour, paths: () => null, points: { show: true, size: 4, fill: colour, width: 0 } };
    });
    const data = uPlot.join(tables as uPlot.AlignedData[]);
    return new uPlot(
      {
        width, height: 220, legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        scales: { x: { time: false, range: [0, length] }, y: { range: (_, __, max) => [0, 1.08 * (max || 1)] } },
        axes: [axis({ values: (_, splits) => splits.map((v) => `${v} s`) }), axis({ size: 58, label, labelSize: 20 })],
        series: [{}, ...series],
        hooks: { ready: [(u) => this.listen(u)] },
      },
      data, this.latencies,
    );
  }

  /** A click selects the nearest output. */
  private listen(u: uPlot): void {
    u.over.addEventListener("click", (event) => {
      const distance = (o: Output): number => {
        const x = u.valToPos(o.end / NS_PER_S, "x") - event.offsetX;
        const y = u.valToPos(o.latency / NS_PER_MS, "y") - event.offsetY;
        return x * x + y * y;
      };
      let best: Output | null = null;
      let least = 400;
      for (const o of this.outputs) {
        if (distance(o) < least) [best, least] = [o, distance(o)];
      }
      if (best) this.pick(best);
    });
  }
}
