// SPDX-License-Identifier: Apache-2.0
// The time axis of a timeline.

import { theme } from "./dom";

const SHORTEST = 1000; // ns in view
const TICKS = 110; // least distance in px
export const SMALL = "11px system-ui, sans-serif";

/** The visible part of the time axis, in ns since the epoch, and its place on the canvas, in px. */
export class View {
  length = 1; // of the axis
  from = 0;
  to = 1;
  left = 200;
  width = 800;
  #changed: () => void;

  constructor(changed: () => void) {
    this.#changed = changed;
  }

  /** Shows [from, to) as far as the axis has it. */
  look(from = 0, to = this.length): void {
    const span = Math.min(this.length, Math.max(SHORTEST, to - from));
    this.from = Math.min(Math.max(0, (from + to - span) / 2), Math.max(0, this.length - span));
    this.to = this.from + span;
    this.#changed();
  }

  pan(share: number): void {
    const by = share * (this.to - this.from);
    this.look(this.from + by, this.to + by);
  }

  zoom(factor: number, at = 0.5): void {
    const { from, to } = this;
    const span = Math.min(this.length, Math.max(SHORTEST, (to - from) * factor));
    const start = from + at * (to - from - span);
    this.look(start, start + span);
  }

  get pixel(): number {
    return (this.to - this.from) / this.width;
  }

  x(t: number): number {
    return this.left + ((t - this.from) / (this.to - this.from)) * this.width;
  }

  draw(ctx: CanvasRenderingContext2D, height: number): void {
    const { from, to, left, width } = this;
    const power = 10 ** Math.floor(Math.log10(this.pixel * TICKS));
    const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= this.pixel * TICKS) ?? 10 * power;
    const digits = Math.max(0, Math.ceil(-Math.log10(step / 1e9)));
    const [faint, grid] = [theme("faint"), theme("grid")];
    Object.assign(ctx, { font: SMALL, textBaseline: "middle", textAlign: "center" });
    for (let t = Math.ceil(from / step) * step; t <= to; t += step) {
      ctx.fillStyle = grid;
      ctx.fillRect(this.x(t), 16, 1, height - 16);
      ctx.fillStyle = faint;
      ctx.fillText(`${(t / 1e9).toFixed(digits)} s`, Math.min(Math.max(this.x(t), left + 20), left + width - 24), 8);
    }
  }
}
