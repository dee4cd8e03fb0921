// SPDX-License-Identifier: Apache-2.0
// Latency over time.

import uPlot from "uplot";
import { axis, Chart } from "./curves";
import type { Output, Store, Target } from "./data";
import { Choice, h, NS_PER_MS, NS_PER_S } from "./dom";

const NEAR = 20; // px from an output within which a click selects it

export class Trend extends Chart {
  readonly element: HTMLElement;
  private readonly choice = new Choice("trend-repetition", "Repetition: ", () => this.draw());
  private target: Target | undefined;
  private visible: number[] = [];
  private outputs: Output[] = [];

  constructor(private readonly store: Store, private readonly pick: (output: Output) => void) {
    super({ role: "img" });
    this.element = h("section", { class: "trend", "aria-label": "Latency over time" }, h("h3", {}, "Over time"), this.choice.element, this.plotted);
  }

  show(target: Target, visible: number[]): void {
    [this.target, this.visible] = [target, visible];
    const numbers = new Set(visible.flatMap((s) => this.store.repetitions(s).map((r) => r.repetition)));
    this.choice.offer([...numbers].map((n) => [n, String(n)]));
    this.element.hidden = numbers.size === 0;
    this.draw();
  }

  protected content(): ReturnType<Chart["content"]> {
    const { store, target, visible } = this;
    if (!target || this.element.hidden) return null;
    const repetition = Number(this.choice.value);
    const stored = visible.flatMap((s) => store.repetitions(s)).filter((r) => r.repetition === repetition);
    const lists = visible.map((s) => store.outputs(target, s).filter((o) => o.repetition === repetition).sort((a, b) => a.end - b.end));
    this.outputs = lists.flat();
    this.plotted.setAttribute("aria-label", `${target.title} over time, repetition ${repetition}`);
    const series = visible.map((s): uPlot.Series => {
      const { colour, label } = store.document.series[s];
      return { label, stroke: colour, paths: () => null, points: { show: true, size: 4, fill: colour, width: 0 } };
    });
    return {
      data: uPlot.join(lists.map((of) => [of.map((o) => o.end / NS_PER_S), of.map((o) => o.latency / NS_PER_MS)])),
      height: 280, cursor: { y: false }, series: [{}, ...series],
      scales: {
        x: { time: false, range: [0, Math.max(1, ...stored.map((r) => r.length_ns)) / NS_PER_S] },
        y: { range: (_, __, max) => [0, 1.08 * (max || 1)] },
      },
      axes: [axis({ values: (_, splits) => splits.map((v) => `${v} s`) }), axis({ size: 58, label: target.measure, labelSize: 20 })],
      hooks: { ready: [(u) => u.over.addEventListener("click", (event) => this.click(u, event))] },
    };
  }

  /** Selects the nearest output. */
  private click(u: uPlot, { offsetX, offsetY }: MouseEvent): void {
    let [best, least] = [null as Output | null, NEAR];
    for (const o of this.outputs) {
      const distance = Math.hypot(u.valToPos(o.end / NS_PER_S, "x") - offsetX, u.valToPos(o.latency / NS_PER_MS, "y") - offsetY);
      if (distance < least) [best, least] = [o, distance];
    }
    if (best) this.pick(best);
  }
}
