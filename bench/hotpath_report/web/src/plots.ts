// SPDX-License-Identifier: Apache-2.0
// Curves over a quantity, such as a latency over the load.

import type uPlot from "uplot";
import { axis, Curves, numbers } from "./curves";
import type { Plot } from "./data";
import { Choice, h } from "./dom";

export class Plots extends Curves {
  readonly element: HTMLElement;
  private readonly choice: Choice;

  constructor(private readonly plots: Plot[]) {
    super("curves", "plot-keys", "Hover to read values and 95 % intervals; on the keyboard, left and right move along the curves.", "");
    this.choice = new Choice("curves-of", "Curves of ", () => this.choose()).offer(plots.map((p, i) => [i, p.title]));
    for (const id of new Set(plots.map((p) => p.figure))) { // not drawn twice
      const link = h("a", { href: "#explore-title" }, "These curves are above.");
      document.getElementById(id)?.replaceWith(h("p", { class: "small" }, link));
    }
    this.element = h("section", { class: "plots", "aria-label": "Curves" }, this.choice.element, this.legend, this.holder, this.keys);
    this.choose();
  }

  private get chosen(): Plot {
    return this.plots[Number(this.choice.value)];
  }

  private choose(): void {
    const { title, x, lines } = this.chosen;
    for (const i of lines.keys()) this.visible.add(i);
    this.offer(lines.map((line, series) => ({ ...line, series, more: "" })));
    this.plotted.setAttribute("aria-label", `${title} over ${x}`);
    this.draw();
  }

  protected switched(): void {
    this.draw();
  }

  protected content(): ReturnType<Curves["content"]> {
    const { title, x, log } = this.chosen;
    const range = log ? undefined : (_: uPlot, least: number, most: number): [number, number] => [Math.min(0, least), 1.05 * (most || 1)];
    return {
      ...this.drawn(this.x.length < 60 ? 5 : 0), cursor: { y: false },
      scales: { x: { time: false }, y: { distr: log ? 3 : 1, range } },
      axes: [axis({ label: x, labelSize: 20, size: 32 }), axis({ label: title, labelSize: 20, size: 62, values: numbers })],
    };
  }

  protected head(x: number): string {
    return `${this.chosen.x} ${x}`;
  }
}
