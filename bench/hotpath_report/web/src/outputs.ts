// SPDX-License-Identifier: Apache-2.0
// The list of selected outputs, worst first.

import type { Output, Series, Store, Target } from "./data";
import { h, ms, NS_PER_MS, swatch } from "./dom";
import type { Range } from "./ecdf";

const MOST_ROWS = 100;

export class OutputList {
  readonly element = h("section", { class: "outputs", "aria-label": "Selected outputs" });
  private readonly head = h("p", { role: "status" });
  private readonly body = h("tbody");
  private readonly from = h("input", { type: "number", min: 0, step: "any", id: "from-ms" });
  private readonly to = h("input", { type: "number", min: 0, step: "any", id: "to-ms" });
  private readonly series: Series[];
  private rows = new Map<Output | null, HTMLElement>();

  constructor(
    private readonly store: Store, private readonly pick: (output: Output) => void,
    private readonly select: (range: Range) => void,
  ) {
    this.series = store.document.series;
    const typed = (): void =>
      this.select({ from: Number(this.from.value) || 0, to: this.to.value === "" ? Infinity : Number(this.to.value) });
    for (const input of [this.from, this.to]) input.addEventListener("change", typed);
    const header = ["latency", "executor", "output", "at", "longest cause"];
    const row = h("tr", {}, ...header.map((text) => h("th", { scope: "col" }, text)));
    this.element.append(
      h("div", { class: "controls" },
        h("label", { for: "from-ms" }, "Outputs from "), this.from,
        h("label", { for: "to-ms" }, " to "), this.to, h("span", {}, " ms")),
      this.head,
      h("div", { class: "scroll list", tabindex: 0, role: "region", "aria-label": "List of outputs" },
        h("table", { class: "data" }, h("thead", {}, row), this.body)),
    );
  }

  /** Lists the outputs of a target within a range of latencies; the first one is selected. */
  show(target: Target, visible: number[], range: Range): Output[] {
    // The curves are rounded to nanoseconds in ms; an output at the edge belongs to the range.
    const low = range.from * NS_PER_MS - 0.5;
    const high = range.to * NS_PER_MS + 0.5;
    const listed = visible.flatMap((s) => this.store.outputs(target, s));
    const found = listed.filter((o) => low <= o.latency && o.latency <= high);
    found.sort((a, b) => b.latency - a.latency || a.series - b.series || a.end - b.end);
    const total = target.curves.filter((c) => visible.includes(c.series)).reduce((sum, c) => sum + c.n, 0);
    const what = target.kind === "chain" ? "outputs" : "jobs";
    let text = `${found.length} of ${total} ${what}, worst first`;
    if (listed.length < total) text += ` (the page lists ${listed.length} of them)`;
    if (found.length > MOST_ROWS) text += `; the worst ${MOST_ROWS} are shown`;
    this.head.textContent = `${text}.`;
    this.from.value = range.from > 0 ? String(Number(range.from.toFixed(3))) : "";
    this.to.value = Number.isFinite(range.to) ? String(Number(range.to.toFixed(3))) : "";
    this.rows = new Map(found.slice(0, MOST_ROWS).map((o) => [o, this.row(target, o)]));
    this.body.replaceChildren(...this.rows.values());
    return found;
  }

  private row(target: Target, o: Output): HTMLElement {
    const s = this.series[o.series];
    const button = h("button", { type: "button", class: "pick", click: () => this.pick(o) }, `${ms(o.latency)} ms`);
    const repetition = this.store.repetitions(o.series).length > 1 ? `, repetition ${o.repetition}` : "";
    const sink = this.store.run(o.series).tasks[o.path[o.path.length - 1]?.[0]] ?? target.name;
    return h(
      "tr",
      { "data-series": o.series, "data-repetition": o.repetition, "data-sequence": o.sequence,
        "data-latency-ns": o.latency, "data-end-ns": o.end },
      h("td", {}, button),
      h("td", {}, swatch(s.colour, s.dash), ` ${s.label}`),
      h("td", {}, `${sink} ${o.sequence}${repetition}`),
      h("td", {}, `${(o.end / 1e9).toFixed(6)} s`),
      h("td", {}, this.longestCause(o)),
    );
  }

  private longestCause(o: Output): string {
    if (!o.causes) return "";
    const at = o.causes.indexOf(Math.max(...o.causes));
    return `${this.store.document.causes[at].phrase} (${ms(o.causes[at])} ms)`;
  }

  /** Marks the rows of the shown outputs. */
  mark(shown: (Output | null)[]): void {
    for (const [output, row] of this.rows) {
      const current = shown.includes(output);
      row.toggleAttribute("data-current", current);
      row.querySelector("button")?.setAttribute("aria-pressed", String(current));
    }
  }
}
