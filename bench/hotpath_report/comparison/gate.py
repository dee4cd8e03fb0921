# SPDX-License-Identifier: Apache-2.0
"""Gate against regressions from OLD to NEW, for terminals and CI: mean, median and p99 latency and
losses of each executor, with effect, interval, detectable effect, and a correction for multiple
comparisons."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from hotpath_report.comparison.judgement import ALARM_RATE, POWER, Judgement, judge, percent_text
from hotpath_report.comparison import sides
from hotpath_report.comparison.sides import Side
from hotpath_report.errors import InputError
from hotpath_report.pages import comparison_page
from hotpath_report.pages.text import render
from hotpath_report.pages.writer import Table
from hotpath_report.statistics import Pairing, median
from hotpath_report.tables import show_json, text_table, write_output

HEADER = ["", "measure", "old", "new", "effect", "95 % interval", "p (Holm)", "would find", ""]
METHODS = {
    Pairing.EXACT: "simulated repetitions of equal draws pair by pair",
    Pairing.PAIRED: "interleaved repetitions pair by pair",
    Pairing.INDEPENDENT: "independent repetitions",
}


def of_hot_paths(side: Side) -> Side:
    """The side with latencies of chains; without chains, with response times."""
    chains = {key: s for key, s in side.samples.items() if key[0] == "hot path"}
    has_chains = any(key[0] == "hot path" for key in side.outputs)
    return replace(side, samples=chains if has_chains else side.samples)


def worst_first(judgements: Sequence[Judgement]) -> Table:
    """The comparisons, those that became worse first."""
    rows = [j.cells() for j in sorted(judgements, key=lambda j: not j.worse)]
    return Table("Verdicts", HEADER, rows, numbers=True)


def markdown(judgements: Sequence[Judgement], old: str, new: str) -> str:
    """Summary for a pull request."""
    content = {"verdict": verdict(judgements), "power": power(judgements), "old": old, "new": new}
    return render("gate.md", "md", {**content, "table": worst_first(judgements)})


def junit(judgements: Sequence[Judgement]) -> str:
    """JUnit report with a test case per comparison."""
    failures = sum(j.worse for j in judgements)
    root = ElementTree.Element("testsuites")
    attributes = {"name": "hotpath gate", "tests": str(len(judgements)), "failures": str(failures)}
    suite = ElementTree.SubElement(root, "testsuite", attributes)
    for j in judgements:
        case = ElementTree.SubElement(suite, "testcase", {"classname": j.what, "name": j.measure})
        if j.worse:
            values = f"{j.growth.before:.3f} before, {j.growth.after:.3f} now"
            said = f"{values}: {j.effect_text()} {j.interval_text()}, p = {j.adjusted:.2g}"
            ElementTree.SubElement(case, "failure", {"message": said})
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def verdict(judgements: Sequence[Judgement]) -> str:
    """The result in one sentence."""
    n, worse = len(judgements), sum(j.worse for j in judgements)
    if all(j.same for j in judgements):
        return f"No change: in each pair of equal draws all {n} measures are the same"
    how = " and ".join(METHODS[p] for p in sorted({j.pairing for j in judgements}, reverse=True))
    return f"{worse or 'None'} of {n} measures became worse ({how}; at most {100 * ALARM_RATE:.0f} % false alarms)"


def power(judgements: Sequence[Judgement]) -> str:
    """The smallest growth of a latency that raises an alarm, in a sentence."""
    noisy = sorted(j.detectable_percent for j in judgements if not j.counted and not j.exact)
    exact = "In simulated pairs that agree, any growth is found."
    if not noisy:
        return exact
    middle = median(noisy)
    most = f" ({percent_text(noisy[-1])} in the noisiest one)" if noisy[-1] > 1.05 * middle else ""
    said = f"With these repetitions, a growth of {percent_text(middle)} would be found in the typical latency{most}"
    said += f" with a probability of {100 * POWER:.0f} %."
    if any(j.simulated and j.pairing == Pairing.INDEPENDENT for j in judgements):
        said += " Simulate both with the same --seed to compare pair by pair."
    return said if len(noisy) == sum(not j.counted for j in judgements) else f"{exact} {said}"


def judged(folders: tuple[Path, Path], across_loads: bool) -> tuple[Side, Side, list[Judgement]]:
    """Both sides, counts scaled to the shorter repetition, and their comparisons. Raises InputError."""
    before, after = (of_hot_paths(sides.side(folder)) for folder in folders)
    if before.mode != after.mode:
        modes = " and ".join(side.mode or "a run" for side in (before, after))
        raise InputError(f"{folders[0]}, {folders[1]}: repetitions differ in length ({modes})")
    before, after = before.scaled_to(after), after.scaled_to(before)
    if across_loads:
        before, after = sides.regardless_of_load(before, after)
    if not before.outputs.keys() & after.outputs.keys():
        raise sides.nothing_in_common(str(folders[0]), str(folders[1]), before.outputs, after.outputs)
    # `hotpath run --against` measured both sides by turns, in sibling folders.
    by_turns = all(map(sides.parts_of, folders)) and len({folder.resolve().parent for folder in folders}) == 1
    judgements = judge(before, after, by_turns)
    if not judgements:
        raise InputError(f"{folders[0]}: no output and no job after the warm-up, there is nothing to judge")
    return before, after, judgements


def gate(old: str, new: str, across_loads: bool, outputs: Mapping[str, Any]) -> int:
    """Prints the table, writes the requested reports. Returns 1 if anything became worse."""
    folders = Path(old), Path(new)
    before, after, judgements = judged(folders, across_loads)
    sentences = [verdict(judgements), power(judgements)]
    print(text_table(HEADER, [j.cells() for j in judgements]), end="\n\n")
    print(*sentences, sep="\n")
    show_json([j.facts() for j in judgements])
    if outputs.get("junit"):
        write_output(Path(outputs["junit"]), "--junit", junit(judgements))
    if outputs.get("markdown"):
        write_output(Path(outputs["markdown"]), "--markdown", markdown(judgements, old, new))
    if outputs.get("page"):
        samples, table = (before.samples, after.samples), worst_first(judgements)
        comparison_page.write(Path(outputs["page"]), folders, samples, sentences, table)
    return int(any(j.worse for j in judgements))
