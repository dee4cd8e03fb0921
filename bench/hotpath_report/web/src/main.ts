// SPDX-License-Identifier: Apache-2.0
// Joins the parts of the interactive page: a distribution, the outputs selected in it, and their
// timelines.

import uplotStyle from "uplot/dist/uPlot.min.css";
import { legend, Plots } from "./curves";
import { readDocument, Store, type Output, type Target } from "./data";
import { h } from "./dom";
import { Ecdf, type Range } from "./ecdf";
import { GraphView } from "./graph";
import { OutputList } from "./outputs";
import pageStyle from "./page.css";
import { Timeline } from "./timeline";
import { Trend } from "./trend";

const MOST_AT_FIRST = 8; // curves that are switched on

class Page {
  readonly ecdf: Ecdf;
  readonly list: OutputList;
  readonly timeline: Timeline;
  readonly trend: Trend;
  readonly graph = new GraphView();
  readonly plots: Plots | undefined;
  private readonly targets = h("select", { id: "target" });
  private readonly legend = h("fieldset", { class: "legend" });
  private readonly other = h("select", { id: "other" });
  private readonly details = h("div"); // of outputs; hidden if the runs store no jobs
  private readonly violins = h("div", { class: "violins" });
  private readonly notes = h("div");
  private readonly visible = new Set<number>();
  private moved: { element: Element; home: Comment }[] = [];
  private chosen: Output | null = null;
  private alone = false; // the user wants one executor in the timeline

  constructor(readonly store: Store, root: HTMLElement) {
    this.ecdf = new Ecdf(store.document.series, (range, series) => this.select(range, series));
    this.list = new OutputList(store, (output) => this.pick(output), (range) => this.select(range, -1));
    this.timeline = new Timeline(store);
    this.trend = new Trend(store, (output) => this.pick(output));
    for (let s = 0; s < Math.min(store.document.shown ?? MOST_AT_FIRST, store.document.series.length); ++s) this.visible.add(s);
    const groups = { chain: h("optgroup", { label: "Chains" }), task: h("optgroup", { label: "Tasks" }) };
    store.document.targets.forEach((t, i) => groups[t.kind].append(h("option", { value: i }, t.name)));
    this.targets.append(...Object.values(groups).filter((g) => g.childElementCount > 0));
    this.targets.addEventListener("change", () => this.showTarget());
    this.other.addEventListener("change", () => {
      this.alone = this.other.value === "";
      this.showTimeline();
    });
    const { plots, targets, runs } = store.document;
    const hasJobs = runs.some((r) => r.repetitions?.length);
    const title = !targets.length ? "Curves" : hasJobs ? "Distributions, outputs and timelines" : "Distributions";
    const notes = runs.flatMap((r) => r.notes.map((n) => (runs.length > 1 ? `${r.name}: ${n}` : n)));
    root.append(h("h2", { id: "explore-title" }, title), ...notes.map((n) => h("p", { class: "note" }, n)));
    root.hidden = false;
    if (targets.length) {
      root.append(
        h("div", { class: "controls" }, h("label", { for: "target" }, "Distribution of "), this.targets),
        this.legend, h("div", { class: "beside" }, this.ecdf.element, this.violins), this.notes, this.details);
    }
    if (plots?.length) root.append(...(targets.length ? [h("h3", {}, "Curves")] : []), (this.plots = new Plots(plots)).element);
    this.details.hidden = !hasJobs;
    if (!hasJobs) this.ecdf.keys.textContent = "On the keyboard, up and down move along the curves.";
    this.details.append(
      this.list.element,
      h("h3", {}, "Timeline"),
      h("div", { class: "controls" }, h("label", { for: "other" }, "With the same data under "), this.other),
      this.timeline.element, this.trend.element, this.graph.element,
    );
    if (targets.length) this.showTarget();
  }

  get target(): Target {
    return this.store.document.targets[Number(this.targets.value)];
  }

  /** The executors that have this target and are not switched off. */
  private shown(): number[] {
    return this.target.curves.map((c) => c.series).filter((s) => this.visible.has(s));
  }

