// SPDX-License-Identifier: Apache-2.0
// A timeline of jobs that pans and zooms. Two executors share one time axis.

import type { Output, Store, Target } from "./data";
import { h, ms, onTheme, onWidth, theme } from "./dom";
import { Panel, type RowsOf, type View } from "./panel";

/** A word of a shell's command line. */
function quoted(word: string): string {
  return /^[\w./:=@+-]+$/.test(word) ? word : `'${word.replace(/'/g, "'\\''")}'`;
}

const AXIS = 24;
const SHORTEST = 1000; // ns in view

export class Timeline {
  readonly element = h("section", { class: "timeline", "aria-label": "Timeline" });
  panels: Panel[] = [];
  drawings = 0;
  private readonly canvas = h("canvas", {
    tabindex: 0, role: "application", "aria-roledescription": "timeline", "aria-describedby": "timeline-keys",
  });
  private readonly tip = h("div", { class: "tip", hidden: true });
  private readonly note = h("p", { class: "faint small" });
  private readonly rowsOf = h("select", { id: "rows-of" });
  private readonly causes = h("div", { class: "causes" });
  private readonly view: View = { from: 0, to: 1, left: 200, width: 800 };
  private length = 1; // of the repetition, in ns
  private pending = false;
  private width = 0; // of the last drawing

  constructor(private readonly store: Store) {
    const option = (value: RowsOf, text: string): HTMLElement => h("option", { value }, text);
    this.rowsOf.append(option("involved", "tasks involved"), option("tasks", "all tasks"), option("threads", "threads"));
    this.rowsOf.addEventListener("change", () => this.layOut());
    const button = (text: string, label: string, act: () => void): HTMLElement =>
      h("button", { type: "button", "aria-label": label, click: act }, text);
    this.element.append(
      h("div", { class: "controls" },
        h("label", { for: "rows-of" }, "Rows: "), this.rowsOf,
        button("−", "Zoom out", () => this.zoom(2)), button("+", "Zoom in", () => this.zoom(0.5)),
        button("selected output", "Show the selected output", () => this.toOutput()),
        button("whole repetition", "Show the whole repetition", () => this.toAll())),
      h("div", { class: "canvas" }, this.canvas, this.tip),
      h("p", { id: "timeline-keys", class: "faint small" },
        "Drag to pan; Ctrl and wheel, or double click, to zoom. Keys: left and right pan, + and − zoom, Home shows " +
        "the whole repetition, Enter the selected output."),
      this.note, this.causes,
    );
    this.listen();
    onWidth(this.element, () => this.width, () => this.request());
    onTheme(() => this.request());
  }

  /** Shows one or two outputs, or without any the first repetition of an executor. */
  show(target: Target, chosen: (Output | null)[], series: number): void {
    const chain = target.kind === "chain" ? target.name : "";
    const { series: all, causes } = this.store.document;
    this.panels = [];
    for (const output of chosen) {
      const of = output?.series ?? series;
      const jobs = this.store.jobsOf(of, output?.repetition ?? this.store.repetitions(of)[0]?.repetition);
      if (jobs) this.panels.push(new Panel(all[of], jobs, output, this.store.run(of), causes, chain));
    }
    this.length = Math.max(1, ...this.panels.map((p) => p.jobs.of.length_ns));
    this.element.hidden = this.panels.length === 0;
    this.causes.replaceChildren(...this.panels.flatMap((p) => (p.output ? [this.account(target, p, p.output)] : [])));
    this.layOut();
    chosen[0] ? this.toOutput() : this.toAll();
  }

  private layOut(): void {
    const tasks = [...new Set(this.panels.flatMap((p) => p.involved()))];
    for (const panel of this.panels) panel.layOut(this.rowsOf.value as RowsOf, tasks);
    this.request();
  }

  /** Shows [from, to), in ns since the epoch. */
  look(from: number, to: number): void {
    const span = Math.min(this.length, Math.max(SHORTEST, to - from));
    const middle = (from + to) / 2;
    this.view.from = Math.min(Math.max(0, middle - span / 2), Math.max(0, this.length - span));
    this.view.to = this.view.from + span;
    this.request();
  }

