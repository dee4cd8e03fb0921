// SPDX-License-Identifier: Apache-2.0
// One executor's rows in the timeline, with the causes of a selected output above them.

import type { Job, Jobs, Output, Run, Store, Target } from "./data";
import { ms, seconds, theme } from "./dom";
import { SMALL, type View } from "./view";

export type RowsOf = "involved" | "tasks" | "threads";

const BAR = 20;
const HEAD = 20;
const STEPS = 8; // shares of a pixel that are told apart

/** Jobs in order of start; `marked`: all of them belong to the selected chain. */
type Row = { name: string; jobs: Job[]; marked: boolean };

/** A job, or a time and the share of it in which jobs run. */
type Block = { job?: Job; start: number; end: number; share: number };

/** A rectangle of the last drawing, for tests. */
type Shown = { what: "part" | "path" | "behind" | "arrow"; name: string; left: number; right: number };

export class Panel {
  rows: Row[] = [];
  top = 0;
  readonly shown: Shown[] = [];
  private readonly run: Run;
  private readonly chain: Set<number>; // its tasks
  private rowOf = (_: Job): number => -1;

  constructor(
    private readonly store: Store, readonly jobs: Jobs, readonly series: Store["document"]["series"][number],
    readonly output: Output | null, target: Target,
  ) {
    this.run = store.document.runs[series.run];
    const chain = target.kind === "chain" ? target.name : "";
    this.chain = new Set(this.run.graph?.chains.find((c) => c.name === chain)?.tasks);
  }

  /** Tasks of the output's path and those that went first, in the order of time. */
  involved(): number[] {
    const { path, parts } = this.output ?? { path: [], parts: [] };
    return parts.length ? [...path.map(([task]) => task), ...parts.map((part) => part[3]).filter((task) => task >= 0)] : [...this.chain];
  }

  layOut(rowsOf: RowsOf, tasks: number[]): void {
    const key = rowsOf === "threads" ? "worker" : "task";
    const lists = new Map<number, Job[]>();
    for (const job of this.jobs.list) lists.get(job[key])?.push(job) ?? lists.set(job[key], [job]);
    const keys = rowsOf === "involved" && tasks.length ? tasks : [...lists.keys()].sort((a, b) => a - b);
    this.rowOf = (job) => keys.indexOf(job[key]);
    this.rows = keys.map((k) => ({
      name: key === "worker" ? `thread ${k}` : this.run.tasks[k], jobs: lists.get(k) ?? [], marked: key === "task" && this.chain.has(k),
    }));
  }

  private get rowHeight(): number {
    return this.rows.length > 24 ? 12 : 17;
  }

  /** Top of a row in px. */
  private y(row: number): number {
    return this.top + HEAD + (this.output?.parts.length ? BAR + 4 : 0) + row * this.rowHeight;
  }

  get height(): number {
    return this.y(this.rows.length) - this.top + 10;
  }

  draw(ctx: CanvasRenderingContext2D, view: View): void {
    this.shown.length = 0;
    this.drawHead(ctx, view);
    ctx.save();
    ctx.beginPath();
    ctx.rect(view.left, this.top, view.width, this.height);
    ctx.clip();
    this.drawMissing(ctx, view);
    this.drawJobs(ctx, view);
    if (this.output) {
      this.drawPath(ctx, view, this.output);
      this.drawBar(ctx, view, this.output);
      this.drawArrows(ctx, view, this.output);
    }
    ctx.restore();
  }

