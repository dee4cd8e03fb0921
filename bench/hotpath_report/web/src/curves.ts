// SPDX-License-Identifier: Apache-2.0
// Curves with intervals over a quantity, such as a latency over the load, and what all curves share.

import uPlot from "uplot";
import type { Look, Plot } from "./data";
import { h, onTheme, onWidth, swatch, theme } from "./dom";

/** An axis in the colours of the page's theme. */
export function axis(more: uPlot.Axis): uPlot.Axis {
  return { stroke: theme("faint"), grid: { stroke: theme("grid"), width: 1 }, ticks: { show: false }, ...more };
}

/** uPlot's series for lines of three columns each: value, low and high of its interval. */
export function withIntervals(lines: Look[], point: number): { series: uPlot.Series[]; bands: uPlot.Band[] } {
  const end = { scale: "y", stroke: "transparent", width: 0, points: { show: false }, spanGaps: true };
  const series = lines.flatMap(({ label, colour, dash }): uPlot.Series[] => [
    { ...end, label, stroke: colour, dash, width: 2, points: { show: point > 0, size: point, fill: colour } }, end, end,
  ]);
  return { series: [{}, ...series], bands: lines.map(({ colour }, i) => ({ series: [3 * i + 3, 3 * i + 2], fill: `${colour}38` })) };
}

/** A box for each line, to switch it on and off. */
export function legend(lines: { look: Look; more: string; data: Record<string, number> }[], visible: Set<number>, changed: () => void): HTMLElement[] {
  return lines.map(({ look, more, data }) => {
    const toggle = (): void => {
      if (!visible.delete(data["data-series"])) visible.add(data["data-series"]);
      changed();
    };
    const box = h("input", { type: "checkbox", checked: visible.has(data["data-series"]), change: toggle });
    return h("label", data, box, swatch(look.colour, look.dash), h("span", {}, look.label), h("span", { class: "faint" }, more));
  });
}

/** A row of a tooltip. */
export function valueRow(look: Look, text: string, low: number | null, high: number | null, data: Record<string, number>): HTMLElement {
  const interval = low === null || high === null ? "" : ` [${low.toFixed(3)}, ${high.toFixed(3)}]`;
  return h("tr", data, h("td", {}, swatch(look.colour, look.dash)), h("th", { scope: "row" }, look.label), h("td", {}, text), h("td", {}, interval));
}

/** A plot whose curves are read by mouse or keyboard: `describe` writes the tooltip of a position of the axis. */
export abstract class Readable {
  protected readonly plotted: HTMLElement;
  protected readonly tip = h("div", { class: "tip", role: "status", "aria-live": "polite", hidden: true });
  readonly keys: HTMLElement;
  protected plot: uPlot | undefined;
  protected index = -1; // of the position under the cursor

  constructor(kind: string, id: string, keys: string) {
    this.plotted = h("div", { class: "plot", tabindex: 0, role: "application", "aria-roledescription": kind, "aria-describedby": id });
    this.keys = h("p", { id, class: "faint small" }, keys);
    this.plotted.addEventListener("keydown", (event) => this.key(event));
    onWidth(this.plotted, () => this.plot?.width, () => this.draw());
    onTheme(() => this.draw());
  }

  protected get box(): HTMLElement {
    return h("div", { class: "holder" }, this.plotted, this.tip);
  }

  protected abstract draw(): void;
  protected abstract length(): number;
  protected abstract describe(index: number): void;
  protected enter(): void {}

  protected tell(index: number, head: string, rows: (Node | null)[]): void {
    this.index = index;
    this.tip.replaceChildren(h("b", {}, head), h("table", {}, h("tbody", {}, ...rows)));
    this.tip.hidden = false;
  }

  protected hover(u: uPlot): void {
    const { left, idx } = u.cursor;
    if (left !== undefined && left >= 0 && typeof idx === "number") this.describe(idx);
    else if (document.activeElement !== this.plotted) this.tip.hidden = true;
  }