  toAll = (): void => this.look(0, this.length);

  toOutput(): void {
    const shown = this.panels.map((p) => p.output).filter((o): o is Output => o !== null);
    if (!shown.length) return;
    const from = Math.min(...shown.map((o) => o.end - o.latency));
    const to = Math.max(...shown.map((o) => o.end));
    const margin = Math.max(1000, (to - from) * 0.12);
    this.look(from - margin, to + margin);
  }

  pan(share: number): void {
    const by = share * (this.view.to - this.view.from);
    this.look(this.view.from + by, this.view.to + by);
  }

  zoom(factor: number, at = 0.5): void {
    const { from, to } = this.view;
    const span = Math.min(this.length, Math.max(SHORTEST, (to - from) * factor));
    const fixed = from + at * (to - from);
    this.look(fixed - at * span, fixed + (1 - at) * span);
  }

  private request(): void {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame(() => {
      if (this.pending) this.draw();
    });
  }

  draw(): void {
    this.pending = false;
    const width = Math.floor(this.element.clientWidth);
    if (width === 0 || !this.panels.length) return;
    this.width = width;
    ++this.drawings;
    this.view.left = width < 700 ? 110 : 230;
    this.view.width = width - this.view.left - 4;
    let height = AXIS;
    for (const panel of this.panels) {
      panel.top = height;
      height += panel.height;
    }
    const scale = devicePixelRatio;
    if (this.canvas.width !== Math.round(width * scale) || this.canvas.height !== Math.round(height * scale)) {
      this.canvas.width = Math.round(width * scale);
      this.canvas.height = Math.round(height * scale);
      this.canvas.style.width = `${width}px`;
      this.canvas.style.height = `${height}px`;
    }
    const ctx = this.canvas.getContext("2d");
    if (!ctx) return;
    ctx.setTransform(scale, 0, 0, scale, 0, 0);
    ctx.clearRect(0, 0, width, height);
    this.drawAxis(ctx, height);
    for (const panel of this.panels) panel.draw(ctx, this.view);
    this.tellView();
  }