  private drawHead(ctx: CanvasRenderingContext2D, view: View): void {
    const o = this.output;
    ctx.fillStyle = this.series.colour;
    ctx.fillRect(0, this.top + 4, 10, 10);
    Object.assign(ctx, { fillStyle: theme("ink"), font: "600 12px system-ui, sans-serif", textAlign: "left" });
    ctx.fillText(this.series.label + (o ? `: output ${o.sequence} took ${ms(o.latency)} ms` : ""), 16, this.top + 9);
    ctx.font = SMALL;
    const [faint, grid] = [theme("faint"), theme("grid")];
    this.rows.forEach(({ name }, k) => {
      ctx.fillStyle = faint;
      ctx.fillText(clipped(ctx, name, view.left - 8), 2, this.y(k) + this.rowHeight / 2);
      ctx.fillStyle = grid;
      ctx.fillRect(view.left, this.y(k) + this.rowHeight - 1, view.width, 0.5);
    });
  }

  /** What the page left out. */
  private drawMissing(ctx: CanvasRenderingContext2D, view: View): void {
    ctx.fillStyle = theme("missing");
    let last = 0;
    for (const [from, to] of [...this.jobs.of.kept_ns, [view.length, view.length]]) {
      if (from > last) ctx.fillRect(view.x(last), this.top, view.x(from) - view.x(last), this.height);
      last = Math.max(last, to);
    }
  }

  /** The visible jobs of a row, or sums if they are many. */
  private *blocks({ jobs }: Row, { from, to, pixel, width }: View): Iterable<Block> {
    const visible = jobs.filter((job) => job.end > from && job.start < to);
    if (visible.length < width / 4) {
      for (const job of visible) yield { job, start: job.start, end: job.end, share: 1 };
      return;
    }
    const first = Math.floor(from / pixel);
    const busy = new Float64Array(Math.ceil(to / pixel) - first + 1); // by pixel; nothing runs in the last one
    for (const { start, end } of visible) {
      const last = Math.min(busy.length - 2, Math.ceil(end / pixel) - 1 - first);
      for (let b = Math.max(0, Math.floor(start / pixel) - first); b <= last; ++b) {
        busy[b] += Math.min(end / pixel, first + b + 1) - Math.max(start / pixel, first + b);
      }
    }
    let [begin, share] = [0, 0];
    for (const [b, of] of busy.entries()) {
      const rounded = Math.ceil(STEPS * Math.min(1, of));
      if (rounded === share) continue;
      if (share > 0) yield { start: (first + begin) * pixel, end: (first + b) * pixel, share: share / STEPS };
      [begin, share] = [b, rounded];
    }
  }

  private drawJobs(ctx: CanvasRenderingContext2D, view: View): void {
    const faint = theme("job");
    const running = `${this.store.document.causes[this.store.running].colour}99`;
    this.rows.forEach((row, k) => {
      const [top, height] = [this.y(k) + 2, this.rowHeight - 5];
      for (const { job, start, end, share } of this.blocks(row, view)) {
        const left = view.x(start);
        ctx.fillStyle = row.marked || (job && this.chain.has(job.task)) ? running : faint;
        ctx.globalAlpha = 0.25 + 0.75 * share; // a lone short job stays visible
        ctx.fillRect(left, top, Math.max(1, view.x(end) - left), height);
      }
    });
    ctx.globalAlpha = 1;
  }

  /** The jobs on the output's path, and those that went first. */
  private drawPath(ctx: CanvasRenderingContext2D, view: View, { path, parts }: Output): void {
    ctx.strokeStyle = theme("ink");
    ctx.lineWidth = 1;
    const draw = (what: "path" | "behind", task: number, sequence: number, cause: number): void => {
      const job = this.jobs.find(task, sequence);
      const row = job ? this.rowOf(job) : -1;
      if (!job || row < 0) return;
      const [left, top, height] = [view.x(job.start), this.y(row) + 1, this.rowHeight - 3];
      const width = Math.max(1, view.x(job.end) - left);
      ctx.fillStyle = this.store.document.causes[cause].colour;
      ctx.fillRect(left, top, width, height);
      ctx.strokeRect(left, top, width, height);
      this.shown.push({ what, name: `${this.run.tasks[task]} ${sequence}`, left, right: left + width });
    };
    for (const [cause, , , task, sequence] of parts) draw("behind", task, sequence, cause);
    for (const [task, sequence] of path) draw("path", task, sequence, this.store.running);
  }

