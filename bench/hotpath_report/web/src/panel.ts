// SPDX-License-Identifier: Apache-2.0
// One executor's rows in the timeline, with the account of a selected output above them.

import type { Cause, Job, Jobs, Output, Run, Series } from "./data";
import { ms, theme } from "./dom";
import { Row } from "./row";

export type RowsOf = "involved" | "tasks" | "threads";

const RUNNING = 0; // its place among the causes
const BAR = 20;
const HEAD = 20;

/** The visible part of the time axis, in ns, and its place on the canvas, in px. */
export type View = Record<"from" | "to" | "left" | "width", number>;

/** A rectangle of the last drawing, for tests. */
type Shown = { what: "part" | "path" | "behind" | "arrow"; name: string; left: number; right: number };

export class Panel {
  rows: Row[] = [];
  top = 0;
  readonly shown: Shown[] = [];
  private key: "worker" | "task" = "task"; // what has a row
  private rowOf = new Map<number, number>(); // by key
  private readonly chain: Set<number>;
  private readonly special = new Map<Job, string>(); // colours of jobs on the path and ahead of it

  constructor(
    readonly series: Series, readonly jobs: Jobs, readonly output: Output | null, private readonly run: Run,
    private readonly causes: Cause[], chain: string,
  ) {
    this.chain = new Set(run.graph?.chains.find((c) => c.name === chain)?.tasks);
    const mark = (task: number, sequence: number, cause: number): void => {
      const job = jobs.find(task, sequence);
      if (job) this.special.set(job, causes[cause].colour);
    };
    for (const part of output?.parts ?? []) mark(part.behind, part.behindSequence, part.cause);
    for (const [task, sequence] of output?.path ?? []) mark(task, sequence, RUNNING);
  }

  /** Tasks of the output's path and those that went first, in the order of time. */
  involved(): number[] {
    const o = this.output;
    if (!o || !o.parts.length) return [...this.chain];
    return [...o.path.map(([task]) => task), ...o.parts.map((p) => p.behind).filter((task) => task >= 0)];
  }

  layOut(rowsOf: RowsOf, tasks: number[]): void {
    const threads = rowsOf === "threads";
    const key = (this.key = threads ? "worker" : "task");
    const lists = new Map<number, Job[]>();
    for (const job of this.jobs.list) {
      const list = lists.get(job[key]);
      if (list) list.push(job);
      else lists.set(job[key], [job]);
    }
    const keys = rowsOf === "involved" && tasks.length ? tasks : [...lists.keys()].sort((a, b) => a - b);
    this.rowOf = new Map(keys.map((k, row) => [k, row]));
    this.rows = keys.map((k) => {
      const name = threads ? `thread ${k}` : this.run.tasks[k];
      return new Row(name, lists.get(k) ?? [], !threads && this.chain.has(k));
    });
  }

  get rowHeight(): number {
    return this.rows.length > 24 ? 12 : 17;
  }

  get bar(): number {
    return this.output?.parts.length ? BAR + 4 : 0;
  }

  get height(): number {
    return HEAD + this.bar + this.rows.length * this.rowHeight + 10;
  }

  /** Top of a row in px. */
  private y(row: number): number {
    return this.top + HEAD + this.bar + row * this.rowHeight;
  }

  private rowAt(job: Job | undefined): number | undefined {
    return job && this.rowOf.get(job[this.key]);
  }

  draw(ctx: CanvasRenderingContext2D, view: View): void {
    this.shown.length = 0;
    const x = (t: number): number => view.left + ((t - view.from) / (view.to - view.from)) * view.width;
    this.drawHead(ctx, view);
    ctx.save();
    ctx.beginPath();
    ctx.rect(view.left, this.top, view.width, this.height);
    ctx.clip();
    this.drawRows(ctx, view, x);
    if (this.output) {
      this.drawBar(ctx, x);
      this.drawArrows(ctx, x);
    }
    ctx.restore();
  }

  private drawHead(ctx: CanvasRenderingContext2D, view: View): void {
    const o = this.output;
    ctx.textBaseline = "middle";
    ctx.textAlign = "left";
    ctx.fillStyle = this.series.colour;
    ctx.fillRect(0, this.top + 4, 10, 10);
    ctx.fillStyle = theme("ink");
    ctx.font = "600 12px system-ui, sans-serif";
    const what = o ? `: output ${o.sequence} took ${ms(o.latency)} ms` : "";
    ctx.fillText(this.series.label + what, 16, this.top + 9);
    ctx.font = "11px system-ui, sans-serif";
    const grid = theme("grid");
    this.rows.forEach((row, k) => {
      const middle = this.y(k) + this.rowHeight / 2;
      ctx.fillStyle = theme("faint");
      ctx.fillText(clipped(ctx, row.name, view.left - 8), 2, middle);
      ctx.fillStyle = grid;
      ctx.fillRect(view.left, this.y(k) + this.rowHeight - 1, view.width, 0.5);
    });
  }

