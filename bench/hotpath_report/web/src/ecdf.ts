// SPDX-License-Identifier: Apache-2.0
// Cumulative distributions with a logarithmic tail. uPlot's x axis stands upright and holds
// probabilities, its y axis lies and holds latencies.

import type uPlot from "uplot";
import { axis, Curves, numbers } from "./curves";
import type { Series, Target } from "./data";
import { h, theme } from "./dom";

const BODY = 1.6; // length of the even part of the axis, in decades
const TICKS = [0, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 0.99999, 0.999999];
const DRAGGED = 4; // px from which a click is a drag

/** Position of a probability on the axis: even up to 0.9, then each decade of the tail has length 1. */
function place(q: number): number {
  return q <= 0.9 ? (BODY * q) / 0.9 : BODY - 1 - Math.log10(1 - q);
}

function percent(q: number): string {
  return `${Number((100 * q).toPrecision(6))} %`;
}

/** Latencies in ms. */
export type Range = Record<"from" | "to", number>;

export class Ecdf extends Curves {
  readonly element = h("div", { class: "ecdf" });
  private target: Target | undefined;
  private brushed: Range = { from: 0, to: Infinity };

  constructor(
    private readonly series: Series[], protected readonly switched: () => void,
    private readonly select: (range: Range, series?: number) => void,
  ) {
    super("cumulative distribution", "ecdf-keys",
      "Drag over a range of latencies, or click a curve, to list these outputs. " +
      "Keys: up and down move along the curves, Enter lists the outputs of this part and the slower ones.", " ms");
    this.element.append(this.holder, this.keys);
  }

  show(target: Target): void {
    this.target = target;
    this.plotted.setAttribute("aria-label", `${target.title}: ${target.measure}`);
    this.offer(target.curves.map((c) => {
      const more = `n = ${c.n}${c.repetitions > 1 ? `, ${c.repetitions} repetitions` : ""}`;
      return { ...c, ...this.series[c.series], x: c.q, more };
    }));
  }

  /** Marks a selected range of latencies. */
  mark(range: Range): void {
    this.brushed = range;
    if (!this.plot) return;
    const { over } = this.plot;
    const all = range.from <= 0 && range.to === Infinity;
    const [from, to] = [range.from, range.to].map((ms) => Math.min(over.clientWidth, this.plot?.valToPos(ms, "y") ?? 0));
    this.plot.setSelect({ left: from, width: all ? 0 : Math.max(2, to - from), top: 0, height: over.clientHeight }, false);
  }

  protected content(): ReturnType<Curves["content"]> {
    if (!this.target || !this.shown.length) return null;
    const last = this.x[this.x.length - 2];
    const end = this.x.length > 1 ? place(last) + 0.3 : 1; // of the largest
    const ticks = TICKS.filter((q) => q === 0 || q <= last);
    const drawn = this.drawn(0, (q) => (q < 1 ? place(q) : end));
    const marks = this.target.marks.filter((m) => m.series === null || this.shown.some((c) => c.series === m.series));
    return {
      ...drawn, cursor: { x: false, drag: { x: false, y: true, setScale: false, dist: DRAGGED } },
      scales: {
        x: { time: false, ori: 1, range: [0, end] },
        y: { ori: 0, range: (_, __, max) => [0, 1.05 * Math.max(max, ...marks.map((m) => m.ms))] },
      },
      axes: [
        axis({ side: 3, size: 62, splits: () => [...ticks.map(place), end], values: () => [...ticks.map(percent), "largest"] }),
        axis({ side: 2, scale: "y", label: this.target.measure, labelSize: 20, size: 32, space: 56, values: numbers }),
      ],
      hooks: {
        ...drawn.hooks,
        drawAxes: [(u) => this.drawMarks(u, marks)], // below the curves
        ready: [(u) => {
          this.mark(this.brushed);
          u.over.addEventListener("click", (event) => this.selectPart(u.posToVal(event.offsetX, "y"), false));
        }],
        setSelect: [(u) => this.select({ from: u.posToVal(u.select.left, "y"), to: u.posToVal(u.select.left + u.select.width, "y") })],
      },
    };
  }

  /** Bounds and deadlines. */
  private drawMarks(u: uPlot, marks: Target["marks"]): void {
    const { ctx, bbox } = u;
    const scale = devicePixelRatio;
    const [ink, ground] = [theme("ink"), theme("ground")];
    ctx.save();
    ctx.font = `${11 * scale}px system-ui, sans-serif`;
    ctx.lineWidth = scale;
    ctx.setLineDash([5 * scale, 4 * scale]);
    marks.forEach((m, i) => {
      const x = u.valToPos(m.ms, "y", true);
      ctx.strokeStyle = m.series === null ? ink : this.series[m.series].colour;
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

  protected head(q: number): string {
    return q < 1 ? `${percent(q)} take at most` : "the largest";
  }

  /** Selects the outputs around the cursor's probability, under the executor nearest to `ms`. */
  private selectPart(ms: number, upwards: boolean): void {
    const distance = (r: ReturnType<Curves["at"]>[number]): number => Math.abs(r.curve.value[r.k] - ms);
    const [nearest] = this.at(this.index).sort((a, b) => distance(a) - distance(b));
    if (!nearest) return;
    const { curve: { value, series }, k } = nearest;
    const last = value.length - 1;
    this.select({ from: value[upwards ? k : Math.max(0, k - 1)], to: value[upwards ? last : Math.min(k + 1, last)] }, series);
  }

  protected enter(): void {
    this.selectPart(Infinity, true);
  }
}
