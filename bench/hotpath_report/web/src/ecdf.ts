// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions with a logarithmic tail. uPlot's x axis stands upright and holds
// probabilities, its y axis lies and holds latencies.

import uPlot from "uplot";
import { axis, Readable, valueRow, withIntervals } from "./curves";
import type { Curve, Series, Target } from "./data";
import { h, percent, theme } from "./dom";

const BODY = 1.6; // length of the even part of the axis, in decades
const TICKS = [0, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 0.99999, 0.999999];
const HEIGHT = 340;

/** Position of a probability on the axis: even up to 0.9, then each decade of the tail has length 1. */
function place(q: number): number {
  return q <= 0.9 ? (BODY * q) / 0.9 : BODY - 1 - Math.log10(1 - q);
}

/** A range of latencies, in ms. */
export interface Range {
  from: number;
  to: number;
}

export class Ecdf extends Readable {
  readonly element = h("div", { class: "ecdf" });
  private target!: Target;
  private shown: Curve[] = [];
  private q: number[] = [];
  private brushed: Range | null = null;

  constructor(private readonly series: Series[], private readonly select: (range: Range, series: number) => void) {
    super("cumulative distribution", "ecdf-keys",
      "Drag over a range of latencies, or click a curve, to list these outputs. " +
      "Keys: up and down move along the curves, Enter lists the outputs of this part and the slower ones.");
    this.element.append(this.box, this.keys);
  }

  show(target: Target, visible: Set<number>): void {
    this.target = target;
    this.shown = target.curves.filter((c) => visible.has(c.series));
    this.index = -1;
    this.tip.hidden = true;
    this.plotted.setAttribute("aria-label", `${target.title}: ${target.measure}`);
    this.draw();
  }

  /** Marks a selected range of latencies. */
  mark(range: Range | null): void {
    this.brushed = range;
    this.plot?.redraw();
  }

  /** The curves that the tooltip describes at position `index` of the axis, for all widths. */
  private rows(index: number): { curve: Curve; at: number }[] {
    return this.shown.map((curve) => ({ curve, at: curve.q.indexOf(this.q[index]) })).filter((row) => row.at >= 0);
  }

  private data(): uPlot.AlignedData {
    this.q = this.shown.reduce<number[]>((longest, { q }) => (q.length > longest.length ? q : longest), []);
    const end = this.q.length > 1 ? place(this.q[this.q.length - 2]) + 0.3 : 1;
    const x = (q: number): number => (q < 1 ? place(q) : end);
    const joined = uPlot.join(this.shown.map((c) => [c.q.map(x), c.value, c.low, c.high]) as uPlot.AlignedData[]);
    return joined.map((column) => Array.from(column, (value) => value ?? null)) as uPlot.AlignedData;
  }

  private options(width: number, x: number[]): uPlot.Options {
    const ink = theme("ink");
    return {
      width, height: HEIGHT, ...withIntervals(this.shown.map((curve) => this.series[curve.series]), 0),
      legend: { show: false },
      cursor: { drag: { x: false, y: false, setScale: false }, points: { show: false }, x: false },
      scales: {
        x: { time: false, ori: 1, range: [0, x[x.length - 1] || 1] },
        y: { ori: 0, range: (_, __, max) => [0, 1.05 * Math.max(max, ...this.marksMs())] },
      },
      axes: [
        axis({
          side: 3, size: 62, splits: () => [...this.ticks().map(place), x[x.length - 1]],
          values: () => [...this.ticks().map(percent), "largest"],
        }),
        axis({
          side: 2, scale: "y", label: this.target.measure, labelSize: 20, size: 32, space: 56,
          values: (_, splits) => splits.map((v) => String(Number(v.toPrecision(6)))),
        }),
      ],
      hooks: {
        drawAxes: [(u) => this.drawMarks(u, ink)], // below the curves
        setCursor: [(u) => this.hover(u)],
        ready: [(u) => this.listen(u)],
      },
    };
  }

  private ticks(): number[] {
    return TICKS.filter((q) => q === 0 || q <= this.q[this.q.length - 2]);
  }

  private marksMs(): number[] {
    return this.target.marks.filter((m) => this.isShown(m.series)).map((m) => m.ms);
  }

  private isShown(series: number | null): boolean {
    return series === null || this.shown.some((c) => c.series === series);
  }

