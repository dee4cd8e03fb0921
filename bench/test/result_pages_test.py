# SPDX-License-Identifier: Apache-2.0
"""The interactive pages of `advise`, `sweep`, `capacity` and `diff` in headless Chromium: what
they show is read back and compared with the files of the results."""

import re
import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Any

import package
from browser import Browser, opened
from hotpath_command import CommandTest, RunFolder, csv_rows, document

SWEEP = """command: simulate
repetitions: 3
fixed: {graph: autoware, duration: 2, warm-up: 0, executors: [default, rm-ro], phases: random}
axes:
  load: [40, 60, 80]
  cores: [1, 2]
"""
MEASURES: dict[str, tuple[str, Callable[[list[float]], float]]] = {
    "median hot-path latency (ms)": ("hot_path_p50_ms", statistics.median),
    "worst hot-path latency (ms)": ("hot_path_max_ms", max),
    "lost: skipped and overwritten": ("lost", max),
}

ADVISE = ("advise", "autoware", "--cores", 2, "--repetitions", 2, "--duration", 2)


class Curves(CommandTest):
    """Sweeps and searches for a capacity, which write their pages."""

    def setUp(self) -> None:
        super().setUp()
        del self.environment["HOTPATH_FIGURES"]

    def check_plot(self, browser: Browser, title: str, expected: dict[tuple[str, float], float]) -> None:
        browser.choose("curves-of", title)
        tips = browser.tooltips(".plots")
        found = {(name, x): float(text.split("\t")[2]) for _, name, x, text in tips}
        self.assertEqual(set(found), set(expected), title)
        for key, value in expected.items():
            self.assertAlmostEqual(found[key], value, delta=0.00051, msg=f"{title} {key}")

    def test_of_a_sweep(self) -> None:
        (self.folder / "sweep.yaml").write_text(SWEEP)
        self.accepted("sweep", "sweep.yaml", "--output", "swept")
        rows = [row for row in csv_rows(self.folder / "swept/table.csv") if row["chain"] == "hot_path"]
        browser = opened(self, self.folder / "swept" / "report.html")
        for title, (column, over_repetitions) in MEASURES.items():
            for cores, suffix in (("", ""), ("1", ", cores 1"), ("2", ", cores 2")):
                points: dict[tuple[str, float], list[float]] = {}
                for row in rows:
                    if cores in ("", row["cores"]):
                        key = row["executor"], float(row["load"])
                        points.setdefault(key, []).append(float(row[column]))
                expected = {key: over_repetitions(of) for key, of in points.items()}
                self.check_plot(browser, title + suffix, expected)
        # An interval encloses its value, and the figure of the same lines is not shown twice.
        interval = re.compile(r"([\d.]+)\t ?\[([\d.]+), ([\d.]+)\]")
        browser.choose("curves-of", next(iter(MEASURES)))
        for *_, text in browser.tooltips(".plots"):
            value, low, high = map(float, interval.search(text).groups())  # type: ignore[union-attr]
            self.assertTrue(low <= value <= high)
        self.assertFalse(browser.run("return document.getElementById('sweep_lines') !== null"))
        box = "document.querySelector('.plots .legend input').click()"
        browser.run(box)
        self.assertEqual({name for _, name, *_ in browser.tooltips(".plots")}, {"rm-ro"})
        self.assertEqual(browser.violations(), [])

    def test_of_a_capacity(self) -> None:
        words = ("--executors", "default,rm-ro", "--duration", 1, "--resolution", 20)
        self.accepted("capacity", *words, "--repetitions", 3, "--output", "levels")
        rows = [row for row in csv_rows(self.folder / "levels/levels.csv") if row["source"] == "simulated"]
        self.assertGreater(len(rows), 4)
        browser = opened(self, self.folder / "levels" / "report.html", dark=True)
        columns = {"p99 of the age of the data (ms)": "age_p99_ms", "worst age of the data (ms)": "age_worst_ms",
                   "worst hot-path latency (ms)": "worst_ms", "deadline overruns": "deadline_overruns"}  # fmt: skip
        for title, column in columns.items():
            of = {(row["executor"], float(row["load"])): float(row[column]) for row in rows if row[column]}
            self.check_plot(browser, title, of)
        self.environment["HOTPATH_FIGURES"] = "none"
        level = next(row for row in rows if row["executor"] == "rm-ro")
        run = ("--executors", "rm-ro", "--load", level["load"], "--duration", 1, "--repetitions", 3)
        self.accepted("simulate", *run, "--phases", "random", "--output", "run")
        (executor,) = RunFolder(self.folder / "run").summary()["executors"]
        for before, key in (("age_", "end_to_end_latency_ms"), ("", "hot_path_latency_ms")):
            latency = executor["chains"][0][key]
            self.assertAlmostEqual(float(level[before + "worst_ms"]), latency["max"], delta=1e-5)
            self.assertAlmostEqual(float(level[before + "p99_ms"]), latency["p99"], delta=1e-5)
        self.assertEqual(browser.violations(), [])


