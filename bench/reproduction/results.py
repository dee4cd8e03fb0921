# SPDX-License-Identifier: Apache-2.0
"""From evidence to what a reproduction leaves: data/, figures/, claims.json, report.html, report.md."""

import shlex
from collections import Counter
from pathlib import Path

import evidence as evidence_of
import inference
from checks import NO_DATA, NOT, PAPER_SLOWDOWN, PARTLY, REPRODUCED
from claims import judge
from figure_parts import PERCENTILE_HEADER, SOURCES, percentile_rows
from figures import FIGURES
from items import ITEMS
from page import Section, csv_text, make_figure, write_file, write_page
from runner import NOISE_RULE, duration_text, write_json
from tables import TABLES, Table

TITLE = "Priority-based scheduling for the ROS 2 events executor: the paper's evaluation, reproduced"
ABSTRACT = (
    "Every table and figure of the evaluation (Section VII) of “Bridging the Gap between ROS 2 and Classical"
    " Real-Time Scheduling for Periodic Tasks”, again: the executors of ROS 2 and of the paper, reimplemented on Fast"
    " DDS, in virtual time and live, beside the paper's printed claims and measurements of the real ROS 2 stack on"
    " the same workloads."
)
FOOTER = (
    "Made by launch_scripts/reproduce_paper.sh of hotpath. Data behind each figure: one click below it; every sample:"
    " data/."
)


def command_lines(cells, facts):
    """One line for each distinct command of complete cells; repetitions differ only in their seed and folder."""
    lines, seeds = {}, {}
    for cell in cells:
        if cell.name not in facts:
            continue
        words = list(facts[cell.name]["command"])
        seed = words[words.index("--seed") + 1] if "--seed" in words else ""
        key = " ".join(w for i, w in enumerate(words[:-2]) if "--seed" not in words[max(0, i - 1) : i + 1])
        lines.setdefault(key, shlex.join(words))
        seeds.setdefault(key, []).append(seed)
    texts = []
    for key, line in sorted(lines.items(), key=lambda item: (" run " in item[1], item[1])):
        others = sorted({s for s in seeds[key][1:] if s}, key=int)
        texts.append(line + (f"   # and --seed {', '.join(others)}" if others else ""))
    return texts


def where_it_ran(evidence, cells):
    machine = evidence.machine
    if machine is None:
        return (
            f"Simulated and computed, mode {evidence.mode}; measured was only what a release costs on the machine that"
            " did it."
        )
    planned = sum(c.source == "live" for c in cells)
    complete = sum(c["source"] == "live" for c in evidence.cells)
    missing = f" Unfinished: {complete} of {planned} live repetitions." if complete < planned else ""
    virtual = "virtual machine" if machine.get("hypervisor") else "machine"
    return (
        f"Live: {machine['cpu_model']}, {virtual} with {machine['processors']} processors, Linux"
        f" {machine['kernel'].split('-')[0]}{', PREEMPT_RT' if machine['preempt_rt'] else ''},"
        f" {machine['distribution']}, {machine['compiler']}, transport {machine['transport']},"
        f" {machine['date'][:10]}, mode {evidence.mode}.{missing}"
    )


def tiles(evidence, reference, verdicts):
    found = {word: sum(v.verdict == word for v in verdicts) for word in (REPRODUCED, PARTLY, NOT, NO_DATA)}
    judged = len(verdicts) - found[NO_DATA]
    shown = [
        {"value": f"{found[REPRODUCED]} of {judged}", "more": "", "text": "claims reproduced"},
        {"value": found[PARTLY], "more": "", "text": "partly"},
        {"value": found[NOT], "more": "", "text": "not"},
    ]
    for source in SOURCES:
        samples = [evidence.latencies("autoware", source, e) for e in ("default", "rm-ro")]
        if all(samples):
            r = inference.ratio(*samples, 1.0)
            interval = f"[{r.low:.2f}, {r.high:.2f}]" if r.has_interval else ""
            shown.append(
                {
                    "value": f"{r.value:.2f}×",
                    "more": interval,
                    "text": f"worst hot path of default over rm-ro, {source}",
                }
            )
    real = [reference.hot_path_ms(e, "max") for e in ("default", "rm-ro")]
    if all(real):
        shown.append(
            {
                "value": f"{real[0] / real[1]:.2f}×",
                "more": "",
                "text": f"the same on the real ROS 2 stack (the paper: {PAPER_SLOWDOWN:g})",
            }
        )
    live = [c for c in evidence.cells if "noise" in c]
    if live:
        marked = sum(bool(c["noise"]["marks"]) for c in live)
        shown.append({"value": f"{marked} of {len(live)}", "more": "", "text": "live repetitions marked as noisy"})
    return shown


