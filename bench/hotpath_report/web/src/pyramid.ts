// SPDX-License-Identifier: Apache-2.0
// The jobs of one row of a timeline, and their sums over ever longer bins for a distant view.

/** Drawn from `left` to `right` with the share of the time that jobs run in it. */
export type Draw = (left: number, right: number, share: number, job: number) => void;

const STEPS = 8; // shares of a bin that are told apart

export class Row {
  private readonly levels: Float32Array[] = []; // busy ns by bin; bins of level k are `bin` * 2^k ns long
  private readonly bin: number;

  /** `jobs` are positions in `start` and `end`, in order of start. */
  constructor(
    readonly name: string, readonly jobs: Int32Array, private readonly start: Float64Array,
    private readonly end: Float64Array, length: number,
    readonly marked: boolean, // all of them belong to the selected chain
  ) {
    const bins = 2 ** Math.ceil(Math.log2(Math.max(2, 4 * jobs.length)));
    this.bin = Math.max(1, length / bins);
    const busy = new Float32Array(bins);
    for (const job of jobs) {
      const last = Math.min(bins - 1, Math.floor((end[job] - 1) / this.bin));
      for (let b = Math.floor(start[job] / this.bin); b <= last; ++b) {
        busy[b] += Math.min(end[job], (b + 1) * this.bin) - Math.max(start[job], b * this.bin);
      }
    }
    for (let level = busy; ; ) {
      this.levels.push(level);
      if (level.length === 1) break;
      const below = level;
      level = Float32Array.from({ length: below.length / 2 }, (_, i) => below[2 * i] + below[2 * i + 1]);
    }
  }

  /** Position in `jobs` of the first job that ends after `instant`; rows of a thread never overlap. */
  private first(instant: number): number {
    let low = 0;
    let high = this.jobs.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.end[this.jobs[middle]] <= instant) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Draws what is visible in [from, to) with `perPixel` ns in a pixel. */
  draw(from: number, to: number, perPixel: number, call: Draw): void {
    const first = this.first(from);
    const last = this.first(to);
    if (last - first >= (to - from) / perPixel / 4) return this.drawBins(from, to, perPixel, call);
    for (let k = first; k < this.jobs.length && this.start[this.jobs[k]] < to; ++k) {
      const job = this.jobs[k];
      call(this.start[job], this.end[job], 1, job);
    }
  }

  private drawBins(from: number, to: number, perPixel: number, call: Draw): void {
    const k = Math.min(this.levels.length - 1, Math.max(0, Math.ceil(Math.log2((2 * perPixel) / this.bin))));
    const bins = this.levels[k];
    const bin = this.bin * 2 ** k;
    const end = Math.min(bins.length, Math.ceil(to / bin));
    let begin = 0;
    let share = 0;
    const flush = (upTo: number): void => {
      if (share > 0) call(begin * bin, upTo * bin, share / STEPS, -1);
    };
    for (let b = Math.max(0, Math.floor(from / bin)); b < end; ++b) {
      const rounded = Math.ceil((STEPS * Math.min(bin, bins[b])) / bin);
      if (rounded === share) continue;
      flush(b);
      begin = b;
      share = rounded;
    }
    flush(end);
  }
}
