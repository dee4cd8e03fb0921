# SPDX-License-Identifier: Apache-2.0
"""Whether anything became worse from OLD to NEW: medians and 99th percentiles of latencies, and losses, of each
executor, with the effect's size, its interval, and a correction for many comparisons; for terminals and CI."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from hotpath_report.errors import InputError
from hotpath_report.pages.judgement import ALARM_RATE, Judgement, judge
from hotpath_report.pages import compare
from hotpath_report.pages.compare import Key
from hotpath_report.statistics import Samples
from hotpath_report.tables import text_table, write_file

HEADER = ["", "measure", "old", "new", "effect", "95 % interval", "p (Holm)", ""]


def of_hot_paths(samples: Mapping[Key, Samples]) -> dict[Key, Samples]:
    """Latencies of chains; response times only where there is no chain."""
    chains = {key: s for key, s in samples.items() if key[0] == "hot path"}
    return chains or dict(samples)


def markdown(judgements: Sequence[Judgement], old: str, new: str) -> str:
    """A summary for a pull request."""
    rows = ["| " + " | ".join(j.cells()) + " |" for j in sorted(judgements, key=lambda j: not j.worse)]
    head = ["| " + " | ".join(HEADER) + " |", "| --- | --- | ---: | ---: | ---: | ---: | ---: | --- |"]
    return "\n".join([f"### {verdict(judgements)}", "", f"`{old}` against `{new}`", "", *head, *rows, ""])


def junit(judgements: Sequence[Judgement]) -> str:
    """A test case for each comparison, as CI systems read them."""
    failures = sum(j.worse for j in judgements)
    root = ElementTree.Element("testsuites")
    attributes = {"name": "hotpath gate", "tests": str(len(judgements)), "failures": str(failures)}
    suite = ElementTree.SubElement(root, "testsuite", attributes)
    for j in judgements:
        case = ElementTree.SubElement(suite, "testcase", {"classname": j.what, "name": j.measure})
        if j.worse:
            said = f"{j.old:.3f} before, {j.new:.3f} now: {j.effect_text()} {j.interval_text()}, p = {j.adjusted:.2g}"
            ElementTree.SubElement(case, "failure", {"message": said})
    return ElementTree.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def verdict(judgements: Sequence[Judgement]) -> str:
    """One sentence."""
    worse = sum(j.worse for j in judgements)
    said = (
        f"{worse} of {len(judgements)} measures became worse"
        if worse
        else f"None of {len(judgements)} measures became worse"
    )
    return f"{said} (Welch, Holm, {100 * ALARM_RATE:.0f} % false alarms)"


def gate(old: str, new: str, outputs: Mapping[str, Any]) -> int:
    """Prints the table, writes `junit` and `markdown` where asked for. Exit code: 1 if anything became worse."""
    before, after = (of_hot_paths(compare.read(Path(folder))) for folder in (old, new))
    losses = compare.losses(Path(old)), compare.losses(Path(new))
    judgements = judge(before, after, losses)
    if not judgements:
        raise InputError(f"{old} and {new} have no executor and setting in common, there is nothing to judge")
    print(text_table(HEADER, [j.cells() for j in judgements]), f"\n{verdict(judgements)}", sep="\n")
    if outputs.get("junit"):
        write_file(Path(outputs["junit"]), junit(judgements))
    if outputs.get("markdown"):
        write_file(Path(outputs["markdown"]), markdown(judgements, old, new))
    return int(any(j.worse for j in judgements))
