# SPDX-License-Identifier: Apache-2.0
"""Hostile names in options, file names, graphs, traces and stored runs. They contain control
sequences and markup for terminals, Markdown, HTML, figures and graph files; the output must neither
control a terminal nor contain their markup."""

import json
import re
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import package
from ctf_trace import sensor_and_filter
from hotpath_command import CommandTest

# Clears the screen, rings, overwrites the line, reverses the text; a script, a table cell, code, a
# link, a formula.
NAME = "x\x1b[2J\x07\r\u202e\u009b1m<script>alert(1)</script>|`a`](http://b)$y^{$*z*"
LINES = NAME + "\n# heading\n```\n"
SHORT = "x\x1b[2J\n# <script>|`a`"  # names of graphs and chains have at most 47 bytes
CONTROL = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]")
SCRIPT, MARKUP = re.compile("<script"), re.compile(r"<script|(?<!\\)\]\(http|^# heading", re.MULTILINE)


# The scripts of an interactive page: its data, and the bundle.
BUNDLE = Path(__file__).parents[1] / "hotpath_report" / "web" / "page.js"
OWN_SCRIPTS = re.compile(
    r'<script type="application/octet-stream" id="hotpath-data">[A-Za-z0-9+/=]*</script>\n<script>\n'
    + re.escape(BUNDLE.read_text(encoding="ascii").strip())
    + "\n</script>"
)


