# SPDX-License-Identifier: Apache-2.0
"""The reproduction on short simulations: verdicts, resumption, wrong use, and its page."""

import contextlib
import dataclasses
import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any
from unittest import mock

import browser
import package
from hotpath_command import CommandTest

from hotpath_report.paper import cells, checks
from hotpath_report.paper import evidence as evidence_of
from hotpath_report.paper.checks import judge
from hotpath_report.paper.claims import NO_DATA, NOT, PARTLY, REPRODUCED

BENCH = Path(__file__).resolve().parents[2]  # holds the package
TIME_LIMIT_S = 100
ITEMS = ("dropped-jobs", "wcrt-table", "hot-path")


def reproduce(output: Path, *only: str) -> list[Any]:
    options = {"mode": "quick", "live": False, "only": only, "output": str(output)}
    return [sys.executable, "-I", "-B", str(BENCH), "reproduce", json.dumps(options)]


def call_here(words: Any) -> Any:
    """Runs a command line of the package in this process: a new one takes a second for imports."""
    return package.call(Path(), dict(os.environ), *words[words.index(str(BENCH)) + 1 :])


@contextlib.contextmanager
def without_page() -> Iterator[Any]:
    """Skips figures and page, which take most of the time and have their own tests."""
    results = "hotpath_report.paper.results"
    with mock.patch(f"{results}.sections", return_value=[]), mock.patch(f"{results}.write_page"):
        yield


def finished_cells(output: Path) -> dict[Any, Any]:
    """{cell: time of completion}"""
    return {f.parent.name: f.stat().st_mtime_ns for f in Path(output).glob("cells/[!.]*/cell.json")}


def with_executors(evidence: Any, study: str, names: dict[str, str]) -> Any:
    """The evidence with what other executors did in the study `timers` in place of what these did in a study."""

    def changed(rows: Any) -> Any:
        kept = [row for row in rows if row["study"] != study or row["executor"] not in names]
        of_timers = [row for row in rows if row["study"] == "timers"]
        return kept + [
            row | {"study": study, "executor": executor}
            for executor, other in names.items()
            for row in of_timers
            if row["executor"] == other
        ]

    timers, responses = changed(evidence.timers), changed(evidence.responses)
    return dataclasses.replace(evidence, timers=timers, responses=responses)