STUDY_NAMES = {
    "autoware": "Autoware",
    "rules": "Autoware with other rules",
    "timers": "timers-only sets",
    "load": "other loads",
    "phases": "random phases",
}


def live_runs(evidence):
    """What was measured, study by study: as many repetitions of each executor and setting as there really are."""
    texts = []
    for study, name in STUDY_NAMES.items():
        mine = [c for c in evidence.cells if c["study"] == study and c["source"] == "live"]
        counts = Counter(c["name"].rsplit(".", 1)[0] for c in mine).values()
        if mine:
            times = str(min(counts)) if min(counts) == max(counts) else f"{min(counts)} to {max(counts)}"
            lengths = " or ".join(f"{s:g}" for s in sorted({c["duration_s"] for c in mine}))
            texts.append(f"{name} {times} × {lengths} s")
    return ", ".join(texts)


def coverage(repetitions):
    """The most that an interval between the extremes of so many repetitions can cover of a true median, in percent."""
    return 100 * (1 - 2 ** (1 - repetitions))


def methods(evidence, mode):
    live = [c for c in evidence.cells if c["source"] == "live"]
    texts = [
        (
            f"Warm-up: {mode.warm_up_s:g} s in every run, live and simulated. Only jobs and chain outputs whose"
            " timestamp lies after it count, for drops, response times and latencies alike."
        ),
        (
            f"Simulated: the same scheduling code in virtual time. Timers-only sets {mode.simulated_timers_s:g} s,"
            f" Autoware {mode.simulated_autoware_s:g} s, {mode.simulated_draws} draws of random phases of"
            f" {mode.simulated_draw_s:g} s. Jobs take their worst-case execution time and scheduling costs nothing,"
            " except that the bounds are checked with the paper's release cost; above 100 % load the queues grow for"
            " as long as a run lasts. A deterministic simulation has no sampling error and is shown without intervals."
        ),
    ]
    if live:
        beside = sum(c.get("at_once", 1) > 1 for c in live)
        pinned = sorted({c["command"][c["command"].index("--cpus") + 1] for c in live})
        texts.append(
            f"Live: {len(live)} repetitions, each in a fresh process with its own calibration, in rounds of random"
            f" order drawn from a fixed seed. Pinned to processor {' or '.join(pinned)} (two: the multi-threaded"
            f" executor). Of each executor and setting: {live_runs(evidence)}."
            + (
                f" {beside} of the repetitions ran beside another one, on a processor of their own; there, the"
                " multi-threaded executor comes last in its round, alone."
                if beside
                else ""
            )
        )
        policies = sorted({p for c in live for p in c.get("policies", [])})
        texts.append("Scheduling classes obtained: " + "; ".join(policies) + ".")
    texts += [
        (
            f"Percentiles interpolate between order statistics. Intervals: {100 * inference.CONFIDENCE:.0f} %"
            f" percentile bootstrap, {inference.RESAMPLES} resamples of whole repetitions with a fixed seed, since"
            " samples of one repetition follow one another; a single repetition is resampled in"
            f" {inference.BLOCKS} blocks of consecutive samples. An interval of a maximum cannot reach beyond the"
            " largest sample and says how far the maximum depends on single repetitions. An interval over few"
            " repetitions lies between their extremes and covers the true value less often than its name says: of"
            f" 3 repetitions at most {coverage(3):.0f} %, of 5 at most {coverage(5):.0f} %."
        ),
        (
            "“Better” is a rank test (Mann and Whitney, two-sided) with its effect size: Cliff's delta is the share"
            " of pairs of samples in which ours is smaller, minus the share in which it is larger; from 0.147 it"
            " counts as small, from 0.33 as medium, from 0.474 as large. The p-value treats samples as independent;"
            " the interval of delta, over repetitions, does not."
        ),
        (
            "The real ROS 2 stack: rclcpp and the authors' fork on the same workloads, on another machine"
            " (reference_system/ros2_reference). Its response times follow the authors' definition, which refers to a timer's"
            " latest release, so a release-only executor's backlog does not show in them. Its rm and edf place all"
            " subscriptions before all timers (rule `first`)."
        ),
    ]
    return texts


