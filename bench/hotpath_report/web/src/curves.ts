// SPDX-License-Identifier: Apache-2.0
// What all plots share, and all curves that are read by mouse or keyboard.

import uPlot from "uplot";
import type { Line } from "./data";
import { h, onLook, swatch, theme, type Attributes } from "./dom";

/** An axis in the colours of the page's theme. */
export function axis(more: uPlot.Axis): uPlot.Axis {
  return { stroke: theme("faint"), grid: { stroke: theme("grid"), width: 1 }, ticks: { show: false }, ...more };
}

/** Labels of an axis. */
export function numbers(_: uPlot, at: (number | null)[]): string[] {
  return at.map((v) => (v === null ? "" : String(Number(v.toPrecision(6)))));
}

type Content = Omit<uPlot.Options, "width" | "height"> & { height?: number; data: uPlot.AlignedData };

/** A plot, drawn again when its width or the theme changes. */
export abstract class Chart {
  protected readonly plotted: HTMLElement;
  protected plot: uPlot | undefined;

  constructor(attributes: Attributes) {
    this.plotted = h("div", { class: "plot", ...attributes });
    onLook(this.plotted, () => this.plot?.width, () => this.draw());
  }

  /** What to draw, unless it is nothing. */
  protected abstract content(): Content | null;

  draw(): void {
    this.plot?.destroy();
    this.plot = undefined;
    const width = Math.floor(this.plotted.clientWidth);
    const content = width > 0 && this.content();
    if (!content) return;
    const cursor = { drag: { x: false, y: false }, points: { show: false }, ...content.cursor };
    this.plot = new uPlot({ width, height: 340, legend: { show: false }, ...content, cursor }, content.data, this.plotted);
  }
}

/** A curve, with the number and the text that its entry in the legend has. */
export type Curve = Line & { series: number; more: string };

export abstract class Curves extends Chart {
  readonly legend = h("fieldset", { class: "legend" });
  readonly visible = new Set<number>(); // series that are switched on
  readonly keys: HTMLElement;
  protected readonly holder: HTMLElement;
  protected shown: Curve[] = [];
  protected x: number[] = []; // all positions of the shown curves
  protected index = -1; // of the position under the cursor
  private readonly tip = h("div", { class: "tip", role: "status", "aria-live": "polite", hidden: true });
  private all: Curve[] = [];

  constructor(kind: string, id: string, keys: string, private readonly unit: string) {
    super({ tabindex: 0, role: "application", "aria-roledescription": kind, "aria-describedby": id });
    this.keys = h("p", { id, class: "faint small" }, keys);
    this.holder = h("div", { class: "holder" }, this.plotted, this.tip);
    this.plotted.addEventListener("keydown", (event) => this.key(event));
  }

  /** Names a position of the axis. */
  protected abstract head(x: number): string;
  protected abstract switched(): void;
  protected enter(): void {}

  /** Takes over curves, and makes a box for each that switches it on and off. */
  protected offer(all: Curve[]): void {
    this.all = all;
    const boxes = all.map(({ series, more, ...look }) => {
      const toggle = (): void => {
        if (!this.visible.delete(series)) this.visible.add(series);
        this.switched();
      };
      const box = h("input", { type: "checkbox", checked: this.visible.has(series), change: toggle });
      return h("label", { "data-series": series }, box, swatch(look), h("span", {}, look.label), h("span", { class: "faint" }, more));
    });
    this.legend.replaceChildren(h("legend", { class: "hidden" }, "Executors"), ...boxes);
  }

  draw(): void {
    this.shown = this.all.filter((curve) => this.visible.has(curve.series));
    this.x = [...new Set(this.shown.flatMap((curve) => curve.x))].sort((a, b) => a - b);
    this.index = -1;
    this.tip.hidden = true;
    super.draw();
  }

  /** What is drawn: value, low and high of each curve's interval, over the places of x on the axis. */
  protected drawn(point: number, place: (x: number) => number = (x) => x): Pick<uPlot.Options, "series" | "bands" | "hooks"> & { data: uPlot.AlignedData } {
    const columns = [[this.x.map(place)], ...this.shown.map((c) => [c.x.map(place), c.value, c.low, c.high])];
    const data = uPlot.join(columns as uPlot.AlignedData[]).map((column) => Array.from(column, (value) => value ?? null));
    const end = { scale: "y", stroke: "transparent", width: 0, points: { show: false }, spanGaps: true };
    const series = this.shown.flatMap(({ label, colour, dash }): uPlot.Series[] => [
      { ...end, label, stroke: colour, dash, width: 2, points: { show: point > 0, size: point, fill: colour } }, end, end,
    ]);
    const bands = this.shown.map(({ colour }, i): uPlot.Band => ({ series: [3 * i + 3, 3 * i + 2], fill: `${colour}38` }));
    return { data: data as uPlot.AlignedData, series: [{}, ...series], bands, hooks: { setCursor: [(u) => this.hover(u)] } };
  }

  /** The curves that have a value at a position. */
  protected at(index: number): { curve: Curve; k: number }[] {
    return this.shown.map((curve) => ({ curve, k: curve.x.indexOf(this.x[index]) })).filter(({ k }) => k >= 0);
  }

  /** Writes value and interval of each curve at a position. */
  private describe(index: number): void {
    this.index = index;
    const rows = this.at(index).map(({ curve: { series, label, value, ...c }, k }) => {
      const [low, high] = [c.low[k], c.high[k]];
      const interval = low === null || high === null ? "" : ` [${low.toFixed(3)}, ${high.toFixed(3)}]`;
      return h("tr", { "data-series": series, "data-x": this.x[index] }, h("td", {}, swatch(c)), h("th", { scope: "row" }, label),
        h("td", {}, value[k].toFixed(3) + this.unit), h("td", {}, interval));
    });
    this.tip.replaceChildren(h("b", {}, this.head(this.x[index])), h("table", {}, h("tbody", {}, ...rows)));
    this.tip.hidden = false;
  }

  private hover({ cursor: { left = -1, idx } }: uPlot): void {
    if (left >= 0 && typeof idx === "number") this.describe(idx);
    else if (document.activeElement !== this.plotted) this.tip.hidden = true;
  }

  private key(event: KeyboardEvent): void {
    const last = this.x.length - 1;
    const [on, back] = [Math.min(last, this.index + 1), Math.max(0, this.index - 1)];
    const to: Record<string, number> = { ArrowUp: on, ArrowRight: on, ArrowDown: back, ArrowLeft: back, Home: 0, End: last };
    if (event.key in to) this.describe(to[event.key]);
    else if (event.key === "Enter" && this.index >= 0) this.enter();
    else return;
    event.preventDefault();
  }
}
