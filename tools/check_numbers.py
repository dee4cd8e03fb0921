#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the numbers of README.md and docs/*.md from results/, between `<!-- generated: NAME -->` and `<!-- end -->`.

With --check it changes nothing and says which blocks do not agree with results/, and whether the published page says
what its claims.json and facts.json say.
"""

import argparse
import json
import os
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n)(.*?)(<!-- end -->)", re.S)
SHOWN_CLAIMS = ("no-drops", "table", "bounds", "almost-90", "slowdown", "best-worst-case")
DEPLOYMENTS = {
    "single": "one thread for all nodes",
    "isolated": "a thread for each node",
    "rm-threads": "a thread for each task, SCHED_FIFO, rate monotonic",
    "prioritized": "upstream's, hot path and planner at SCHED_FIFO",
    "picas": "chain-aware priorities, executors bound to processors",
}
VERDICTS = ("reproduced", "partly", "not", "no data")


def load(root: Path, name: str) -> Any:
    """A JSON file of results/."""
    return json.loads((root / "results" / name).read_text(encoding="utf-8"))


def table(header: Sequence[str], rows: Sequence[Sequence[str]], numbers: bool = True) -> str:
    """A Markdown table; numbers align right."""
    lines = [
        f"| {' | '.join(header)} |",
        f"| --- |{(' ---: |' if numbers else ' --- |') * (len(header) - 1)}",
    ]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows]) + "\n"


def with_interval(value: float, interval: list[float] | None, digits: int) -> str:
    """`value [low, high]`."""
    text = f"{value:.{digits}f}"
    return text + (f" [{interval[0]:.{digits}f}, {interval[1]:.{digits}f}]" if interval else "")


def capacities(root: Path) -> list[list[str]]:
    """The rows of results/capacity: executor, largest load (%), that of the analysis, first that fails, why, others."""
    lines = (root / "results/capacity/capacity.md").read_text(encoding="utf-8").splitlines()
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if line.startswith("| `")]


def capacity(root: Path) -> str:
    """The table of results/capacity and what a level takes to hold."""
    return (root / "results/capacity/capacity.md").read_text(encoding="utf-8")


def hot_path_table(root: Path) -> str:
    """Latencies (ms), losses and ratios of results/hot_path, and the largest loads (%) of results/capacity."""
    rows = []
    carries = {row[0]: row[1] for row in capacities(root)}
    for e in load(root, "hot_path/summary.json")["executors"]:
        chain = e["chains"][0]
        latency, ratios = chain["hot_path_latency_ms"], chain["ratio_to_default"]
        cells = [f"`{e['executor']}`"]
        cells += [with_interval(latency[q], latency["interval"][q], 1) for q in ("p50", "p99", "max")]
        cells += [str(e["skipped"]), str(e["overwritten"])]
        for which in ("median", "max"):
            ratio = ratios[which]
            beyond = ratio["interval"] and not ratio["interval"][0] <= 1 <= ratio["interval"][1]
            cells.append(f"{ratio['value']:.3g}{'*' if beyond else ''}")
        rows.append([*cells, carries.get(cells[0], "")])
    header = ["executor", "median ms", "p99 ms", "worst ms", "skipped", "overwritten"]
    return table([*header, "median ratio", "worst ratio", "carries %"], rows)


def conditions(run: Any) -> str:
    """When, where and for how long a live run was measured."""
    machine = run["machine"]
    used = f"{len(run['cpus'])} used" if len(run["cpus"]) > 1 else "one used"
    kind = "virtual machine" if machine["hypervisor"] else "machine"
    return (
        f"on {run['date'][:10]}: {machine['cpu_model']}, {kind} with {machine['processors']} processors ({used}),"
        f" Linux {machine['kernel'].split('-')[0]}, {machine['compiler']}, load {run['load_percent']:.3g} %,"
        f" {run['phases']}-order phases, {run['repetitions']} repetitions of {run['duration_s']:g} s.\n"
    )


def hot_path_conditions(root: Path) -> str:
    """How results/hot_path was measured."""
    return "Measured with `launch_scripts/hot_path.sh` " + conditions(load(root, "hot_path/run.json"))


def deployments(root: Path) -> str:
    """Hot path (ms) under the deployments of results/deployments, simulated and live, and how that was measured."""

    def quantiles(source: str) -> dict[str, list[str]]:
        executors = load(root, f"deployments/{source}/summary.json")["executors"]
        of = {e["executor"]: e["chains"][0]["hot_path_latency_ms"] for e in executors}
        return {name: [f"{latency[q]:.1f}" for q in ("p50", "p99", "max")] for name, latency in of.items()}

    simulated, live = quantiles("simulated"), quantiles("live")
    rows = [
        [f"`{name}`: {what}", " / ".join(simulated[name]), " / ".join(live[name])]
        for name, what in DEPLOYMENTS.items()
    ]
    header = ["deployment", "simulated: median / p99 / worst", "live"]
    run = load(root, "deployments/live/run.json")
    return f"Simulated without costs; live {conditions(run)}\n{table(header, rows)}"


def paper_verdicts(root: Path) -> str:
    """Some claims of the paper in short rows, of results/paper."""
    claims, facts = load(root, "paper/claims.json"), load(root, "paper/facts.json")
    counts = Counter(claim["verdict"] for claim in claims)
    told = ", ".join(f"{counts[word]} {word}" for word in VERDICTS if counts[word])
    rows = []
    for claim in claims:
        if claim["claim"] in SHOWN_CLAIMS:
            found = {source: finding["short"] for source, finding in claim["findings"].items()}
            values = [claim["title"], claim["paper"], found.get("analysis", found.get("simulated", ""))]
            values += [
                found.get("live", ""),
                claim["real"]["short"] if claim["real"] else "",
                claim["verdict"],
            ]
            rows.append(values)
    header = ["claim", "paper", "simulated", "live", "real ROS 2", "verdict"]
    return f"{len(claims)} claims: {told}. {facts['where']}\n\n" + table(header, rows, numbers=False)


def bench_bars(root: Path) -> str:
    """Conditions and the table of that name in the report of `hotpath bench`."""
    report = (root / "results/bench/report.md").read_text(encoding="utf-8")
    found = re.search(r"\n\n(.*?\n\n).*?## Against the bar\n\n(.*?\n)\n", report, re.S)
    if found is None:
        raise ValueError("results/bench/report.md has no table `Against the bar`")
    return found[1] + found[2]


def interleavings(root: Path) -> str:
    """What the live executor's loop was tried with, of results/reliability."""
    told = load(root, "reliability/interleavings.json")
    of = (
        "all"
        if told["complete"] == told["executors"]
        else f"{told['complete']} of {told['executors']} completely:"
    )
    return (
        f"{told['executors']} executors; {of} {told['systematic']:,} interleavings of two short runs with at most"
        f" {told['preemptions']} preemption or wake-up for no reason,\nand {told['random']:,} of two longer ones at"
        f" random: all accepted. Any one of {told['lost_and_found']} notifications of the short runs was lost:"
        " each was missed.\n"
    )