class HostileNames(CommandTest):
    def printed(self, *arguments: object, codes: Iterable[int]) -> tuple[int, str, str]:
        """(exit code, standard output, standard error) of a command; checks that nothing controls a
        terminal."""
        code, out, err = self.command(*arguments, errors="replace")
        self.assertIn(code, codes, err)
        for text in (out, err):
            self.assertIsNone(CONTROL.search(text), repr(text))
        self.assertNotIn("Traceback", err)
        return code, out, err

    def check_pages(self, folder: Path) -> int:
        """Checks all pages below a folder and returns their number."""
        pages = [f for f in folder.rglob("*") if f.suffix in (".md", ".html", ".svg", ".xml")]
        for page in pages:
            with self.subTest(page=page.name):
                text = OWN_SCRIPTS.sub("", page.read_text(encoding="utf-8"))
                self.assertIsNone(CONTROL.search(text))
                if page.suffix == ".md":  # a fenced code block contains no markup
                    text = re.sub(r"^```\n.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
                self.assertEqual((MARKUP if page.suffix == ".md" else SCRIPT).findall(text), [])
                if page.suffix in (".svg", ".xml"):
                    ElementTree.fromstring(text)
        return len(pages)

    def test_options_and_names_of_files(self) -> None:
        for words in (
            (NAME,), ("graph", NAME), ("simulate", "--graph", NAME), ("simulate", "--executors", NAME),
            ("simulate", "--deployments", NAME), ("simulate", "--phases-file", NAME), ("simulate", "--load", NAME),
            ("simulate", "--entity-order", NAME), (f"--{NAME}",), ("check", NAME), ("summarize", NAME), ("sweep", NAME),
            ("summarize", "--golden", NAME), ("recover", NAME), ("compare-results", NAME, NAME),
            ("timeline", NAME), ("bench", "--only", NAME), ("validate", NAME),
            ("import", "ctf", NAME), ("export", "ctf", NAME),
            ("advise", NAME), ("advise", "--for", NAME), ("analyze", NAME), ("analyze", "--trace", NAME),
            ("capacity", "--require", NAME), ("capacity", "--executors", NAME), ("timeline", LINES),
            ("explain", NAME), ("explain", LINES, NAME),
        ):  # fmt: skip
            with self.subTest(words=words):
                _, _, err = self.printed(*words, codes=(1, 2))
                self.assertEqual(
                    len([line for line in err.splitlines() if not line.startswith("note: ")]), 1, err
                )

    def test_a_graph(self) -> None:
        nodes = [{"name": "a", "type": "sensor", "period_ms": 100}]
        source = json.dumps({"name": "good", "description": LINES, "nodes": nodes})
        graph = self.folder / "graph.yaml"
        self.environment["HOTPATH_GRAPHS"] = str(self.folder)
        places = [source.replace(word, json.dumps(NAME)) for word in ('"a"', '"sensor"', '"nodes"')]
        for text in (source, source.replace('"good"', json.dumps(SHORT)), *places):
            graph.write_text(text)
            code = 0 if text == source else 2
            for option in ((), ("--dot",)):
                err = self.printed("graph", graph, *option, codes=(code,))[2]
                self.assertEqual("<script>" in err, code != 0)  # an error names what it rejects
            listed = self.printed("list", "graphs", codes=(0,))[1]
            self.assertRegex(listed, "(?m)^graph ")

    def stored_run(self) -> Any:
        """A run whose graph, chain, node and warnings have hostile names."""
        brief = ("--executors", "default,rm-ro", "--duration", 2)
        self.accepted("simulate", "--graph", "sequences", *brief, "--output", "run")
        folder = self.folder / "run"
        for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
            text = (folder / name).read_text()
            for word in ("localization", "LidarDriver"):
                other = (NAME + word).replace("\r", "")
                text = text.replace(word, json.dumps(other)[1:-1] if name.endswith(".json") else other)
            (folder / name).write_text(text)
        facts = json.loads((folder / "run.json").read_text())
        facts["graph"]["name"], facts["warnings"], facts["version"] = LINES, [LINES], NAME
        facts["phases"] = LINES
        (folder / "run.json").write_text(json.dumps(facts))
        return folder

    def test_a_stored_run(self) -> None:
        run = self.stored_run()
        self.assertIn("script", self.printed("summarize", run, codes=(0,))[1])
        self.printed("check", run, codes=(0,))
        self.assertIn("its tasks are not", self.printed("explain", run, codes=(2,))[2])
        self.assertIn("has no task", self.printed("validate", run, "--output", "v", codes=(2,))[2])
        self.assertIsNone(CONTROL.search(package.call(self.folder, self.environment, "report", run).stdout))
        brief = ("--from", 1000, "--to", 1100)
        self.printed("timeline", run, *brief, "--svg", "chart.svg", "--perfetto", "chart.json", codes=(0,))
        gate = ("--junit", "gate.xml", "--markdown", "gate.md", "--page", "gate")
        self.printed("compare-results", run, run, "--gate", *gate, codes=(0,))
        compared = package.call(self.folder, self.environment, "compare-results", run, run)
        self.assertIsNone(CONTROL.search(compared.stdout + compared.stderr))
        self.assertEqual(compared.returncode, 0, compared.stderr)
        self.assertGreater(self.check_pages(self.folder), 5)

    def test_a_trace(self) -> None:
        trace, _ = sensor_and_filter()
        for _, _, _, _, fields in trace.events:
            for key, value in fields.items():
                if value in ("sensor", "/points"):
                    fields[key] = value + LINES
        folder = trace.write(self.folder / NAME.replace("/", ""))
        _, out, _ = self.printed("import", "ctf", folder, "--output", "imported", codes=(0,))
        self.assertIn("Reproduction:", out)
        self.printed("graph", "imported/graph.yaml", codes=(0,))
        task = json.loads((self.folder / "imported" / "run" / "run.json").read_text())["tasks"][0]["task"]
        self.assertIn(
            "finished", self.printed("explain", "imported/run", "--task", task, "--worst", codes=(0,))[1]
        )
        del self.environment["HOTPATH_FIGURES"]
        shutil.rmtree(self.folder / "imported")
        self.printed("import", "ctf", folder, "--output", "imported", codes=(0,))
        self.assertEqual(self.check_pages(self.folder / "imported"), 1)

    def test_a_page_of_capacities(self) -> None:
        (self.folder / "x<script>.csv").write_text("task,first_release_ms\nnobody,0\n")
        words = ("--graph", "sequences", "--executors", "rm-ro", "--from", 20, "--to", 20, "--duration", 1)
        self.printed("capacity", *words, "--require", "no-loss", "--output", "capacity", codes=(0,))
        self.assertEqual(self.check_pages(self.folder / "capacity"), 1)