  /** The causes of the output, in the order of time. */
  private drawBar(ctx: CanvasRenderingContext2D, view: View, o: Output): void {
    let from = o.end - o.latency;
    const top = this.top + HEAD;
    ctx.lineWidth = 0.8;
    for (const [cause, , , , , ns] of o.parts) {
      const [left, right] = [view.x(from), view.x((from += ns))];
      const { phrase, name, colour } = this.store.document.causes[cause];
      ctx.fillStyle = colour;
      ctx.fillRect(left, top, right - left, BAR);
      ctx.strokeRect(left, top, right - left, BAR);
      this.shown.push({ what: "part", name: phrase, left, right });
      ctx.fillStyle = cause === this.store.running ? "#ffffff" : "#111111";
      const fits = [phrase, name].find((text) => ctx.measureText(text).width <= right - left - 6);
      if (fits) ctx.fillText(fits, left + 3, top + BAR / 2 + 1);
    }
  }

  /** From each publication on the path to the callback that it started. */
  private drawArrows(ctx: CanvasRenderingContext2D, view: View, o: Output): void {
    const path = o.path.map((step) => this.jobs.find(...step));
    ctx.strokeStyle = ctx.fillStyle = theme("ink");
    ctx.lineWidth = 1.3;
    path.forEach((b, k) => {
      const a = path[k - 1];
      if (!a || !b || this.rowOf(a) < 0 || this.rowOf(b) < 0) return;
      const rows = Math.sign(this.rowOf(b) - this.rowOf(a));
      const [x0, x1] = [view.x(a.end), view.x(b.start)];
      const down = x1 - x0 < 14 && rows !== 0; // from edge to edge instead of a curve
      const edge = down ? rows * (this.rowHeight / 2 - 2) : 0;
      const [y0, y1] = [this.y(this.rowOf(a)) + this.rowHeight / 2 + edge, this.y(this.rowOf(b)) + this.rowHeight / 2 - edge];
      const bend = Math.max(8, Math.abs(x1 - x0) / 2);
      ctx.beginPath();
      ctx.moveTo(x0, y0);
      if (down) ctx.lineTo(x1, y1);
      else ctx.bezierCurveTo(x0 + bend, y0, x1 - bend, y1, x1 - 1, y1);
      ctx.stroke();
      ctx.beginPath();
      ctx.moveTo(x1, y1);
      for (const side of [-3.5, 3.5]) ctx.lineTo(x1 + (down ? side : -6), y1 + (down ? -5 * rows : side));
      ctx.fill();
      this.shown.push({ what: "arrow", name: "", left: x0, right: x1 });
    });
  }

  /** Describes the job at a place of the canvas. */
  describe(px: number, py: number, view: View): string {
    const [instant, near] = [view.from + (px - view.left) * view.pixel, view.pixel];
    const row = this.rows[Math.floor((py - this.y(0)) / this.rowHeight)];
    const job = row?.jobs.filter(({ start, end }) => start <= instant + near && instant - near <= end).at(-1);
    if (!job) return "";
    return (
      `${this.run.tasks[job.task]} ${job.sequence}\nruns ${ms(job.end - job.start)} ms from ${seconds(job.start)}, ` +
      `on thread ${job.worker}\nreleased ${ms(job.start - job.release)} ms before its start`
    );
  }
}

/** Text that fits into a width, with an ellipsis. */
function clipped(ctx: CanvasRenderingContext2D, text: string, width: number): string {
  let fits = text;
  for (let n = text.length; n > 0 && ctx.measureText(fits).width > width; fits = `${text.slice(0, n)}…`) {
    n = Math.min(n - 1, Math.floor((text.length * width) / ctx.measureText(text).width));
  }
  return fits;
}
