// SPDX-License-Identifier: Apache-2.0
// Joins the parts of the interactive page: a distribution, the outputs selected in it, and their
// timelines.

import uplotStyle from "uplot/dist/uPlot.min.css";
import { readDocument, Store, type Output, type Target } from "./data";
import { Choice, h } from "./dom";
import { Ecdf, type Range } from "./ecdf";
import { GraphView } from "./graph";
import { OutputList } from "./outputs";
import pageStyle from "./page.css";
import { Plots } from "./plots";
import { Timeline } from "./timeline";
import { Trend } from "./trend";

const MOST_AT_FIRST = 8; // curves that are switched on

class Page {
  readonly ecdf: Ecdf;
  readonly list: OutputList;
  readonly timeline: Timeline;
  readonly trend: Trend;
  private readonly graph = new GraphView();
  private readonly targets = new Choice("target", "Distribution of ", () => this.showTarget());
  private readonly other = new Choice("other", "With the same data under ", () => {
    this.alone = this.other.value === "";
    this.showTimeline();
  });
  private readonly violins = h("div", { class: "violins" });
  private readonly notes = h("div");
  private moved: { element: Element; home: Comment }[] = [];
  private chosen: Output | null = null;
  private alone = false; // the user wants one executor in the timeline

  constructor(readonly store: Store, root: HTMLElement) {
    const { plots, targets, runs, series, shown = MOST_AT_FIRST } = store.document;
    const pick = (output: Output): void => {
      this.chosen = output;
      this.showTimeline();
    };
    this.ecdf = new Ecdf(series, () => this.showCurves(), (range, of) => this.select(range, of));
    this.list = new OutputList(store, pick, (range) => this.select(range));
    this.timeline = new Timeline(store);
    this.trend = new Trend(store, pick);
    for (const s of series.slice(0, shown).keys()) this.ecdf.visible.add(s);
    const hasJobs = runs.some((r) => r.repetitions?.length);
    const title = !targets.length ? "Curves" : hasJobs ? "Distributions, outputs and timelines" : "Distributions";
    const notes = runs.flatMap((r) => r.notes.map((n) => (runs.length > 1 ? `${r.name}: ${n}` : n)));
    root.append(h("h2", { id: "explore-title" }, title), ...notes.map((n) => h("p", { class: "note" }, n)));
    root.hidden = false;
    if (targets.length) {
      const details = h("div", { hidden: !hasJobs }, this.list.element, h("h3", {}, "Timeline"), this.other.element,
        this.timeline.element, this.trend.element, this.graph.element);
      root.append(this.targets.element, this.ecdf.legend, h("div", { class: "beside" }, this.ecdf.element, this.violins), this.notes, details);
    }
    if (plots?.length) root.append(...(targets.length ? [h("h3", {}, "Curves")] : []), new Plots(plots).element);
    if (!hasJobs) this.ecdf.keys.textContent = "On the keyboard, up and down move along the curves.";
    for (const [kind, label] of [["chain", "Chains"], ["task", "Tasks"]]) {
      const options = targets.flatMap((t, value) => (t.kind === kind ? [h("option", { value }, t.name)] : []));
      if (options.length) this.targets.select.append(h("optgroup", { label }, ...options));
    }
    if (targets.length) this.showTarget();
  }

  get target(): Target {
    return this.store.document.targets[Number(this.targets.value)];
  }

  /** The executors that have this target and are not switched off. */
  private shown(): number[] {
    return this.target.curves.map((c) => c.series).filter((s) => this.ecdf.visible.has(s));
  }

  private showTarget(): void {
    this.moveFigure(this.target.figure);
    this.ecdf.show(this.target);
    this.showCurves();
  }

  private showCurves(): void {
    this.ecdf.draw();
    this.trend.show(this.target, this.shown());
    this.select({ from: 0, to: Infinity });
  }

  /** Puts the violins and causes of a target beside and below its curves, and the former ones back. */
  private moveFigure(id: string): void {
    for (const { element, home } of this.moved) home.replaceWith(element);
    this.moved = [];
    for (const [name, to] of [[id, this.violins], [`${id}_notes`, this.notes]] as const) {
      const element = id ? document.getElementById(name) : null;
      to.hidden = !element;
      if (!element) continue;
      const home = document.createComment(name);
      element.replaceWith(home);
      to.append(element);
      this.moved.push({ element, home });
    }
  }

  /** Lists the outputs in a range of latencies, of one executor or of all that are shown. */
  private select(range: Range, series?: number): void {
    this.ecdf.mark(range);
    const found = this.list.show(this.target, series === undefined ? this.shown() : [series], range);
    this.chosen = found[0] ?? null;
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
    const { chosen, target, other } = this;
    const { series: all, causes } = this.store.document;
    const series = chosen?.series ?? this.shown()[0] ?? 0;
    const others = target.curves.map((c) => c.series).filter((s) => s !== series);
    other.offer([["", "no other executor"], ...others.map((s): [number, string] => [s, all[s].label])]);
    const pair = this.shown().length === 2 ? others.find((s) => this.ecdf.visible.has(s)) : undefined;
    if (other.value === "" && pair !== undefined && !this.alone) other.select.value = String(pair);
    const second = other.value === "" || !chosen ? null : this.partner(chosen, Number(other.value));
    this.timeline.show(target, second ? [chosen, second] : [chosen], series);
    this.list.mark([chosen, second]);
    this.graph.show(this.store.run(series), target, chosen, all[series].colour, causes[this.store.running]?.colour ?? "");
  }
}

async function start(): Promise<void> {
  const root = document.getElementById("explore");
  const data = document.getElementById("hotpath-data");
  if (!root || !data) return;
  try {
    const store = new Store(await readDocument(data.textContent ?? ""));
    // The script stands before the figures that it moves or replaces.
    if (document.readyState === "loading") await new Promise((resolve) => document.addEventListener("DOMContentLoaded", resolve, { once: true }));
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