def fuzz(root: Path) -> str:
    """What the fuzz targets tried without a finding, of results/reliability."""
    told = load(root, "reliability/fuzz.json")
    targets = told["targets"]
    tried = ", ".join(f"{name} {target['executions']:,}" for name, target in targets.items())
    total = sum(target["executions"] for target in targets.values())
    return (
        f"{len(targets)} targets, {total:,} inputs without a finding, in {told['seconds'] / 3600:.1f} hours of one"
        f" processor until {told['date']};\n{sum(target['kept'] for target in targets.values())} inputs are kept.\n"
        f"By target: {tried}.\n"
    )


def mutations(root: Path) -> str:
    """What became of damaged traces of LTTng, of results/reliability."""
    told = load(root, "reliability/mutations.json")
    return (
        f"{told['tried']:,} traces with other bytes: {told['read']:,} read, the others refused;"
        f" {told['library_ended']:,} of them ended Debian's library.\n"
    )


def faults(root: Path) -> str:
    """The calls that failed in failing_calls_test.py, of results/reliability."""
    told = load(root, "reliability/faults.json")
    texts = {"simulate": "a simulation", "run": "a live run"}
    said = (
        f"{told[k]['injected']:,} faults at {told[k]['places']:,} places of {text}"
        for k, text in texts.items()
    )
    return " and ".join(said) + ": all ended well.\n"