  private drawRows(ctx: CanvasRenderingContext2D, view: View, x: (t: number) => number): void {
    const perPixel = (view.to - view.from) / view.width;
    const faint = theme("job");
    const running = this.causes[RUNNING].colour;
    const special: [Job, number, number, number][] = [];
    this.rows.forEach((row, k) => {
      const top = this.y(k) + 2;
      const height = this.rowHeight - 5;
      let style = "";
      row.draw(view.from, view.to, perPixel, (from, to, share, job) => {
        const colour = row.marked || (job && this.chain.has(job.task)) ? running : faint;
        const wanted = colour + (colour === faint ? "" : "99");
        if (wanted !== style) ctx.fillStyle = style = wanted;
        ctx.globalAlpha = 0.25 + 0.75 * share; // a lone short job stays visible
        const left = x(from);
        const width = Math.max(1, x(to) - left);
        ctx.fillRect(left, top, width, height);
        if (job && this.special.has(job)) special.push([job, left, width, top]);
      });
    });
    ctx.globalAlpha = 1;
    for (const [job, left, width, top] of special) {
      ctx.fillStyle = this.special.get(job) ?? faint;
      ctx.fillRect(left, top - 1, width, this.rowHeight - 3);
      ctx.strokeStyle = theme("ink");
      ctx.lineWidth = 1;
      ctx.strokeRect(left, top - 1, width, this.rowHeight - 3);
      const name = `${this.run.tasks[job.task]} ${job.sequence}`;
      const onPath = this.output?.path.some(([task, sequence]) => task === job.task && sequence === job.sequence);
      this.shown.push({ what: onPath ? "path" : "behind", name, left, right: left + width });
    }
  }

  /** The causes of the output, in the order of time. */
  private drawBar(ctx: CanvasRenderingContext2D, x: (t: number) => number): void {
    const o = this.output;
    if (!o) return;
    let from = o.end - o.latency;
    const top = this.top + HEAD;
    for (const part of o.parts) {
      const left = x(from);
      const right = x((from += part.ns));
      ctx.fillStyle = this.causes[part.cause].colour;
      ctx.fillRect(left, top, right - left, BAR);
      ctx.strokeStyle = theme("ink");
      ctx.lineWidth = 0.8;
      ctx.strokeRect(left, top, right - left, BAR);
      const name = this.causes[part.cause].phrase;
      this.shown.push({ what: "part", name, left, right });
      ctx.fillStyle = part.cause === RUNNING ? "#ffffff" : "#111111";
      const fits = [name, this.causes[part.cause].name].find((text) => ctx.measureText(text).width <= right - left - 6);
      if (fits) ctx.fillText(fits, left + 3, top + BAR / 2 + 1);
    }
  }

  /** From each publication on the path to the callback that it started. */
  private drawArrows(ctx: CanvasRenderingContext2D, x: (t: number) => number): void {
    const path = (this.output?.path ?? []).map((step) => this.jobs.find(...step));
    ctx.strokeStyle = ctx.fillStyle = theme("ink");
    ctx.lineWidth = 1.3;
    for (let k = 1; k < path.length; ++k) {
      const [a, b] = [path[k - 1], path[k]];
      const [rowA, rowB] = [this.rowAt(a), this.rowAt(b)];
      if (!a || !b || rowA === undefined || rowB === undefined) continue;
      const from = { x: x(a.end), y: this.y(rowA) + this.rowHeight / 2 };
      const to = { x: x(b.start), y: this.y(rowB) + this.rowHeight / 2 };
      const down = to.x - from.x < 14 && rowA !== rowB; // from edge to edge instead of a curve
      const half = Math.sign(rowB - rowA) * (this.rowHeight / 2 - 2);
      if (down) [from.y, to.y] = [from.y + half, to.y - half];
      const bend = Math.max(8, Math.abs(to.x - from.x) / 2);
      ctx.beginPath();
      ctx.moveTo(from.x, from.y);
      if (down) ctx.lineTo(to.x, to.y);
      else ctx.bezierCurveTo(from.x + bend, from.y, to.x - bend, to.y, to.x - 1, to.y);
      ctx.stroke();
      ctx.beginPath();
      ctx.moveTo(to.x, to.y);
      const back = down ? Math.sign(half) * 5 : 6;
      ctx.lineTo(to.x - (down ? 3.5 : back), to.y - (down ? back : 3.5));
      ctx.lineTo(to.x + (down ? 3.5 : -back), to.y - (down ? back : -3.5));
      ctx.fill();
      this.shown.push({ what: "arrow", name: "", left: from.x, right: to.x });
    }
  }

  /** The job at a place of the canvas. */
  at(px: number, py: number, view: View): Job | undefined {
    const row = this.rows[Math.floor((py - this.y(0)) / this.rowHeight)];
    if (py < this.y(0)) return undefined;
    const perPixel = (view.to - view.from) / view.width;
    const instant = view.from + (px - view.left) * perPixel;
    let found: Job | undefined;
    row?.draw(instant - perPixel, instant + perPixel, perPixel / 1e6, (from, to, _, job) => {
      if (from <= instant + perPixel && instant - perPixel <= to) found = job;
    });
    return found;
  }

  describe(job: Job): string {
    return (
      `${this.run.tasks[job.task]} ${job.sequence}\nruns ${ms(job.end - job.start)} ms from ` +
      `${(job.start / 1e9).toFixed(6)} s, on thread ${job.worker}\nreleased ${ms(job.start - job.release)} ms before its start`
    );
  }
}

/** Text that fits into a width, with an ellipsis. */
function clipped(ctx: CanvasRenderingContext2D, text: string, width: number): string {
  if (ctx.measureText(text).width <= width) return text;
  let length = Math.max(0, Math.floor((text.length * width) / ctx.measureText(text).width) - 1);
  while (length > 0 && ctx.measureText(`${text.slice(0, length)}…`).width > width) --length;
  return `${text.slice(0, length)}…`;
}
