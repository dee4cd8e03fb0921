// SPDX-License-Identifier: Apache-2.0
// Latency over time.

import uPlot from "uplot";
import { axis } from "./curves";
import type { Output, Store, Target } from "./data";
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

  private draw(): void {
    this.plot?.destroy();
    this.plot = undefined;
    const { store, target, visible } = this;
    const width = Math.floor(this.latencies.clientWidth);
    if (!target || width === 0 || this.element.hidden) return;
    const repetition = Number(this.choice.value);
    const stored = visible.flatMap((s) => store.repetitions(s)).filter((r) => r.repetition === repetition);
    const lists = visible.map((s) =>
      store.outputs(target, s).filter((o) => o.repetition === repetition).sort((a, b) => a.end - b.end));
    this.outputs = lists.flat();
    const series: uPlot.Series[] = visible.map((s) => {
      const { colour, label } = store.document.series[s];
      return { label, stroke: colour, paths: () => null, points: { show: true, size: 4, fill: colour, width: 0 } };
    });
    this.plot = new uPlot(
      {
        width, height: 280, legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        scales: {
          x: { time: false, range: [0, Math.max(1, ...stored.map((r) => r.length_ns)) / NS_PER_S] },
          y: { range: (_, __, max) => [0, 1.08 * (max || 1)] },
        },
        axes: [
          axis({ values: (_, splits) => splits.map((v) => `${v} s`) }),
          axis({ size: 58, label: target.measure, labelSize: 20 }),
        ],
        series: [{}, ...series],
        hooks: { ready: [(u) => this.listen(u)] },
      },
      uPlot.join(lists.map((of) => [of.map((o) => o.end / NS_PER_S), of.map((o) => o.latency / NS_PER_MS)])),
      this.latencies,
    );
    this.latencies.setAttribute("role", "img");
    this.latencies.setAttribute("aria-label", `${target.title} over time, repetition ${repetition}`);
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