class Simulated(CommandTest):
    """Tests on one short simulated reproduction."""

    output: Path
    first: Any
    evidence: evidence_of.Evidence

    @classmethod
    def setUpClass(cls) -> None:
        holder = cls.enterClassContext(tempfile.TemporaryDirectory(prefix="hotpath_reproduction_"))
        cls.output = Path(holder) / "paper"
        words = reproduce(cls.output, *ITEMS)
        cls.first = subprocess.run(words, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
        studies = ("timers", "timers_with_release_cost", "autoware", "wcrt")
        every = cells.all_cells(cells.MODES["quick"], 1)
        wanted = [c for c in every if c["source"] != "live" and c["study"] in studies]
        cls.evidence = evidence_of.collect(cls.output, wanted)

    def verdicts(self, evidence: Any) -> dict[Any, Any]:
        return {v.claim.name: v.verdict for v in judge(evidence)}

    def test_writes_page_data_and_claims(self) -> None:
        self.assertEqual(self.first.returncode, 0, self.first.stderr)
        names = "report.html report.md claims.json plan.json data/percentiles.csv figures/dropped_jobs.svg"
        for name in [*names.split(), "figures/hot_path.csv"]:
            self.assertTrue((self.output / name).stat().st_size > 0, name)
        markdown = (self.output / "report.md").read_text(encoding="utf-8")
        for figure in re.findall(r"\]\((figures/[^)]+)\)", markdown):
            self.assertTrue((self.output / figure).exists(), figure)

    def test_verdicts_of_the_right_executors(self) -> None:
        found = self.verdicts(self.evidence)
        claims = "no-drops drops-default drops-static drops-events-re bounds no-overruns slowdown"
        for claim in [*claims.split(), "best-worst-case", "outperforms"]:
            self.assertEqual(found[claim], REPRODUCED, claim)
        self.assertEqual(found["drops-events-ro"], NOT, "stock release-only never skips a timestamp")

    def test_results_of_a_wrong_executor_are_not_reproduced(self) -> None:
        with_cost = "timers_with_release_cost"
        wrong = with_executors(self.evidence, with_cost, {"rm-ro": "default"})
        wrong = with_executors(wrong, "timers", {"rm-ro": "default", "default": "rm-ro"})
        key = itemgetter("study", "executor", "utilisation_percent", "task")
        bounds = {key(row): row["bound_ms"] for row in self.evidence.timers}
        exact = [bounds[with_cost, "rm-ro", *key(row)[2:]] for row in wrong.timers]
        wrong.timers = [row | {"bound_ms": ms} for row, ms in zip(wrong.timers, exact)]
        names = {"rm-ro": "default", "default": "rm-ro"}
        wrong.hot_path = [r | {"executor": names.get(r["executor"], r["executor"])} for r in wrong.hot_path]
        found = self.verdicts(wrong)
        claims = "no-drops drops-default bounds no-overruns imu-overruns-default lidar-pays slowdown"
        for claim in claims.split():
            self.assertEqual(found[claim], NOT, claim)
        for claim in ("best-worst-case", "outperforms"):
            self.assertIn(found[claim], (NOT, PARTLY), claim)
        imu = checks.imu_loss(wrong, "simulated")
        self.assertIn(f"static at most {imu.short}", imu.text, "default loses none")

    def test_few_live_samples_decide_nothing(self) -> None:
        few = [r | {"source": "live", "hot_path_ms": r["hot_path_ms"][:20]} for r in self.evidence.hot_path]
        brief = dataclasses.replace(self.evidence, hot_path=self.evidence.hot_path + few)
        found: Any = {v.claim.name: v for v in judge(brief)}["best-worst-case"]
        self.assertEqual(found.findings["live"].verdict, NO_DATA)
        self.assertEqual(found.verdict, REPRODUCED)

    def test_live_losses_are_counted_and_tolerated_up_to_a_share(self) -> None:
        live = dataclasses.replace(self.evidence)
        facts: dict[str, Any] = {"study": "timers", "source": "live", "executors": ["rm-ro"]}
        facts |= {"load_percent": 60, "repetition": 0, "name": "live.timers.60.rm-ro.1"}
        live.cells = [{**facts, "noise": {"marks": ["x"]}}]
        timers = [row | {"source": "live"} for row in self.evidence.timers if row["study"] == "timers"]
        here: Any
        (here,) = (
            row
            for row in timers
            if (row["utilisation_percent"], row["executor"]) == (60, "rm-ro") and "IMU" in row["task"]
        )
        for lost, verdict in ((0, REPRODUCED), (1, PARTLY), (here["reached"] // 2, NOT)):
            here["skipped"] = lost
            live = dataclasses.replace(live, timers=[*self.evidence.timers, *timers])
            found: Any = {v.claim.name: v for v in judge(live)}["no-drops"].findings
            self.assertEqual(found["simulated"].verdict, REPRODUCED)
            self.assertEqual(found["live"].verdict, verdict, lost)
            if lost:
                self.assertIn(f"{lost} of them in repetitions marked", found["live"].text)

    def test_claims_are_judged_again_from_stored_data(self) -> None:
        # Figures are not compared: drawing them takes most of the time.
        with mock.patch("hotpath_report.paper.results.make_figure", package.blank_figure):
            again = call_here([str(BENCH), "report", self.output, "--output", self.folder])
        self.assertEqual(again.returncode, 0, again.stderr)
        page = Path(again.stdout.split()[0]).parent
        for name in ("claims.json", "report.md", "data/percentiles.csv"):
            self.assertEqual((page / name).read_bytes(), (self.output / name).read_bytes(), name)

    def test_compare_results_with_itself_and_with_another_folder(self) -> None:
        same = self.accepted("diff", self.output, self.output)
        self.assertNotIn("differs", same)
        self.assertRegex(same, r"By hot path: no difference beyond noise \(all \d+ percentiles\)")
        for other in (self.output / "cells", self.output / "nowhere"):
            self.rejected("diff", self.output, other)

    def test_compare_results_sees_another_executor(self) -> None:
        other = self.folder / "other"
        shutil.copytree(self.output / "data", other / "data")
        changed = with_executors(self.evidence, "timers", {"rm-ro": "default"})
        kept = [row for row in changed.hot_path if row["executor"] != "rm-ro"]
        default = [row | {"executor": "rm-ro"} for row in kept if row["executor"] == "default"]
        changed.hot_path = kept + default
        changed.store(other / "data")
        claims = json.loads((self.output / "claims.json").read_text(encoding="utf-8"))
        (other / "claims.json").write_text(json.dumps([{**c, "verdict": NOT} for c in claims]))
        result = self.accepted("diff", self.output, other)
        self.assertRegex(result, r"autoware simulated 80 % rm-ro +max .*(differs|worse)")
        self.assertIn("dropped jobs, timers simulated 90 % rm-ro imu: 0.00 % before", result)
        self.assertIn("verdict of no-drops: reproduced before, not now", result)

    def test_page_in_a_browser(self) -> None:
        """At a phone's width: no fetches, no console messages, no overflow."""
        shown = browser.opened(self, self.output / "report.html", started=False, width=390)
        overflow = "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
        self.assertEqual(shown.run(overflow), 0, "wider than the screen")


class Resumption(CommandTest):
    """Uses the many short cells of these items."""

    ITEMS = ("dropped-jobs", "phases")

    def interrupted(self, number: int) -> tuple[Any, Any, Any, Any, Any]:
        output = self.folder / "paper"
        words = reproduce(output, *self.ITEMS)
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.wait_for(lambda: process.poll() is not None or len(finished_cells(output)) >= 2, "no cell ended")
        process.send_signal(number)
        _, errors = process.communicate(timeout=TIME_LIMIT_S)
        done = finished_cells(output)
        plan = (output / "plan.json").read_bytes()
        self.assertGreaterEqual(len(done), 2, errors)
        return output, process.returncode, errors, done, plan

    def goes_on(self, output: Path, done: Any, plan: Any) -> None:
        again = call_here(reproduce(output, *self.ITEMS))
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual((output / "plan.json").read_bytes(), plan)
        after = finished_cells(output)
        self.assertEqual({name: after[name] for name in done}, done, "a complete cell was repeated")
        self.assertGreater(len(after), len(done))
        self.assertEqual(list((output / "cells").glob(".*.part")), [])

    def test_after_sigkill(self) -> None:
        output, code, _, done, plan = self.interrupted(signal.SIGKILL)
        self.assertEqual(code, -signal.SIGKILL)
        self.goes_on(output, done, plan)
        for name in ("dropped_jobs", "hot_path_phases"):
            self.assertTrue((output / "figures" / f"{name}.svg").exists(), name)

    def test_after_ctrl_c(self) -> None:
        output, code, errors, done, plan = self.interrupted(signal.SIGINT)
        self.assertEqual(code, 130, errors)
        self.assertIn("Interrupted", errors)
        with without_page():
            self.goes_on(output, done, plan)


class WrongUse(CommandTest):
    def assert_refused(self, words: Any, *parts: str) -> None:
        result = call_here(words)
        self.assertEqual(result.returncode, 2, result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)

    def test_messages_name_the_problem(self) -> None:
        self.assert_refused(reproduce(self.folder, "violins"), "violins", "dropped-jobs")
        both = ("paper", "figures", "--quick", "--live", "full", "--output", self.folder)
        self.rejected(*both, says="--quick")
        with mock.patch.dict(os.environ, {"HOTPATH": "/nowhere"}):
            self.assert_refused(reproduce(self.folder), "/nowhere", "build")

    def test_two_at_a_time_in_one_folder(self) -> None:
        with open(self.folder / ".lock", "w", encoding="ascii") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            self.assert_refused(reproduce(self.folder, "overhead"), "another reproduction")

    def test_another_mode_cannot_resume(self) -> None:
        (self.folder / "plan.json").write_text(json.dumps({"mode": "standard", "order": []}))
        self.assert_refused(reproduce(self.folder, "overhead"), "standard")

    def test_list_names_every_item(self) -> None:
        result = call_here([str(BENCH), "reproduction-items"])
        self.assertEqual(result.returncode, 0, result.stderr)
        for name in cells.ITEMS:
            self.assertIn(name, result.stdout)