  private key(event: KeyboardEvent): void {
    const last = this.length() - 1;
    const [on, back] = [Math.min(last, this.index + 1), Math.max(0, this.index - 1)];
    const to: Record<string, number> = { ArrowUp: on, ArrowRight: on, ArrowDown: back, ArrowLeft: back, Home: 0, End: last };
    if (event.key in to) this.describe(to[event.key]);
    else if (event.key === "Enter" && this.index >= 0) this.enter();
    else return;
    event.preventDefault();
  }
}

export class Plots extends Readable {
  readonly element = h("section", { class: "plots", "aria-label": "Curves" });
  private readonly choice = h("select", { id: "curves-of" });
  private readonly lines = h("fieldset", { class: "legend" });
  private readonly visible = new Set<number>();
  private x: number[] = [];

  constructor(private readonly plots: Plot[]) {
    super("curves", "plot-keys", "Hover to read values and 95 % intervals; on the keyboard, left and right move along the curves.");
    this.choice.append(...plots.map((p, i) => h("option", { value: i }, p.title)));
    this.choice.addEventListener("change", () => this.show());
    for (const id of new Set(plots.map((p) => p.figure))) { // not drawn twice
      const link = h("a", { href: "#explore-title" }, "These curves are above.");
      document.getElementById(id)?.replaceWith(h("p", { class: "small" }, link));
    }
    const choice = h("div", { class: "controls" }, h("label", { for: "curves-of" }, "Curves of "), this.choice);
    this.element.append(choice, this.lines, this.box, this.keys);
    this.show();
  }

  private get shown(): Plot {
    return this.plots[Number(this.choice.value)];
  }

  private show(): void {
    const entries = this.shown.lines.map((look, i) => ({ look, more: "", data: { "data-series": i } }));
    for (const i of entries.keys()) this.visible.add(i);
    this.lines.replaceChildren(h("legend", { class: "hidden" }, "Executors"), ...legend(entries, this.visible, () => this.draw()));
    this.draw();
  }

  protected draw(): void {
    this.plot?.destroy();
    this.tip.hidden = true;
    this.index = -1;
    const { title, x, log, lines } = this.shown;
    const width = Math.floor(this.plotted.clientWidth);
    this.plotted.setAttribute("aria-label", `${title} over ${x}`);
    this.x = [...new Set(lines.flatMap((l) => l.x))].sort((a, b) => a - b);
    if (width === 0) return;
    const visible = lines.filter((_, i) => this.visible.has(i));
    const data = uPlot.join([[this.x], ...visible.map((l) => [l.x, l.value, l.low, l.high])] as uPlot.AlignedData[]);
    const range = log ? undefined : (_: uPlot, least: number, most: number): [number, number] => [Math.min(0, least), 1.05 * (most || 1)];
    const values = (_: uPlot, at: (number | null)[]): string[] => at.map((v) => (v === null ? "" : String(Number(v.toPrecision(6)))));
    this.plot = new uPlot({
      width, height: 340, legend: { show: false }, cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
      scales: { x: { time: false }, y: { distr: log ? 3 : 1, range } }, ...withIntervals(visible, this.x.length < 60 ? 5 : 0),
      axes: [axis({ label: x, labelSize: 20, size: 32 }), axis({ label: title, labelSize: 20, size: 62, values })],
      hooks: { setCursor: [(u) => this.hover(u)] },
    }, data, this.plotted);
  }

  protected length(): number {
    return this.x.length;
  }

  protected describe(index: number): void {
    const x = this.x[index];
    this.tell(index, `${this.shown.x} ${x}`, this.shown.lines.map((line, i) => {
      const at = this.visible.has(i) ? line.x.indexOf(x) : -1;
      return at < 0 ? null
        : valueRow(line, line.value[at].toFixed(3), line.low[at], line.high[at], { "data-series": i, "data-x": x, "data-value": line.value[at] });
    }));
  }
}
