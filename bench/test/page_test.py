# SPDX-License-Identifier: Apache-2.0
"""The interactive page of `hotpath report` in headless Chromium: what it shows is read back and
compared with summary.json, jobs.csv, chains.csv and `hotpath explain --json`."""

import functools
import json
import re
import tempfile
from pathlib import Path
from typing import Any

from browser import Browser, opened
from hotpath_command import CommandTest, Job, RunFolder, csv_rows
from package import write_report

COUNT_CANVASES = """
window.canvases = 0;
const make = Document.prototype.createElement;
Document.prototype.createElement = function (name, ...more) {
  window.canvases += name === 'canvas';
  return make.call(this, name, ...more);
};
"""
QUANTILES = {"p50": 0.5, "p90": 0.9, "p99": 0.99, "max": 1}


@functools.lru_cache(maxsize=2)
def jobs_of(folder: str, executor: str, repetition: int) -> Any:
    """The started jobs of one repetition, whose file does not change; reading it takes longer than
    most checks."""
    rows = RunFolder(folder).rows("jobs.csv")
    found = [row for row in rows if (row["executor"], row["repetition"]) == (executor, str(repetition))]
    return [Job(row) for row in found if row["start_ns"]]


class Page(CommandTest):
    """The page of one run, and the files that it was made from. All tests share one folder, with the
    runs and pages that they make."""

    place: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.place = Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="hotpath_page_")))

    def setUp(self) -> None:
        super().setUp()
        self.folder = self.place

    def simulated(self, name: str, *words: object) -> str:
        """The name of a simulated run, made by the first test that needs it."""
        if not (self.folder / name).exists():
            self.accepted("simulate", *words, "--output", name)
        return name

    def four_executors(self) -> str:
        return self.simulated("four", "--executors", "default,rm-ro,multi:2,events-ro", "--duration", 4)

    def two_executors(self) -> str:
        return self.simulated("two", "--executors", "rm-ro,default", "--duration", 4)

    def page_of(self, *runs: str) -> Path:
        """The page about runs, without figures."""
        page = self.folder / ("page_" + "_".join(run.replace("/", "_") for run in runs))
        if not page.exists():
            write_report(self.folder, self.environment, *runs, "--output", page)
        return page / "report.html"

    def page(self, *runs: str, **options: Any) -> Browser:
        """The browser with the page about runs."""
        return opened(self, self.page_of(*runs), **options)

    def check_curves(self, browser: Browser, run: RunFolder, target: str, latencies: dict[str, Any]) -> None:
        """Compares the curves of a chain or task with {executor: quantiles of summary.json}."""
        browser.choose("target", target)
        found = browser.curves()
        counts = browser.texts(".legend label")
        shown = {label for label, of in latencies.items() if of["n"] > 0}
        self.assertEqual({series["executor"] for series, _, _ in found}, shown)
        compared = 0
        for series, q, ms in found:
            of = latencies[series["executor"]]
            for name, probability in QUANTILES.items():
                if q == probability:
                    self.assertAlmostEqual(ms, of[name], delta=0.00051, msg=f"{target} {q}")
                    compared += 1
            label = series["label"]
            self.assertIn(f"{label} n = {of['n']}", [" ".join(c.split(",")[0].split()) for c in counts])
        # p99 only where 100 samples resolve it
        self.assertEqual(compared, sum(3 + (of["n"] >= 100) for of in latencies.values() if of["n"] > 0))

    def check_list(self, browser: Browser, run: RunFolder, chain: str) -> list[Any]:
        """Selects the slower half of the outputs and compares the list with chains.csv."""
        browser.choose("target", chain)
        rows = [
            (latency, executor, repetition, sequence)
            for (executor, repetition), of in run.chains().items()
            for name, sequence, _, latency in of
            if name == chain
        ]
        rows.sort(reverse=True)
        limit = rows[len(rows) // 2][0] / 1e6
        browser.choose_range(limit, "")
        listed = browser.listed()
        expected = [row for row in rows if row[0] / 1e6 >= limit - 1e-6]
        self.assertTrue(listed["head"].startswith(f"{len(expected)} of {len(rows)} outputs"), listed["head"])
        found = [int(row["latencyNs"]) for row in listed["rows"]]
        self.assertEqual(found, [row[0] for row in expected][:100])
        for row in listed["rows"]:
            self.assertIn(f"{int(row['latencyNs']) / 1e6:.3f} ms", row["text"])
        return listed["rows"]

    def check_output(
        self, browser: Browser, run: RunFolder, name: str, place: int, kind: str = "chain"
    ) -> None:
        """Clicks an output of the list: its causes are those of `hotpath explain`, and the timeline
        shows the jobs of its path where jobs.csv has them."""
        browser.run("document.querySelectorAll('.outputs .pick')[arguments[0]].click()", place)
        row = browser.listed()["rows"][place]
        series = browser.run("return hotpathPage.store.document.series")[int(row["series"])]
        words = ("--executors", series["executor"], f"--{kind}", name, "--repetition", row["repetition"])
        one = json.loads(self.accepted("explain", run.path, *words, "--sequence", row["sequence"], "--json"))
        account = browser.accounts()[0]
        self.assertEqual(account["causes"], {name: ns for name, ns in one["causes_ns"].items() if ns > 0})
        self.assertEqual(sum(account["causes"].values()), int(row["latencyNs"]))
        for ns in account["causes"].values():
            self.assertIn(f"{ns / 1e6:.3f} ms", account["text"])
        parts = [[f"{p['ns'] / 1e6:.3f}", p["rule"]] for p in one["parts"]]
        self.assertEqual([[p[1], p[5]] for p in account["parts"]], parts)
        self.check_timeline(browser, run, series["executor"], one)

    def check_timeline(self, browser: Browser, run: RunFolder, executor: str, one: dict[str, Any]) -> None:
        shown = browser.timeline()
        view = shown["view"]
        per_pixel = (view["to"] - view["from"]) / view["width"]
        jobs = {f"{j.task} {j.sequence}": j for j in jobs_of(str(run.path), executor, one["repetition"])}
        path = [item for item in shown["panels"][0]["shown"] if item["what"] == "path"]
        names = {f"{step['task']} {step['sequence']}" for step in one["path"]}
        self.assertEqual({item["name"] for item in path}, names)

        def instant(px: float) -> float:
            return float(view["from"] + (px - view["left"]) * per_pixel)

        for item in path:
            job = jobs[item["name"]]
            self.assertAlmostEqual(instant(item["left"]), job.start, delta=1)
            if item["right"] - item["left"] > 1:  # a job is at least one pixel wide
                self.assertAlmostEqual(instant(item["right"]), job.finish, delta=1)
        arrows = [item for item in shown["panels"][0]["shown"] if item["what"] == "arrow"]
        self.assertEqual(len(arrows), len(one["path"]) - 1)
        bar = [item for item in shown["panels"][0]["shown"] if item["what"] == "part"]
        self.assertEqual(len(bar), len(one["parts"]))
        for item, part in zip(bar, one["parts"]):
            self.assertAlmostEqual((item["right"] - item["left"]) * per_pixel, part["ns"], delta=1)
        last = jobs[f"{one['path'][-1]['task']} {one['path'][-1]['sequence']}"]
        self.assertAlmostEqual(instant(bar[-1]["right"]), last.finish, delta=1)

    def check_outputs(self, browser: Browser, folder: str) -> None:
        """The distribution, and the worst and the last listed output, of each chain and of one task."""
        run = RunFolder(self.folder / folder)
        executors = run.summary()["executors"]
        for k, chain in enumerate(run.run["chains"]):
            of = {e["executor"]: e["chains"][k]["end_to_end_latency_ms"] for e in executors}
            self.check_curves(browser, run, chain, of)
            rows = self.check_list(browser, run, chain)
            for place in {0, len(rows) - 1}:
                self.check_output(browser, run, chain, place)
        self.check_task(browser, run, 0)

    def check_task(self, browser: Browser, run: RunFolder, k: int) -> None:
        """The distribution, and in each eighth task the slowest job and the tenth."""
        executors = run.summary()["executors"]
        name = executors[0]["tasks"][k]["task"]
        of = {e["executor"]: e["tasks"][k]["response_ms"] for e in executors}
        if not any(quantiles["n"] > 0 for quantiles in of.values()):
            return
        self.check_curves(browser, run, name, of)
        if k % 8 == 0:
            browser.choose_range("", "")
            listed = len(browser.listed()["rows"])
            for place in {0, min(9, listed - 1)}:
                self.check_output(browser, run, name, place, "task")

    def test_a_simulated_run_of_several_executors(self) -> None:
        run = self.four_executors()
        browser = self.page(run)
        self.check_outputs(browser, run)
        of = RunFolder(self.folder / run)
        for task in range(4, len(of.summary()["executors"][0]["tasks"]), 4):
            self.check_task(browser, of, task)
        self.check_two_executors(browser)
        self.check_sentences(browser, run)
        self.check_bounds(browser, run)
        self.assertEqual(browser.violations(), [])

    def test_without_javascript(self) -> None:
        page = self.page_of(self.four_executors())
        without = page.with_name("without.html")
        text = re.sub(r"(?s)<script.*?</script>", "", page.read_text(encoding="utf-8"))
        without.write_text(text, encoding="utf-8")
        browser = opened(self, without, started=False)
        read = "return [document.querySelectorAll('figure svg').length, document.querySelectorAll('table').length]"
        figures, tables = browser.run(read)
        self.assertGreater(figures, 5)
        self.assertGreater(tables, 5)
        self.assertFalse(browser.run("return document.getElementById('explore').checkVisibility()"))

    def check_sentences(self, browser: Browser, run: str) -> None:
        """Below the curves are the sentences of `hotpath explain`, against the first executor."""
        shown = browser.texts("#explore .notes li")
        first, *others = RunFolder(self.folder / run).run["executors"]
        for executors, text in zip([first, *(f"{first},{other}" for other in others)], shown, strict=True):
            answer = self.accepted("explain", run, "--executors", executors, "--json")
            self.assertEqual(text, " ".join(json.loads(answer)["sentences"]))

    def check_bounds(self, browser: Browser, run: str) -> None:
        """The lines of a chain are the tightest bounds of `hotpath analyze`, and the computation."""
        browser.choose("target", "hot_path")
        marks = browser.run("return hotpathPage.target.marks.map((m) => [m.label, m.ms])")
        self.accepted("analyze", "autoware", "--trace", run, "--csv", "bounds.csv")
        expected: dict[str, float] = {}
        for row in csv_rows(self.folder / "bounds.csv"):
            if row["kind"] == "chain":
                label, bound = f"bound of {row['executor']}", int(row["bound_ns"]) / 1e6
                expected[label] = min(bound, expected.get(label, bound))
        self.assertIn("bound of rm-ro", expected)
        limits = {x["label"]: x["ms"] for x in RunFolder(self.folder / run).run["limits"]}
        self.assertEqual(dict(marks), expected | limits)

    def check_two_executors(self, browser: Browser) -> None:
        """The same source job under another executor, on the same axis."""
        browser.choose("target", "hot_path")
        browser.run("document.querySelector('.outputs .pick').click()")
        first = browser.accounts()[0]["title"].split(":")[0]
        other = "rm-ro" if first != "rm-ro" else "default"
        browser.choose("other", other)
        accounts = browser.accounts()
        self.assertEqual(len(accounts), 2)
        sources = [account["parts"][0][3] for account in accounts]
        shown = browser.timeline()["panels"]
        self.assertEqual([len(shown), shown[1]["label"]], [2, other])
        self.assertEqual(sources[0].split(" ")[-1], sources[1].split(" ")[-1])
        starts = [min(item["left"] for item in panel["shown"]) for panel in shown]
        self.assertLess(
            max(starts),
            browser.run("return hotpathPage.timeline.view.left + hotpathPage.timeline.view.width"),
        )

    def test_an_imported_run(self) -> None:
        self.accepted("export", "ctf", self.two_executors(), "--output", "traces")
        chain = ("--chain", "FrontLidarDriver:ObjectCollisionEstimator")
        self.accepted("import", "ctf", "traces/default-0", *chain, "--output", "imported")
        self.check_outputs(self.page("imported/run"), "imported/run")

    def test_two_runs_of_timers(self) -> None:
        for executor in ("rm-ro", "edf-ro"):
            self.simulated(executor, "--graph", "timers_only_60", "--executors", executor, "--duration", 2)
        browser = self.page("rm-ro", "edf-ro", dark=True, width=800)
        task = RunFolder(self.folder / "rm-ro").summary()["executors"][0]["tasks"][0]["task"]
        browser.choose("target", task)
        labels = browser.texts(".legend label")
        self.assertEqual(
            [" ".join(label.split()[:3]) for label in labels], ["rm-ro in rm-ro", "edf-ro in edf-ro"]
        )
        marks = browser.run("return hotpathPage.target.marks.map((m) => m.label)")
        self.assertEqual({"deadline", "bound of rm-ro in rm-ro", "bound of edf-ro in edf-ro"}, set(marks))
        jobs = [j for j in jobs_of(str(self.folder / "rm-ro"), "rm-ro", 0) if j.task == task]
        listed = browser.listed()["rows"]
        worst = max(j.finish - j.timestamp for j in jobs if j.outcome == "ran")
        self.assertIn(worst, [int(row["latencyNs"]) for row in listed])
        self.assertEqual(browser.violations(), [])
        self.assertEqual(browser.run("return document.documentElement.scrollWidth"), 800)

    def test_the_timeline_by_keyboard(self) -> None:
        run = self.two_executors()
        browser = self.page(run)
        canvas = "document.querySelector('.timeline canvas')"
        press = f"{canvas}.dispatchEvent(new KeyboardEvent('keydown', {{key: arguments[0]}}))"

        def view(key: str) -> tuple[float, float]:
            browser.run(press, key)
            of = browser.timeline()["view"]
            return of["from"], of["to"]

        whole = view("Home")
        self.assertEqual(whole, (0, browser.run("return hotpathPage.timeline.panels[0].jobs.of.length_ns")))
        browser.choose("rows-of", "all tasks")
        drawn = browser.timeline()["panels"][0]
        jobs = jobs_of(str(self.folder / run), drawn["label"], 0)
        self.assertEqual(set(drawn["rows"]), {j.task for j in jobs})
        nearer = view("+")
        self.assertLess(nearer[1] - nearer[0], whole[1] - whole[0])
        right = view("ArrowRight")
        self.assertGreater(right[0], nearer[0])
        self.assertAlmostEqual(right[1] - right[0], nearer[1] - nearer[0], delta=1)
        output = view("Enter")
        self.assertLess(output[1] - output[0], 0.1e9)

    def test_the_mouse(self) -> None:
        run = self.two_executors()
        browser = self.page(run)
        latencies = [row[3] / 1e6 for rows in RunFolder(self.folder / run).chains().values() for row in rows]
        over = ".ecdf .u-over"
        scale = browser.run("const s = hotpathPage.ecdf.plot.scales.y; return [s.min, s.max]")
        self.assertEqual(scale[0], 0)
        # Hover: the tooltip has the quantile at this height.
        browser.drag(over, (0.5, 0.02))
        self.assertIn("the largest", browser.text(".ecdf .tip"))
        self.assertIn(f"{max(latencies):.3f} ms", browser.text(".ecdf .tip"))
        # Drag: the outputs within a range of latencies.
        browser.drag(over, *((value / scale[1], 0.4) for value in (30, 40, 44)))
        chosen = [v for v in latencies if 30 <= v <= 44]
        self.assertTrue(0 < len(chosen) < len(latencies))
        listed = browser.listed()
        self.assertEqual(
            [int(row["latencyNs"]) / 1e6 for row in listed["rows"]], sorted(chosen, reverse=True)
        )
        # Click: the outputs of the curve below the cursor, around this quantile.
        browser.drag(over, (38.2 / scale[1], 0.3), (38.2 / scale[1], 0.3))
        rows = browser.listed()["rows"]
        self.assertEqual({row["text"].split("\t")[1].strip() for row in rows}, {"rm-ro"})
        # Timeline: drag pans, and a double click zooms.
        canvas = ".timeline canvas"
        before = browser.timeline()["view"]
        browser.drag(canvas, (0.6, 0.5), (0.55, 0.5), (0.5, 0.5))
        after = browser.timeline()["view"]
        self.assertGreater(after["from"], before["from"])
        browser.run("document.querySelector(arguments[0]).dispatchEvent(new MouseEvent('dblclick'))", canvas)
        nearer = browser.timeline()["view"]
        self.assertAlmostEqual(nearer["to"] - nearer["from"], (after["to"] - after["from"]) / 2, delta=1)
        # Over time: a click selects the nearest output.
        browser.run("const t = hotpathPage.trend, u = t.plot, o = t.outputs[3];"
                    "window.place = [u.valToPos(o.end / 1e9, 'x') / u.over.clientWidth,"
                    " u.valToPos(o.latency / 1e6, 'y') / u.over.clientHeight, o.sequence]")  # fmt: skip
        x, y, sequence = browser.run("return window.place")
        browser.drag(".trend .u-over", (x, y), (x, y))
        self.assertIn(f"of output {sequence}", browser.accounts()[0]["title"])

    def test_every_plot_is_drawn_once(self) -> None:
        """Opening a page makes as many canvases as it shows; a second drawing would make another one."""
        browser = self.page(self.two_executors(), before=COUNT_CANVASES)
        made, shown, timelines = browser.run(
            "return [canvases, document.querySelectorAll('canvas').length, hotpathPage.timeline.drawings]"
        )
        self.assertEqual((made, timelines), (shown, 1))
        browser.emulate(width=900, height=800)
        widths = "return [document.querySelector('.ecdf canvas').clientWidth, hotpathPage.timeline.drawings]"
        browser.run("return 0")
        width, timelines = browser.run(widths)
        self.assertLess(width, 900)
        self.assertEqual(timelines, 2)

    def test_hostile_names_are_text(self) -> None:
        words = ("--graph", "sequences", "--executors", "default,rm-ro", "--duration", 2)
        run = self.folder / self.simulated("hostile", *words)
        hostile = "<script>hotpathEvil=1</script>`|\x1b[2J\u202e\u200f<img src=x onerror=hotpathEvil=1>"
        for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
            as_written = json.dumps(hostile)[1:-1] if name.endswith(".json") else hostile
            text = (run / name).read_text().replace("localization", as_written[:12] + "localization")
            (run / name).write_text(text.replace("LidarDriver", as_written))
        browser = self.page("hostile")
        names = browser.run("return [...document.querySelectorAll('#target option')].map((o) => o.text)")
        self.assertTrue(any("<script>hotpathEvil" in name for name in names), names)
        for name in names:
            self.assertNotRegex(name, "[\x1b\u202e\u200f]")
            browser.choose("target", name)
        self.assertEqual(browser.run("return [typeof hotpathEvil, document.images.length, document.scripts.length]"),
                         ["undefined", 0, 2])  # fmt: skip

    def test_a_run_without_jobs(self) -> None:
        browser = self.page(self.simulated("untraced", "--duration", 2, "--no-trace"))
        self.assertIn("stores no jobs", browser.text("#explore .note"))
        self.assertFalse(browser.run("return document.querySelector('.timeline').checkVisibility()"))
        self.assertGreater(len(browser.curves()), 10)

    def test_a_run_that_is_thinned(self) -> None:
        words = ("--executors", "default,rm-ro,multi:2,events-ro", "--load", 40, "--duration", 80)
        browser = self.page(self.simulated("long", *words))
        run = RunFolder(self.folder / "long")
        started = sum(bool(row["start_ns"]) for row in run.rows("jobs.csv"))
        self.assertGreater(started, 100_000)
        kept = browser.run(
            "return hotpathPage.store.document.runs[0].repetitions.map((r) => r.jobs[0].length)"
        )
        self.assertLessEqual(sum(kept), 100_000)
        note = browser.text("#explore .note")
        self.assertIn(f"The timeline holds {sum(kept)} of {started} jobs", note)
        # The worst outputs have all of their jobs, and the end of the run has a sentence.
        self.check_output(browser, run, "hot_path", 0)
        browser.run("hotpathPage.timeline.view.look(7.5e10, 7.6e10)")
        self.assertIn("leaves out these jobs", browser.text(".timeline"))
        self.assertLess(self.page_of("long").stat().st_size, 6e6)
