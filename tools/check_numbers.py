#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the numbers of README.md from results/, between `<!-- generated: NAME -->` and `<!-- end -->`.

With --check it changes nothing and says which blocks do not agree with results/, and whether the published pages say
what their claims.json and facts.json say.
"""

import argparse
import html
import json
import os
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BLOCK = re.compile(r"(<!-- generated: (\w+) -->\n)(.*?)(<!-- end -->)", re.S)


def load(root, name):
    return json.loads((root / "results" / name).read_text(encoding="utf-8"))


def table(header, rows, numbers=True):
    lines = [
        f"| {' | '.join(header)} |",
        f"| --- |{(' ---: |' if numbers else ' --- |') * (len(header) - 1)}",
    ]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows]) + "\n"


def with_interval(value, interval, digits):
    text = f"{value:.{digits}f}"
    return text + (f" [{interval[0]:.{digits}f}, {interval[1]:.{digits}f}]" if interval else "")


def hot_path_table(root):
    rows = []
    for e in load(root, "hot_path/summary.json")["executors"]:
        chain = e["chains"][0]
        latency, ratios = chain["hot_path_latency_ms"], chain["ratio_to_default"]
        cells = [f"`{e['executor']}`", str(latency["n"])]
        cells += [with_interval(latency[q], latency["interval"][q], 1) for q in ("p50", "p99", "max")]
        cells += [str(e["skipped"]), str(e["overwritten"])]
        for which in ("median", "max"):
            ratio = ratios[which]
            beyond = ratio["interval"] and not ratio["interval"][0] <= 1 <= ratio["interval"][1]
            cells.append(f"{ratio['value']:.3g}{'*' if beyond else ''}")
        rows.append(cells)
    header = [
        "executor",
        "samples",
        "median ms",
        "p99 ms",
        "worst ms",
        "skipped",
        "overwritten",
        "median ratio",
        "worst ratio",
    ]
    return table(header, rows)


def hot_path_conditions(root):
    run = load(root, "hot_path/run.json")
    machine = run["machine"]
    used = f"{len(run['cpus'])} used" if len(run["cpus"]) > 1 else "one used"
    kind = "virtual machine" if machine["hypervisor"] else "machine"
    return (
        f"Measured with `launch_scripts/hot_path.sh` on {run['date'][:10]}: {machine['cpu_model']},"
        f" {kind} with\n{machine['processors']} processors ({used}), Linux {machine['kernel'].split('-')[0]},"
        f" {machine['compiler']}, load {run['load_percent']:.3g} %,\n{run['phases']}-order phases,"
        f" {run['repetitions']} repetitions of {run['duration_s']:g} s.\n"
    )


def paper_verdicts(root):
    claims, facts = load(root, "paper/claims.json"), load(root, "paper/facts.json")
    words = ("reproduced", "partly", "not", "no data")
    counts = {word: sum(c["verdict"] == word for c in claims) for word in words}
    told = ", ".join(f"{counts[word]} {word}" for word in words if counts[word])
    shown = ("no-drops", "table", "bounds", "almost-90", "slowdown", "best-worst-case")
    rows = []
    for claim in claims:
        if claim["claim"] in shown:
            found = claim["findings"]
            computed = found.get("analysis") or found.get("simulated")
            live = found["live"]["text"] if "live" in found else ""
            cells = [
                claim["quote"],
                claim["paper"],
                computed["text"] if computed else "",
                live,
                claim["real"],
                claim["verdict"],
            ]
            rows.append([cell.replace("|", "\\|") for cell in cells])
    header = ["claim", "paper", "simulated or computed", "live", "real ROS 2 stack", "verdict"]
    return f"{len(claims)} claims: {told}. {facts['where']}\n\n" + table(header, rows, numbers=False)


def bench_bars(root):
    """The table of that name in the report of `hotpath bench`."""
    report = (root / "results/bench/report.md").read_text(encoding="utf-8")
    return re.search(r"## Against the bar\n\n(.*?\n)\n", report, re.S)[1]


BLOCKS = {f.__name__: f for f in (hot_path_table, hot_path_conditions, paper_verdicts, bench_bars)}


def generated(text, root):
    """The text with its blocks made anew, and the names of those that differed."""
    changed = []

    def block(match):
        opening, name, before, closing = match.groups()
        if name not in BLOCKS:
            raise ValueError(f"there is no generated block `{name}`; there are {', '.join(BLOCKS)}")
        after = BLOCKS[name](root)
        if after != before:
            changed.append(name)
        return opening + after + closing

    for name in BLOCKS:
        found = [match[2] for match in BLOCK.finditer(text)].count(name)
        if found != 1 or text.count(f"<!-- generated: {name} -->") != 1:
            raise ValueError(f"README.md holds {found} whole blocks `{name}` instead of one")
    return BLOCK.sub(block, text), changed


def disagreements(root):
    """What the pages of results/paper and results/README.md do not say, though their data do."""
    claims, facts = load(root, "paper/claims.json"), load(root, "paper/facts.json")
    for name, rows_start, verdict in (
        ("paper/report.md", "\n| ", "**{}**"),
        ("paper/report.html", "<tr>", ">{}</span>"),
    ):
        page = html.unescape((root / "results" / name).read_text(encoding="utf-8")).replace("\\|", "|")
        rows = page.split(rows_start)
        for claim in claims:
            row = next((r for r in rows if claim["quote"] in r and claim["rule"] in r), "")
            for text in [verdict.format(claim["verdict"]), *(f["text"] for f in claim["findings"].values())]:
                if text not in row:
                    yield f"results/{name} does not say `{text}` of the claim {claim['claim']}"
    readme = (root / "results/README.md").read_text(encoding="utf-8")
    for text in filter(None, (facts["where"], facts["live_runs"])):
        if text not in readme:
            yield f"results/README.md does not say `{text}`"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument(
        "--check", action="store_true", help="change nothing; exit code 1 when a number does not agree"
    )
    parser.add_argument("--root", type=Path, default=ROOT, help=argparse.SUPPRESS)
    options = parser.parse_args()
    readme = options.root / "README.md"
    try:
        before = readme.read_text(encoding="utf-8")
        after, changed = generated(before, options.root)
        differing = list(disagreements(options.root))
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        print(f"check_numbers.py: {error!r}", file=sys.stderr)
        return 1
    if not options.check:
        part = readme.with_name(".README.md.part")
        part.write_text(after, encoding="utf-8")
        os.replace(part, readme)
    for sentence in differing:
        print(f"check_numbers.py: {sentence}; publish it again", file=sys.stderr)
    if options.check and changed:
        print(
            (
                f"check_numbers.py: {', '.join(changed)} in README.md do not agree with results/; run"
                " launch_scripts/check_numbers.py"
            ),
            file=sys.stderr,
        )
        return 1
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