def kills(root: Path) -> str:
    """The kills of recover_test.py and process_faults_test.py, of results/reliability."""
    told, hit = load(root, "reliability/kills.json"), load(root, "reliability/process_faults.json")
    whole = told["kills"] - told["recovered"] - told["nothing_stored"]
    return (
        f"{told['kills']:,} runs killed: {told['recovered']:,} recovered, {told['nothing_stored']:,} had stored"
        f" nothing yet, {whole:,} had ended. {hit['hits']:,} processes of runs killed or stopped:\n"
        f"{hit['failed']:,} runs said so, the others were whole.\n"
    )


def load_figures(root: Path) -> str:
    """What large graphs took, of results/reliability."""
    told = load(root, "reliability/load.json")
    cases = [case for name, case in told.items() if name != "numbers"]
    rows = []
    for case in cases:
        cells = [case["title"], f"{case['tasks']:,}", f"{case['jobs']:,}", f"{case['skipped']:,}"]
        cells += [f"{case['overwritten']:,}", f"{case['around_s']:.0f}", f"{case['peak_memory_mib']:,}"]
        rows.append(cells)
    header = ["10 s of", "tasks", "jobs", "skipped", "overwritten", "s beside them", "memory MiB"]
    machine = cases[0]["machine"]
    where = f"{machine['cpu_model']}, {cases[0]['cpus']} processors, Linux {machine['kernel'].split('-')[0]}"
    return f"On {cases[0]['date']}: {where}, {machine['compiler']}.\n\n{table(header, rows)}"


def soak(root: Path) -> str:
    """What tools/soak.py saw, of results/reliability."""
    told = load(root, "reliability/soak.json")
    rows = [
        [
            f"`{name}`",
            f"{run['hours']:g}",
            f"{run['jobs']:,}",
            f"{run['private_mib']}",
            f"{run['growth_percent']:+.2f} %",
        ]
        for name, run in told.items()
    ]
    return table(["executor", "hours", "jobs", "private memory MiB", "grown"], rows)


def neighbour(root: Path) -> str:
    """What strangers did to the hot path, of results/reliability."""
    told = load(root, "reliability/neighbour.json")
    texts = {"again": "nobody, again", "unmatched": "strangers whom nobody matches"}
    texts["matched"] = "strangers whom its readers match"
    rows = []
    for kind, text in texts.items():
        value, low, high = (100 * (v - 1) for v in told["over_alone"][kind])
        cells = [text, f"{told['written'].get(kind, 0) / told['rounds'] / told['seconds']:,.0f}"]
        rows.append([*cells, f"{value:+.2f} % [{low:+.2f}, {high:+.2f}]"])
    header = ["beside", "their samples a second", f"median of the hot path ({told['median_ms']:g} ms alone)"]
    return f"{told['rounds']} rounds of {told['seconds']:g} s each:\n\n{table(header, rows)}"


def ros2_bars(root: Path) -> str:
    """What launch_scripts/ros2_bars.sh measured."""
    told = load(root, "ros2/bars.json")
    rows = [[bar["what"], f"{bar['measured']:g}", bar["bar"]] for bar in told["bars"]]
    lost = f"; default lost up to {told['default_lost_percent']:g} % of a task's timestamps at 90 %"
    return f"Jazzy, one processor ({told['machine']}), {told['date']}{lost}.\n\n{table(['', 'measured', 'bar'], rows)}"


