// SPDX-License-Identifier: Apache-2.0
// Latency over time, with the processors' pace and the disturbed intervals below it.

import uPlot from "uplot";
import { axis } from "./curves";
import type { Output, Store, StoredRepetition, Target } from "./data";
import { h, NS_PER_MS, onTheme, onWidth, theme } from "./dom";

const NS_PER_S = 1e9;

export class Trend {
  readonly element = h("section", { class: "trend", "aria-label": "Latency over time" });
  private readonly latencies = h("div", { class: "plot" });
  private readonly pace = h("div", { class: "plot" });
  private readonly text = h("p", { class: "faint small", role: "status" });
  private readonly choice = h("select", { id: "trend-repetition" });
  private plots: uPlot[] = [];
  private target: Target | undefined;
  private visible: number[] = [];
  private outputs: Output[] = [];

  constructor(private readonly store: Store, private readonly pick: (output: Output) => void) {
    this.choice.addEventListener("change", () => this.draw());
    this.element.append(
      h("h3", {}, "Over time"),
      h("div", { class: "controls" }, h("label", { for: "trend-repetition" }, "Repetition: "), this.choice),
      this.latencies, this.pace, this.text,
    );
    onWidth(this.latencies, () => this.plots[0]?.width, () => this.draw());
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
    for (const plot of this.plots) plot.destroy();
    this.plots = [];
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
    this.plots.push(this.scatter(width, 220, length, target.measure, tables, this.latencies));
    this.latencies.setAttribute("role", "img");
    this.latencies.setAttribute("aria-label", `${target.title} over time, repetition ${this.repetition}`);
    this.drawPace(width, length);
    this.tell();
  }

  private scatter(
    width: number, height: number, length: number, label: string, tables: [number[], number[]][], at: HTMLElement,
  ): uPlot {
    const series: uPlot.Series[] = this.visible.map((s) => {
      const { colour, label: name } = this.store.document.series[s];
      return { label: name, stroke: colour, paths: () => null, points: { show: true, size: 4, fill: colour, width: 0 } };
    });
    const data = uPlot.join(tables as uPlot.AlignedData[]);
    return new uPlot(
      {
        width, height, legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        scales: { x: { time: false, range: [0, length] }, y: { range: (_, __, max) => [0, 1.08 * (max || 1)] } },
        axes: [axis({ values: (_, splits) => splits.map((v) => `${v} s`) }), axis({ size: 58, label, labelSize: 20 })],
        series: [{}, ...series],
        hooks: { drawAxes: [(u) => this.shade(u)], ready: [(u) => this.listen(u)] },
      },
      data, at,
    );
  }

  /** Intervals in which a processor was slow. */
  private shade(u: uPlot): void {
    u.ctx.fillStyle = theme("missing");
    u.ctx.beginPath(); // of one shape: periods of several processors overlap
    for (const { from_s, until_s } of this.stored().flatMap((r) => r.slow)) {
      const left = u.valToPos(from_s, "x", true);
      u.ctx.rect(left, u.bbox.top, u.valToPos(until_s, "x", true) - left, u.bbox.height);
    }
    u.ctx.fill();
  }

  /** Time per work of each processor: 1 is the pace of the calibration. */
  private drawPace(width: number, length: number): void {
    const tables = this.visible.map((s): [number[], number[]] => {
      const windows = this.store.repetitions(s).find((r) => r.repetition === this.repetition)?.speed ?? [];
      const sorted = [...windows].sort((a, b) => a[1] - b[1]);
      return [sorted.map((w) => (w[1] + w[2]) / 2 / NS_PER_S), sorted.map((w) => w[3])];
    });
    this.pace.hidden = tables.every(([x]) => x.length === 0);
    if (this.pace.hidden) return;
    this.plots.push(this.scatter(width, 130, length, "time per work", tables, this.pace));
    this.pace.setAttribute("role", "img");
    this.pace.setAttribute("aria-label", "Time for the work of the nodes, relative to the calibration");
  }

  private tell(): void {
    const slow = this.stored().flatMap((r) => r.slow);
    const live = this.visible.some((s) => this.store.run(s).source === "live");
    const none = live ? "No processor was slow in this repetition." : "";
    this.text.textContent = slow.length ? `Shaded: ${slow.length} periods of a slow processor; the table below has them.` : none;
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