  private showTarget(): void {
    const { target } = this;
    this.moveFigure(target.figure);
    const entries = target.curves.map((c) => ({
      look: this.store.document.series[c.series], data: { "data-series": c.series, "data-n": c.n },
      more: `n = ${c.n}${c.repetitions > 1 ? `, ${c.repetitions} repetitions` : ""}`,
    }));
    this.legend.replaceChildren(h("legend", { class: "hidden" }, "Executors"), ...legend(entries, this.visible, () => this.showVisible()));
    this.showVisible();
  }

  private showVisible(): void {
    this.ecdf.show(this.target, this.visible);
    this.trend.show(this.target, this.shown());
    this.select({ from: 0, to: Infinity }, -1);
  }

  /** Puts the violins and causes of a target beside and below its curves, and the former ones back. */
  private moveFigure(id: string): void {
    for (const { element, home } of this.moved) home.replaceWith(element);
    this.moved = [];
    const move = (name: string, to: HTMLElement): void => {
      const element = id ? document.getElementById(name) : null;
      to.hidden = !element;
      if (!element) return;
      const home = document.createComment(name);
      element.replaceWith(home);
      to.append(element);
      this.moved.push({ element, home });
    };
    move(id, this.violins);
    move(`${id}_notes`, this.notes);
  }

  private select(range: Range, series: number): void {
    const all = range.from <= 0 && range.to === Infinity;
    this.ecdf.mark(all ? null : range);
    const found = this.list.show(this.target, series >= 0 ? [series] : this.shown(), range);
    this.chosen = found[0] ?? null;
    this.showTimeline();
  }

  /** Shows an output in the timeline. */
  pick(output: Output): void {
    this.chosen = output;
    this.showTimeline();
  }

  /** The output of another executor with the data of the same source job. */
  private partner(output: Output, series: number): Output | null {
    const source = (o: Output): string => {
      const [task, sequence] = o.path[0] ?? [];
      return `${o.repetition} ${sequence} ${this.store.run(o.series).tasks[task]}`;
    };
    const wanted = source(output);
    return this.store.outputs(this.target, series).find((o) => source(o) === wanted) ?? null;
  }

  private showTimeline(): void {
    const { chosen, target } = this;
    const series = chosen?.series ?? this.shown()[0] ?? 0;
    const kept = this.other.value;
    const others = target.curves.map((c) => c.series).filter((s) => s !== series);
    this.other.replaceChildren(
      h("option", { value: "" }, "no other executor"),
      ...others.map((s) => h("option", { value: s }, this.store.document.series[s].label)),
    );
    const pair = this.shown().length === 2 ? others.find((s) => this.visible.has(s)) : undefined;
    if (others.some((s) => String(s) === kept)) this.other.value = kept;
    else if (pair !== undefined && !this.alone) this.other.value = String(pair);
    const second = this.other.value === "" || !chosen ? null : this.partner(chosen, Number(this.other.value));
    this.timeline.show(target, second ? [chosen, second] : [chosen], series);
    this.list.mark([chosen, second]);
    const { series: all, causes } = this.store.document;
    this.graph.show(this.store.run(series), all[series], target, chosen, causes[0]?.colour ?? "");
  }
}

/** The script stands before the figures that it moves or replaces. */
async function parsed(): Promise<void> {
  if (document.readyState !== "loading") return;
  await new Promise((resolve) => document.addEventListener("DOMContentLoaded", resolve, { once: true }));
}

async function start(): Promise<void> {
  const root = document.getElementById("explore");
  const data = document.getElementById("hotpath-data");
  if (!root || !data) return;
  try {
    const store = new Store(await readDocument(data.textContent ?? ""));
    await parsed();
    document.head.append(h("style", {}, uplotStyle, pageStyle));
    const page = new Page(store, root);
    page.timeline.draw();
    performance.mark("hotpath-started");
    Object.assign(window, { hotpathPage: page }); // for tests
  } catch (error) {
    root.hidden = false;
    root.append(h("p", { class: "note" }, `The interactive part could not start (${String(error)}). The rest of the page is complete.`));
    throw error;
  }
}

void start();