  protected draw(): void {
    this.plot?.destroy();
    this.plot = undefined;
    const width = Math.floor(this.plotted.clientWidth);
    if (!this.target || !this.shown.length || width === 0) return;
    const data = this.data();
    this.plot = new uPlot(this.options(width, data[0] as number[]), data, this.plotted);
  }

  /** Bounds, deadlines and the selected range. */
  private drawMarks(u: uPlot, ink: string): void {
    const { ctx, bbox } = u;
    const scale = devicePixelRatio;
    ctx.save();
    if (this.brushed) {
      const from = u.valToPos(this.brushed.from, "y", true);
      const to = u.valToPos(this.brushed.to, "y", true);
      ctx.fillStyle = theme("selection");
      ctx.fillRect(Math.max(bbox.left, from), bbox.top, Math.max(2 * scale, to - Math.max(bbox.left, from)), bbox.height);
    }
    ctx.font = `${11 * scale}px system-ui, sans-serif`;
    const ground = theme("ground");
    this.target.marks.filter((m) => this.isShown(m.series)).forEach((m, i) => {
      const x = u.valToPos(m.ms, "y", true);
      const colour = m.series === null ? ink : this.series[m.series].colour;
      ctx.strokeStyle = colour;
      ctx.lineWidth = scale;
      ctx.setLineDash([5 * scale, 4 * scale]);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      const left = x > bbox.left + bbox.width / 2;
      ctx.textAlign = left ? "right" : "left";
      const text = `${m.label} ${Number(m.ms.toPrecision(4))} ms`;
      const [at, y] = [x + (left ? -5 : 5) * scale, bbox.top + bbox.height - (10 + 16 * i) * scale];
      const width = ctx.measureText(text).width;
      ctx.fillStyle = `${ground}d0`;
      ctx.fillRect(left ? at - width - 2 : at - 2, y - 11 * scale, width + 4, 14 * scale);
      ctx.fillStyle = ink;
      ctx.fillText(text, at, y);
    });
    ctx.restore();
  }

  protected length(): number {
    return this.q.length;
  }

  /** Writes value and interval of each curve at a probability. */
  protected describe(index: number): void {
    const q = this.q[index];
    this.tell(index, q < 1 ? `${percent(q)} take at most` : "the largest", this.rows(index).map(({ curve, at }) =>
      valueRow(this.series[curve.series], `${curve.value[at].toFixed(3)} ms`, curve.low[at], curve.high[at],
        { "data-series": curve.series, "data-q": q, "data-ms": curve.value[at] })));
  }

  /** Selects by mouse: a dragged range, or the outputs between the neighbours on the nearest curve. */
  private listen(u: uPlot): void {
    let from: number | null = null;
    const value = (event: PointerEvent): number => {
      const x = event.clientX - u.over.getBoundingClientRect().left;
      return Math.max(0, u.posToVal(Math.min(Math.max(0, x), u.over.clientWidth), "y"));
    };
    u.over.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      from = event.offsetX;
      u.over.setPointerCapture(event.pointerId);
    });
    u.over.addEventListener("pointermove", (event) => {
      if (from === null || Math.abs(event.offsetX - from) < 4) return;
      const values = [u.posToVal(from, "y"), value(event)].sort((a, b) => a - b);
      this.mark({ from: values[0], to: values[1] });
    });
    u.over.addEventListener("pointerup", (event) => {
      if (from === null) return;
      const dragged = Math.abs(event.offsetX - from) >= 4;
      from = null;
      if (dragged && this.brushed) this.select(this.brushed, -1);
      else this.selectPart(value(event), false);
    });
  }

  /** Selects the outputs around the cursor's probability, under the executor nearest to `ms`. */
  private selectPart(ms: number, upwards: boolean): void {
    const rows = this.rows(this.index);
    if (!rows.length) return;
    const distance = (r: { curve: Curve; at: number }): number => Math.abs(r.curve.value[r.at] - ms);
    const { curve, at } = rows.reduce((a, b) => (distance(b) < distance(a) ? b : a));
    const from = curve.value[upwards ? at : Math.max(0, at - 1)];
    const to = curve.value[upwards ? curve.value.length - 1 : Math.min(at + 1, curve.value.length - 1)];
    this.select({ from, to }, curve.series);
  }

  protected enter(): void {
    this.selectPart(Infinity, true);
  }
}
