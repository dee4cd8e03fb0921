// SPDX-License-Identifier: Apache-2.0
// The list of selected outputs, worst first.

import type { Output, Store, Target } from "./data";
import { h, ms, NS_PER_MS, seconds, swatch, table } from "./dom";
import type { Range } from "./ecdf";

const MOST_ROWS = 100;

export class OutputList {
  readonly element = h("section", { class: "outputs", "aria-label": "Selected outputs" });
  private readonly head = h("p", { role: "status" });
  private readonly body = h("tbody");
  private readonly ends: HTMLInputElement[];
  private rows = new Map<Output | null, HTMLElement>();

  constructor(private readonly store: Store, private readonly pick: (output: Output) => void, select: (range: Range) => void) {
    const change = (): void => {
      const [from, to] = this.ends.map((end) => Number(end.value));
      select({ from: from || 0, to: this.ends[1].value === "" ? Infinity : to });
    };
    const end = (id: string): HTMLInputElement => h("input", { type: "number", min: 0, step: "any", id, change });
    this.ends = [end("from-ms"), end("to-ms")];
    this.element.append(
      h("div", { class: "controls" },
        h("label", { for: "from-ms" }, "Outputs from "), this.ends[0], h("label", { for: "to-ms" }, " to "), this.ends[1], h("span", {}, " ms")),
      this.head, table("List of outputs", ["latency", "executor", "output", "at", "longest cause"], this.body, " list"),
    );
  }

  /** Lists the outputs of a target within a range of latencies; the first one is selected. */
  show(target: Target, visible: number[], range: Range): Output[] {
    // The curves are rounded to nanoseconds in ms; an output at the edge belongs to the range.
    const [low, high] = [range.from * NS_PER_MS - 0.5, range.to * NS_PER_MS + 0.5];
    const listed = visible.flatMap((s) => this.store.outputs(target, s));
    const found = listed.filter((o) => low <= o.latency && o.latency <= high);
    found.sort((a, b) => b.latency - a.latency || a.series - b.series || a.end - b.end);
    const total = target.curves.filter((c) => visible.includes(c.series)).reduce((sum, c) => sum + c.n, 0);
    let text = `${found.length} of ${total} ${target.kind === "chain" ? "outputs" : "jobs"}, worst first`;
    if (listed.length < total) text += ` (the page lists ${listed.length} of them)`;
    if (found.length > MOST_ROWS) text += `; the worst ${MOST_ROWS} are shown`;
    this.head.textContent = `${text}.`;
    const rounded = (end: number): string => String(Number(end.toFixed(3)));
    this.ends[0].value = range.from > 0 ? rounded(range.from) : "";
    this.ends[1].value = range.to < Infinity ? rounded(range.to) : "";
    this.rows = new Map(found.slice(0, MOST_ROWS).map((o) => [o, this.row(target, o)]));
    this.body.replaceChildren(...this.rows.values());
    return found;
  }

  private row(target: Target, o: Output): HTMLElement {
    const { series, causes } = this.store.document;
    const button = h("button", { type: "button", class: "pick", click: () => this.pick(o) }, `${ms(o.latency)} ms`);
    const repetition = this.store.repetitions(o.series).length > 1 ? `, repetition ${o.repetition}` : "";
    const sink = this.store.run(o.series).tasks[o.path[o.path.length - 1]?.[0]] ?? target.name;
    const worst = Math.max(...o.causes);
    const cause = o.causes.length ? `${causes[o.causes.indexOf(worst)].phrase} (${ms(worst)} ms)` : "";
    const cells = [[button], [swatch(series[o.series]), ` ${series[o.series].label}`], [`${sink} ${o.sequence}${repetition}`], [seconds(o.end)], [cause]];
    return h("tr", { "data-series": o.series, "data-repetition": o.repetition, "data-sequence": o.sequence, "data-latency-ns": o.latency },
      ...cells.map((content) => h("td", {}, ...content)));
  }

  /** Marks the rows of the shown outputs. */
  mark(shown: (Output | null)[]): void {
    for (const [output, row] of this.rows) {
      row.toggleAttribute("data-current", shown.includes(output));
      row.querySelector("button")?.setAttribute("aria-pressed", String(shown.includes(output)));
    }
  }
}
