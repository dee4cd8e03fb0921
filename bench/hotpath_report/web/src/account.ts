// SPDX-License-Identifier: Apache-2.0
// The causes of an output, as `hotpath explain` prints them.

import type { Output, Store, Target } from "./data";
import { h, ms, table } from "./dom";

/** A word of a shell's command line. */
function quoted(word: string): string {
  return /^[\w./:=@+-]+$/.test(word) ? word : `'${word.replace(/'/g, "'\\''")}'`;
}

export function account(store: Store, target: Target, o: Output): HTMLElement {
  const { causes, rules, series } = store.document;
  const run = store.run(o.series);
  const { executor, label } = series[o.series];
  const words = [run.name, "--executors", executor, `--${target.kind}`, target.name].map(quoted).join(" ");
  const sums = causes.map(({ name, phrase, colour }, c) => {
    const chip = h("span", { class: "chip-colour", style: `background:${colour}` });
    return o.causes[c] > 0 ? h("li", { "data-cause": name, "data-ns": o.causes[c] }, chip, ` ${phrase}: ${ms(o.causes[c])} ms`) : null;
  });
  let from = 0;
  const job = (task: number, sequence: number): string => (task < 0 ? "" : `${run.tasks[task]} ${sequence}`);
  const rows = o.parts.map(([cause, rule, step, task, sequence, ns]) => {
    const cells = [ms(from), ms(ns), causes[cause].phrase, job(...o.path[step]), job(task, sequence), rules[rule]];
    from += ns;
    return h("tr", {}, ...cells.map((c) => h("td", {}, c)));
  });
  const header = ["from ms", "for ms", "cause", "job", "behind", "because"];
  return h("div", { class: "account", "data-series": o.series },
    h("h4", {}, `${label}: ${ms(o.latency)} ms of output ${o.sequence}`),
    h("ul", {}, ...sums),
    h("p", { class: "small" }, h("code", {}, `hotpath explain ${words} --repetition ${o.repetition} --sequence ${o.sequence}`)),
    rows.length === 0 ? null : h("details", {}, h("summary", {}, `${rows.length} parts in the order of time`),
      table("Parts of the latency", header, h("tbody", {}, ...rows))));
}
