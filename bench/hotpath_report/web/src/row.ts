// SPDX-License-Identifier: Apache-2.0
// The jobs of one row of a timeline.

import type { Job } from "./data";

/** Drawn from `left` to `right` with the share of the time that jobs run in it; a single job is given. */
export type Draw = (left: number, right: number, share: number, job?: Job) => void;

const STEPS = 8; // shares of a pixel that are told apart

export class Row {
  /** `jobs` are in order of start; `marked`: all of them belong to the selected chain. */
  constructor(readonly name: string, private readonly jobs: Job[], readonly marked: boolean) {}

  /** Position of the first job that ends after `instant`; rows of a thread never overlap. */
  private first(instant: number): number {
    let low = 0;
    let high = this.jobs.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.jobs[middle].end <= instant) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Draws what is visible in [from, to) with `perPixel` ns in a pixel: each job, or sums if they are many. */
  draw(from: number, to: number, perPixel: number, call: Draw): void {
    const visible = this.jobs.slice(this.first(from), this.first(to) + 1).filter((job) => job.start < to);
    if (visible.length < (to - from) / perPixel / 4) {
      for (const job of visible) call(job.start, job.end, 1, job);
      return;
    }
    const first = Math.floor(from / perPixel);
    const busy = new Float64Array(Math.ceil(to / perPixel) - first + 1); // by pixel; nothing runs in the last one
    for (const { start, end } of visible) {
      const last = Math.min(busy.length - 2, Math.ceil(end / perPixel) - 1 - first);
      for (let b = Math.max(0, Math.floor(start / perPixel) - first); b <= last; ++b) {
        busy[b] += Math.min(end / perPixel, first + b + 1) - Math.max(start / perPixel, first + b);
      }
    }
    let [begin, share] = [0, 0];
    busy.forEach((of, b) => {
      const rounded = Math.ceil(STEPS * Math.min(1, of));
      if (rounded === share) return;
      if (share > 0) call((first + begin) * perPixel, (first + b) * perPixel, share / STEPS);
      [begin, share] = [b, rounded];
    });
  }
}