class Distributions(CommandTest):
    """Advice and comparisons."""

    def curves(self, browser: Browser) -> dict[tuple[str, float], float]:
        """{(label, probability): ms}"""
        return {(series["label"], q): ms for series, q, ms in browser.curves()}

    def check_advice(self, advice: dict[str, Any], browser: Browser, target: str) -> None:
        """The curves of all candidates have the quantiles and bounds of advice.json."""
        browser.choose("target", target)
        for _ in browser.run("return [...document.querySelectorAll('.legend input:not(:checked)')]"):
            browser.run("document.querySelector('.legend input:not(:checked)').click()")
        found = self.curves(browser)
        compared = 0
        for row in advice["ranking"]:
            if "median_ms" not in row:
                continue
            label = row["name"] + (" (now)" if row["name"] == advice["now"] else "")
            for q, key in ((0.5, "median_ms"), (0.99, "p99_ms"), (1, "worst_ms")):
                if (label, q) in found:
                    self.assertAlmostEqual(found[label, q], row[key]["value"], delta=0.00051, msg=label)
                    compared += 1
        self.assertGreaterEqual(compared, len(advice["ranking"]))
        bounds = {f"bound of {r['name']}": r["bound_ms"] for r in advice["ranking"] if r.get("bound_ms")}
        marks = dict(browser.run("return hotpathPage.target.marks.map((m) => [m.label, m.ms])"))
        limits = advice["requirements_ms"]
        self.assertEqual(marks.pop("requirement", None), next(iter(limits.values()), None))
        self.assertEqual(set(marks), set(bounds))
        for label, bound in bounds.items():
            self.assertAlmostEqual(marks[label], bound, delta=1e-5)

    def test_of_an_advice(self) -> None:
        del self.environment["HOTPATH_FIGURES"]  # the command writes the page
        words = ("--executors", "default,rm-ro,events-ro", "--repetitions", 3, "--duration", 2)
        out = self.accepted("advise", "autoware", *words, "--output", "advice")
        self.environment["HOTPATH_FIGURES"] = "none"
        folder = self.folder / "advice"
        advice = document(folder / "advice.json")
        browser = opened(self, folder / "report.html")
        # The current and the recommended one, over each other and one above the other.
        on = "return [...document.querySelectorAll('.legend label')].filter((l) => l.querySelector('input').checked)"
        names = browser.run(on + ".map((l) => l.innerText.split('n =')[0].trim())")
        self.assertEqual(names, [f"{advice['now']} (now)", advice["recommended"]])
        shown = browser.timeline()["panels"]
        self.assertEqual({panel["label"] for panel in shown}, set(names))
        accounts = browser.accounts()
        self.assertEqual(len(accounts), 2)
        self.assertEqual(*(account["parts"][0][3].split(" ")[-1] for account in accounts))
        notes = browser.texts("#explore .notes li")
        self.assertEqual(notes, ["In the first draw: " + " ".join(advice["causes"])])
        for sentence in advice["causes"]:
            self.assertIn(sentence, out)
        self.check_advice(advice, browser, "hot_path")
        self.check_stored_draws(folder, advice)
        self.assertEqual(browser.violations(), [])

    def check_stored_draws(self, folder: Path, advice: dict[str, Any]) -> None:
        """The stored runs are the first draw, and their commands repeat them."""
        rows = [row for row in csv_rows(folder / "latencies.csv") if row["repetition"] == "0"]
        for name, stored in ((advice["now"], "now"), (advice["recommended"], "recommended")):
            draw = [int(row["hot_path_latency_ns"]) for row in rows if row["executor"] == name]
            run = RunFolder(folder / stored / "run")
            ((_, outputs),) = run.chains().items()
            self.assertEqual([latency for _, _, latency, _ in outputs], draw)
            self.assertGreater(len(draw), 10)
            self.accepted(*run.run["command"], "--output", f"again-{stored}")
            for file in ("run.json", "jobs.csv"):
                again = (self.folder / f"again-{stored}" / file).read_bytes()
                self.assertEqual(again, (folder / stored / "run" / file).read_bytes())

    def test_of_an_advice_with_deployments_and_requirements(self) -> None:
        words = ("--now", "multi:2", "--for", "hot_path<150")
        self.accepted(*ADVISE, *words, "--output", "advice")
        package.write_advice(self.folder, self.environment, self.folder / "advice")
        advice = document(self.folder / "advice" / "advice.json")
        browser = opened(self, self.folder / "advice" / "report.html")
        self.check_advice(advice, browser, "hot_path")

    def test_stored_draws_of_deployments(self) -> None:
        words = ("--executors", "default", "--deployments", "picas", "--now", "default")
        self.accepted(*ADVISE, *words, "--output", "advice")
        advice = document(self.folder / "advice" / "advice.json")
        self.assertEqual(advice["stored"], ["default", "picas"])
        self.check_stored_draws(self.folder / "advice", advice)

    def test_no_stored_draws_of_split_groups(self) -> None:
        words = ("--executors", "default", "--now", "rm-threads")
        self.accepted(*ADVISE, *words, "--output", "advice")
        advice = document(self.folder / "advice" / "advice.json")
        self.assertEqual(advice["now"], "rm-threads")
        self.assertEqual(advice["stored"], [])
        package.write_advice(self.folder, self.environment, self.folder / "advice")
        self.assertTrue((self.folder / "advice" / "report.html").exists())

    def test_of_a_gate(self) -> None:
        for name, load in (("old", 80), ("new", 85)):
            words = ("--executors", "default,rm-ro", "--load", load, "--duration", 2, "--repetitions", 3)
            self.accepted("simulate", *words, "--phases", "random", "--output", name)
        compare = ("diff", "old", "new", "--across-loads", "--output", "page")
        code, judged, errors = self.command(*compare, "--gate")
        self.assertEqual(code, 1, errors)
        browser = opened(self, self.folder / "page" / "report.html", dark=True)
        browser.choose("target", "hot_path")
        found = self.curves(browser)
        for name in ("old", "new"):
            for executor in RunFolder(self.folder / name).summary()["executors"]:
                of = executor["chains"][0]["end_to_end_latency_ms"]
                for q, key in ((0.5, "p50"), (1, "max")):
                    label = f"{executor['executor']} in {name}"
                    self.assertAlmostEqual(found[label, q], of[key], delta=0.00051)
        table = "return [...document.querySelectorAll('main > .scroll table')].at(-1).innerText"
        shown = [line.split("\t") for line in browser.run(table).splitlines() if "\t" in line]
        self.assertGreater(len(shown), 5)
        for row in shown[1:]:
            self.assertIn(" ".join(row[:3]), " ".join(judged.split()))
        self.assertEqual(shown[1][-1], "worse")
        self.assertEqual(browser.violations(), [])
        # Without --gate: the table of percentiles.
        self.accepted(*compare)
        self.assertIn("By age: worse (", (self.folder / "page" / "report.md").read_text())
