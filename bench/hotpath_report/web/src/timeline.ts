// SPDX-License-Identifier: Apache-2.0
// A timeline of jobs that pans and zooms. Two executors share one time axis.

import { account } from "./account";
import type { Output, Store, Target } from "./data";
import { Choice, h, onLook, seconds } from "./dom";
import { Panel, type RowsOf } from "./panel";
import { View } from "./view";

const AXIS = 24; // px

export class Timeline {
  readonly element: HTMLElement;
  readonly view = new View(() => this.request());
  panels: Panel[] = [];
  drawings = 0;
  private readonly canvas = h("canvas", {
    tabindex: 0, role: "application", "aria-roledescription": "timeline", "aria-describedby": "timeline-keys",
    keydown: (event: KeyboardEvent) => this.key(event),
    pointerdown: (event: PointerEvent) => this.drag(event),
    pointerup: () => (this.dragged = null),
    pointermove: (event: PointerEvent) => this.move(event),
    pointerleave: () => (this.tip.hidden = true),
    dblclick: (event: MouseEvent) => this.view.zoom(0.5, this.share(event)),
    wheel: (event: WheelEvent) => this.wheel(event),
  });
  private readonly tip = h("div", { class: "tip", hidden: true });
  private readonly note = h("p", { class: "faint small" });
  private readonly rowsOf: Choice;
  private readonly causes = h("div", { class: "causes" });
  private pending = false;
  private drawn = 0; // width of the last drawing
  private dragged: number | null = null; // place of the pressed pointer

  constructor(private readonly store: Store) {
    const button = (text: string, label: string, click: () => void): HTMLElement =>
      h("button", { type: "button", "aria-label": label, click }, text);
    this.rowsOf = new Choice("rows-of", "Rows: ", () => this.layOut(),
      button("−", "Zoom out", () => this.view.zoom(2)), button("+", "Zoom in", () => this.view.zoom(0.5)),
      button("selected output", "Show the selected output", () => this.toOutput()),
      button("whole repetition", "Show the whole repetition", () => this.view.look()));
    this.rowsOf.offer([["involved", "tasks involved"], ["tasks", "all tasks"], ["threads", "threads"]]);
    this.element = h("section", { class: "timeline", "aria-label": "Timeline" },
      this.rowsOf.element, h("div", { class: "canvas" }, this.canvas, this.tip),
      h("p", { id: "timeline-keys", class: "faint small" },
        "Drag to pan; Ctrl and wheel, or double click, to zoom. Keys: left and right pan, + and − zoom, Home shows " +
        "the whole repetition, Enter the selected output."),
      this.note, this.causes);
    onLook(this.element, () => this.drawn, () => this.request());
  }

  /** Shows one or two outputs, or without any the first repetition of an executor. */
  show(target: Target, chosen: (Output | null)[], series: number): void {
    this.panels = chosen.flatMap((output) => {
      const of = output?.series ?? series;
      const jobs = this.store.jobsOf(of, output?.repetition);
      return jobs ? [new Panel(this.store, jobs, this.store.document.series[of], output, target)] : [];
    });
    this.view.length = Math.max(1, ...this.panels.map((p) => p.jobs.of.length_ns));
    this.element.hidden = this.panels.length === 0;
    this.causes.replaceChildren(...this.panels.flatMap(({ output }) => (output ? [account(this.store, target, output)] : [])));
    this.layOut();
    chosen[0] ? this.toOutput() : this.view.look();
  }

  private layOut(): void {
    const tasks = [...new Set(this.panels.flatMap((p) => p.involved()))];
    for (const panel of this.panels) panel.layOut(this.rowsOf.value as RowsOf, tasks);
    this.request();
  }

  private toOutput(): void {
    const shown = this.panels.flatMap(({ output }) => output ?? []);
    if (!shown.length) return;
    const from = Math.min(...shown.map((o) => o.end - o.latency));
    const to = Math.max(...shown.map((o) => o.end));
    const margin = Math.max(1000, (to - from) * 0.12);
    this.view.look(from - margin, to + margin);
  }

  private request(): void {
    if (!this.pending) requestAnimationFrame(() => this.pending && this.draw());
    this.pending = true;
  }

  draw(): void {
    this.pending = false;
    const width = Math.floor(this.element.clientWidth);
    const ctx = this.canvas.getContext("2d");
    if (width === 0 || !this.panels.length || !ctx) return;
    this.drawn = width;
    ++this.drawings;
    this.view.left = width < 700 ? 110 : 230;
    this.view.width = width - this.view.left - 4;
    let height = AXIS;
    for (const panel of this.panels) {
      panel.top = height;
      height += panel.height;
    }
    const scale = devicePixelRatio;
    Object.assign(this.canvas, { width: Math.round(width * scale), height: Math.round(height * scale) }); // clears it
    Object.assign(this.canvas.style, { width: `${width}px`, height: `${height}px` });
    ctx.scale(scale, scale);
    this.view.draw(ctx, height);
    for (const panel of this.panels) panel.draw(ctx, this.view);
    this.tellView();
  }

  private tellView(): void {
    const { from, to } = this.view;
    const whole = this.panels.every(({ jobs }) => jobs.of.kept_ns.some(([a, b]) => a <= from && to <= b));
    this.note.textContent = whole ? "" : "Shaded times: the page leaves out these jobs; `hotpath export perfetto` has them.";
    const names = this.panels.map((p) => p.series.label).join(" and ");
    this.canvas.setAttribute("aria-label", `Timeline of ${names}, ${seconds(from)} to ${seconds(to)}`);
  }

  /** Place of the pointer on the time axis. */
  private share(event: MouseEvent): number {
    return (event.offsetX - this.view.left) / this.view.width;
  }

  private drag(event: PointerEvent): void {
    this.dragged = event.offsetX;
    this.canvas.setPointerCapture(event.pointerId);
  }

  private move({ offsetX: x, offsetY: y }: PointerEvent): void {
    if (this.dragged !== null) {
      this.view.pan((this.dragged - x) / this.view.width);
      this.dragged = x;
      return;
    }
    const text = this.panels.find((p) => p.top <= y && y < p.top + p.height)?.describe(x, y, this.view);
    this.tip.hidden = !text;
    if (!text) return;
    this.tip.textContent = text;
    const width = this.canvas.clientWidth;
    const [left, right] = x > width / 2 ? ["", `${width - x + 14}px`] : [`${x + 14}px`, ""];
    Object.assign(this.tip.style, { left, right, top: `${y + 14}px` });
  }

  private wheel(event: WheelEvent): void {
    if (!event.ctrlKey && !event.shiftKey) return;
    event.preventDefault();
    if (event.shiftKey) this.view.pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
    else this.view.zoom(1.2 ** Math.sign(event.deltaY), this.share(event));
  }

  private key(event: KeyboardEvent): void {
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.view.pan(-0.15), ArrowRight: () => this.view.pan(0.15), Home: () => this.view.look(), Enter: () => this.toOutput(),
      "+": () => this.view.zoom(0.6), "=": () => this.view.zoom(0.6), "-": () => this.view.zoom(1 / 0.6),
    };
    if (!(event.key in keys) || event.ctrlKey || event.altKey || event.metaKey) return;
    keys[event.key]();
    event.preventDefault();
  }
}