def noise(evidence):
    live = [c for c in evidence.cells if "noise" in c]
    if not live:
        return {"text": "Nothing was measured live.", "table": None}
    marked = [c for c in live if c["noise"]["marks"]]
    text = (
        f"{len(marked)} of {len(live)} live repetitions are marked as noisy; they count like all others. The rule:"
        f" {NOISE_RULE}. "
        + (
            "This machine is too noisy for conclusions about single worst cases."
            if 4 * len(marked) > len(live)
            else ""
        )
    )
    rows = [
        [
            c["name"].removeprefix("live."),
            c.get("at_once", 1),
            f"{c['noise']['stolen_percent']:.2f}",
            f"{c['noise']['others_percent']:.1f}",
            f"{c['noise']['held_up_ms']:.2f}",
            "; ".join(c["noise"]["marks"]),
        ]
        for c in sorted(live, key=lambda c: c["name"])
    ]
    header = ["repetition", "at once", "stolen %", "used by others %", "held up ms", "marked for"]
    return {"text": text, "table": Table("All live repetitions", header, rows, folded=True)}


def sections(evidence, reference, cells, items):
    facts = {c["name"]: c for c in evidence.cells}
    made = []
    for item in ITEMS:
        if item.name not in items:
            continue
        commands = command_lines([c for c in cells if c.study in item.studies], facts)
        section = Section(item.name, item.title, item.paper or "Beyond the paper", item.text)
        for name, title, draw in FIGURES[item.name]:
            figure = make_figure(name, title, lambda width, draw=draw: draw(evidence, reference, width), commands)
            if figure is not None:
                section.figures.append(figure)
        section.tables = TABLES[item.name](evidence, reference)
        made.append(section)
    return made


def percentiles(evidence):
    """Every percentile of every distribution, one row each."""
    rows = []
    for study, source, executor, load in sorted(evidence.hot_path):
        samples = evidence.latencies(study, source, executor, load)
        rows += percentile_rows(samples, "hot path", study, source, f"{load} %", executor, "")
    for (study, source, percent, executor), runs in sorted(evidence.timers.items()):
        for group in evidence_of.GROUPS:
            if len(runs.responses(group)):
                rows += percentile_rows(
                    runs.responses(group), "response", study, source, f"{percent} %", executor, group
                )
    header = [
        "quantity",
        "study",
        "source",
        "setting",
        "executor",
        "tasks",
        *PERCENTILE_HEADER,
    ]
    return csv_text(header, rows)


def claims_json(verdicts):
    return [
        {
            "claim": v.claim.name,
            "item": v.claim.item,
            "quote": v.claim.quote,
            "rule": v.claim.rule,
            "paper": v.claim.paper,
            "real": v.real,
            "verdict": v.verdict,
            "why": v.why,
            "findings": {s: {"verdict": f.verdict, "text": f.text} for s, f in v.findings.items() if f is not None},
        }
        for v in verdicts
    ]


def write_results(evidence, reference, cells, items, mode, folder):
    """Writes everything into `folder` and returns the verdicts."""
    folder = Path(folder)
    data = folder / "data"
    evidence_of.write(evidence, data)
    write_file(data / "percentiles.csv", percentiles(evidence))
    verdicts = judge(evidence, reference, items)
    write_json(folder / "claims.json", claims_json(verdicts))
    write_page(
        folder,
        "reproduction",
        title=TITLE,
        abstract=ABSTRACT,
        where=where_it_ran(evidence, cells),
        tiles=tiles(evidence, reference, verdicts),
        verdicts=verdicts,
        sections=sections(evidence, reference, cells, items),
        methods=methods(evidence, mode),
        noise=noise(evidence),
        footer=FOOTER,
    )
    write_json(folder / "facts.json", result_facts(evidence, mode, cells))
    return verdicts


def result_facts(evidence, mode, cells):
    live = [c for c in evidence.cells if c["source"] == "live"]
    return {
        "mode": mode.name,
        "machine": evidence.machine,
        "where": where_it_ran(evidence, cells),
        "cells": len(evidence.cells),
        "live_cells": len(live),
        "live_planned": sum(c.source == "live" for c in cells),
        "live_runs": live_runs(evidence),
        "live_measured_s": sum(c["duration_s"] for c in live),
        "live_measured": duration_text(sum(c["duration_s"] for c in live)),
        "marked_cells": sum(bool(c["noise"]["marks"]) for c in live),
    }