def large_numbers(root: Path) -> str:
    """How far numbers went in virtual time, of results/reliability."""
    told = load(root, "reliability/load.json")["numbers"]
    return (
        f"{told['timestamps']:,} timestamps of one timer and {told['jobs']:,} jobs in {told['virtual_s']:,} s"
        f" ({told['timestamps'] / 2**32:.2f} times 2^32 numbers,\n"
        f"{told['virtual_s'] * 10**6 / 2**32:.1f} times 2^32 us): all accounted for.\n"
    )


BLOCKS: dict[str, Callable[[Path], str]] = {
    block.__name__: block
    for block in (
        hot_path_table,
        hot_path_conditions,
        deployments,
        paper_verdicts,
        bench_bars,
        capacity,
        interleavings,
        fuzz,
        mutations,
        faults,
        kills,
        load_figures,
        large_numbers,
        neighbour,
        ros2_bars,
        soak,
    )
}


def generated(text: str, root: Path) -> tuple[str, list[str]]:
    """The text with its blocks made anew, and the names of those that differed."""
    changed = []

    def block(match: re.Match[str]) -> str:
        opening, name, before, closing = match.groups()
        if name not in BLOCKS:
            raise ValueError(f"there is no generated block `{name}`; there are {', '.join(BLOCKS)}")
        after = BLOCKS[name](root)
        if after != before:
            changed.append(name)
        return opening + after + closing

    return BLOCK.sub(block, text), changed


def check_blocks(texts: dict[Path, str]) -> None:
    """Raises ValueError unless each block is there once, and whole."""
    whole = Counter(match[2] for text in texts.values() for match in BLOCK.finditer(text))
    for name in BLOCKS:
        begun = sum(text.count(f"<!-- generated: {name} -->") for text in texts.values())
        if whole[name] != 1 or begun != 1:
            raise ValueError(f"README.md and docs/ hold {whole[name]} whole blocks `{name}` instead of one")


def disagreements(root: Path) -> Iterator[str]:
    """What the page of results/paper and results/README.md do not say, though their data do."""
    claims, facts = load(root, "paper/claims.json"), load(root, "paper/facts.json")
    page = (root / "results/paper/report.md").read_text(encoding="utf-8").replace("\\|", "|")
    parts = page.split("<details>")
    for claim in claims:
        row = f"| **{claim['verdict']}** | {claim['title']} | {claim['paper']} |"
        part = next((p for p in parts if p.startswith(f"<summary>{claim['title']}: {claim['verdict']}<")), "")
        findings = [finding["text"] for finding in claim["findings"].values()]
        for text, place in [
            (row, page),
            *((text, part) for text in (claim["quote"], claim["rule"], *findings)),
        ]:
            if text not in place:
                yield f"results/paper/report.md does not say `{text}` of the claim {claim['claim']}"
    readme = (root / "results/README.md").read_text(encoding="utf-8")
    for text in filter(None, (facts["where"], facts["live_runs"])):
        if text not in readme:
            yield f"results/README.md does not say `{text}`"


def rewrite(path: Path, text: str) -> None:
    """Replaces a file by a whole new one."""
    part = path.with_name(f".{path.name}.part")
    part.write_text(text, encoding="utf-8")
    os.replace(part, path)


def main() -> int:
    """The exit code: 1 when a number does not agree."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--check", action="store_true", help="change nothing; exit code 1 when a number does not agree"
    )
    parser.add_argument("--root", type=Path, default=ROOT, help=argparse.SUPPRESS)
    options = parser.parse_args()
    wrong = []
    try:
        files = [options.root / "README.md", *sorted((options.root / "docs").glob("*.md"))]
        texts = {file: file.read_text(encoding="utf-8") for file in files}
        check_blocks(texts)
        for file, text in texts.items():
            after, changed = generated(text, options.root)
            if changed and not options.check:
                rewrite(file, after)
            elif changed:
                name = file.relative_to(options.root)
                wrong.append(
                    f"{', '.join(changed)} in {name} do not agree with results/; run tools/check_numbers.py"
                )
        wrong += [f"{sentence}; publish it again" for sentence in disagreements(options.root)]
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        wrong.append(repr(error))
    for sentence in wrong:
        print(f"check_numbers.py: {sentence}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