  /** The axis, and what the page left out. */
  private drawAxis(ctx: CanvasRenderingContext2D, height: number): void {
    const { from, to, left, width } = this.view;
    const wanted = ((to - from) / width) * 110;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= wanted) ?? wanted;
    ctx.font = "11px system-ui, sans-serif";
    ctx.textBaseline = "middle";
    ctx.textAlign = "center";
    const faint = theme("faint");
    const grid = theme("grid");
    const digits = Math.max(0, Math.ceil(-Math.log10(step / 1e9)));
    for (let t = Math.ceil(from / step) * step; t <= to; t += step) {
      const x = left + ((t - from) / (to - from)) * width;
      ctx.fillStyle = grid;
      ctx.fillRect(x, 16, 1, height - 16);
      ctx.fillStyle = faint;
      ctx.fillText(`${(t / 1e9).toFixed(digits)} s`, Math.min(Math.max(x, left + 20), left + width - 24), 8);
    }
    ctx.fillStyle = theme("missing");
    for (const panel of this.panels) {
      let last = 0;
      for (const [a, b] of [...panel.jobs.of.kept_ns, [this.length, this.length]]) {
        const x0 = left + (Math.max(last, from) - from) / (to - from) * width;
        const x1 = left + (Math.min(a, to) - from) / (to - from) * width;
        if (x1 > x0) ctx.fillRect(x0, panel.top, x1 - x0, panel.height);
        last = Math.max(last, b);
      }
    }
  }

  private tellView(): void {
    const { from, to } = this.view;
    const gap = this.panels.some((p) => !p.jobs.kept(from, Math.min(to, this.length)));
    this.note.textContent = gap ? "Shaded times: the page leaves out these jobs; `hotpath export perfetto` has them." : "";
    const names = this.panels.map((p) => p.series.label).join(" and ");
    const span = `${(from / 1e9).toFixed(6)} s to ${(to / 1e9).toFixed(6)} s`;
    this.canvas.setAttribute("aria-label", `Timeline of ${names}, ${span}`);
  }

  /** The command that explains an output again. */
  private command(target: Target, o: Output): string {
    const run = this.store.run(o.series).name;
    const words = ["--executor", this.store.document.series[o.series].executor, `--${target.kind}`, target.name];
    return ["hotpath explain", quoted(run), ...words.map(quoted), "--repetition", o.repetition, "--sequence", o.sequence].join(" ");
  }

  /** A table of the parts of an output, as `hotpath explain` prints it. */
  private account(target: Target, panel: Panel, o: Output): HTMLElement {
    const tasks = this.store.run(o.series).tasks;
    const name = (task: number, sequence: number): string => (task < 0 ? "" : `${tasks[task]} ${sequence}`);
    const { causes, rules } = this.store.document;
    const chip = (cause: number): HTMLElement =>
      h("span", { class: "chip-colour", style: `background:${causes[cause].colour}` });
    const sums = (o.causes ?? []).map((ns, c) =>
      ns > 0 ? h("li", { "data-cause": causes[c].name, "data-ns": ns }, chip(c), ` ${causes[c].phrase}: ${ms(ns)} ms`) : null,
    );
    let from = 0;
    const rows = o.parts.map((p) => {
      const cells = [
        ms(from), ms(p.ns), causes[p.cause].phrase,
        name(...o.path[p.step]), name(p.behind, p.behindSequence), rules[p.rule],
      ];
      from += p.ns;
      return h("tr", {}, ...cells.map((c) => h("td", {}, c)));
    });
    const header = ["from ms", "for ms", "cause", "job", "behind", "because"];
    return h("div", { class: "account", "data-series": o.series },
      h("h4", {}, `${panel.series.label}: ${ms(o.latency)} ms of output ${o.sequence}`),
      h("ul", {}, ...sums),
      h("p", { class: "small" }, h("code", {}, this.command(target, o))),
      rows.length === 0 ? null : h("details", {}, h("summary", {}, `${rows.length} parts in the order of time`),
        h("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": "Parts of the latency" },
          h("table", { class: "data" },
            h("thead", {}, h("tr", {}, ...header.map((t) => h("th", { scope: "col" }, t)))), h("tbody", {}, ...rows)))));
  }

  private listen(): void {
    const place = (event: MouseEvent): number => (event.offsetX - this.view.left) / this.view.width;
    let dragged: number | null = null;
    this.canvas.addEventListener("pointerdown", (event) => {
      dragged = event.offsetX;
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointerup", () => (dragged = null));
    this.canvas.addEventListener("pointermove", (event) => {
      if (dragged !== null) {
        this.pan((dragged - event.offsetX) / this.view.width);
        dragged = event.offsetX;
      } else {
        this.hover(event);
      }
    });
    this.canvas.addEventListener("pointerleave", () => (this.tip.hidden = true));
    this.canvas.addEventListener("dblclick", (event) => this.zoom(0.5, place(event)));
    this.canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      if (event.shiftKey) this.pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
      else this.zoom(1.2 ** Math.sign(event.deltaY), place(event));
    }, { passive: false });
    const keys: Record<string, () => void> = {
      ArrowLeft: () => this.pan(-0.15), ArrowRight: () => this.pan(0.15), Home: this.toAll, Enter: () => this.toOutput(),
      "+": () => this.zoom(0.6), "=": () => this.zoom(0.6), "-": () => this.zoom(1 / 0.6),
    };
    this.canvas.addEventListener("keydown", (event) => {
      if (!(event.key in keys) || event.ctrlKey || event.altKey || event.metaKey) return;
      keys[event.key]();
      event.preventDefault();
    });
  }

  private hover(event: PointerEvent): void {
    const panel = this.panels.find((p) => p.top <= event.offsetY && event.offsetY < p.top + p.height);
    const job = panel?.at(event.offsetX, event.offsetY, this.view);
    this.tip.hidden = !job;
    if (!panel || !job) return;
    this.tip.textContent = panel.describe(job);
    const right = event.offsetX > this.canvas.clientWidth / 2;
    this.tip.style.left = right ? "" : `${event.offsetX + 14}px`;
    this.tip.style.right = right ? `${this.canvas.clientWidth - event.offsetX + 14}px` : "";
    this.tip.style.top = `${event.offsetY + 14}px`;
  }
}
