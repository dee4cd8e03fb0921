# SPDX-License-Identifier: Apache-2.0
"""Names with control sequences and markup, and folders full of traps."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import adverse_tables as tables
import package
from adverse_tables import rows, words
from adverse_use_test import WRONG_USE
from ctf_trace import sensor_and_filter
from hotpath_command import BENCH, HOTPATH, CommandTest

# Hostile names: the output must neither control a terminal nor contain their markup. They clear the
# screen, ring, overwrite the line, reverse the text; they are a script, a table cell, code, a link, a
# formula.

NAME = "x\x1b[2J\x07\r\u202e\u009b1m<script>alert(1)</script>|`a`](http://b)$y^{$*z*"
LINES = NAME + "\n# heading\n```\n"
SHORT = "x\x1b[2J\n# <script>|`a`"  # names of graphs and chains have at most 47 bytes
CONTROL = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069]")
SCRIPT, MARKUP = re.compile("<script"), re.compile(r"<script|(?<!\\)\]\(http|^# heading", re.MULTILINE)
OWN_SCRIPTS = re.compile(  # of an interactive page: its data, and the bundle
    r'<script type="application/octet-stream" id="hotpath-data">[A-Za-z0-9+/=]*</script>\n<script>\n'
    + re.escape((BENCH / "hotpath_report" / "web" / "page.js").read_text(encoding="ascii").strip())
    + "\n</script>"
)


def printed(shell: CommandTest, *line: object, codes: Any = (0,)) -> tuple[int, str, str]:
    """(exit code, standard output, standard error) of a command; nothing controls a terminal."""
    code, out, err = shell.command(*line, errors="replace")
    assert code in codes, err
    assert not CONTROL.search(out + err) and "Traceback" not in err
    return code, out, err


def check_pages(folder: Path) -> int:
    """Checks all pages below a folder and returns their number."""
    pages = [f for f in folder.rglob("*") if f.suffix in (".md", ".html", ".svg", ".xml")]
    for page in pages:
        text = OWN_SCRIPTS.sub("", page.read_text(encoding="utf-8"))
        assert not CONTROL.search(text), page
        if page.suffix == ".md":  # a fenced code block contains no markup
            text = re.sub(r"^```\n.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
        assert (MARKUP if page.suffix == ".md" else SCRIPT).findall(text) == [], page
        if page.suffix in (".svg", ".xml"):
            ElementTree.fromstring(text)
    return len(pages)


@pytest.mark.parametrize("line", [cell for row in rows(tables.NAMED) for cell in row])
def test_hostile_words(shell: CommandTest, line: str) -> None:
    asked = (word.replace("NAME", NAME).replace("LINES", LINES) for word in line.split())
    _, _, err = printed(shell, *asked, codes=(1, WRONG_USE))
    assert len([line for line in err.splitlines() if not line.startswith("note: ")]) == 1, err


def test_hostile_names_in_a_graph(shell: CommandTest) -> None:
    nodes = [{"name": "a", "type": "sensor", "period_ms": 100}]
    source = json.dumps({"name": "good", "description": LINES, "nodes": nodes})
    graph = shell.folder / "graph.yaml"
    shell.environment["HOTPATH_GRAPHS"] = str(shell.folder)
    wrong = [source.replace(word, json.dumps(NAME)) for word in ('"a"', '"sensor"', '"nodes"')]
    for text in (source, source.replace('"good"', json.dumps(SHORT)), *wrong):
        graph.write_text(text)
        for line in tables.PRINT_GRAPH:
            code, _, err = printed(
                shell, *line.format(graph=graph).split(), codes=(0 if text == source else WRONG_USE,)
            )
            assert ("<script>" in err) == (code != 0)  # an error names what it rejects
        assert "\ngraph " in printed(shell, *tables.LIST_GRAPHS)[1]


def test_hostile_names_in_a_run(shell: CommandTest, stock: Path) -> None:
    run = Path(shutil.copytree(stock / "run", shell.folder / "run"))
    for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
        text = (run / name).read_text()
        for word in ("localization", "LidarDriver"):
            other = (NAME + word).replace("\r", "")
            text = text.replace(word, json.dumps(other)[1:-1] if name.endswith(".json") else other)
        (run / name).write_text(text)
    facts = json.loads((run / "run.json").read_text())
    facts["graph"]["name"], facts["warnings"], facts["version"], facts["phases"] = LINES, [LINES], NAME, LINES
    (run / "run.json").write_text(json.dumps(facts))
    for line, code, part in rows(tables.NAMED_RUN):
        _, out, err = printed(shell, *words(line, stock, run=run), codes=(int(code),))
        assert part in out + err
    for line in tables.NAMED_RUN_OF_THE_PACKAGE:
        done = package.call(shell.folder, shell.environment, *words(line, stock, run=run))
        assert not CONTROL.search(done.stdout + done.stderr)
    assert check_pages(shell.folder) > 5


def test_hostile_names_in_a_trace(shell: CommandTest) -> None:
    trace, _ = sensor_and_filter()
    for *_, fields in trace.events:
        for key, value in fields.items():
            if value in ("sensor", "/points"):
                fields[key] = value + LINES
    folder = trace.write(shell.folder / NAME.replace("/", ""))
    del shell.environment["HOTPATH_FIGURES"]
    assert "Reproduction:" in printed(shell, *tables.IMPORT, folder, "--output", "imported")[1]
    assert check_pages(shell.folder / "imported") == 1
    printed(shell, *tables.PRINT_GRAPH[0].format(graph="imported/graph.yaml").split())
    task = json.loads((shell.folder / "imported" / "run" / "run.json").read_text())["tasks"][0]["task"]
    assert "finished" in printed(shell, *(tables.EXPLAIN_WORST.split()), "imported/run", "--task", task)[1]


# Nothing is executed from the current folder, or from paths in Python's environment variables. The
# test fills the folder with traps: every module that a report imports, the package itself, the modules
# that Python imports at start-up, the program's own libraries, a matplotlibrc. Each would leave a mark.

IMPORTED = """
import runpy, sys
sys.argv = sys.argv[1:]
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    print(*{name.partition(".")[0] for name in sys.modules}, file=sys.stderr)
"""


def test_nothing_is_executed_from_the_current_folder(shell: CommandTest, stock: Path) -> None:
    run = shutil.copytree(stock / "run", shell.folder / "run")
    mark, traps = shell.folder / "executed", shell.folder / "traps"
    del shell.environment["HOTPATH_FIGURES"]
    environment = shell.environment | {"HOTPATH": HOTPATH}
    asked = ["/usr/bin/python3", "-I", "-B", "-c", IMPORTED, str(BENCH), *words(tables.REPORT, shell.folder)]
    done = subprocess.run(asked, capture_output=True, text=True, check=True, env=environment)
    names = {*done.stderr.split(), "sitecustomize", "usercustomize", "start"}
    assert len(names) > 100
    code = f"import os\nopen({str(mark)!r}, 'a').write(__name__ + ' ' + __file__ + chr(10))\nos._exit(9)\n"
    site = shell.folder / "lib" / "python{}.{}".format(*sys.version_info) / "site-packages"
    trapped = [traps / f"{name}.py" for name in names] + [site / "usercustomize.py"]
    for package_name in ("hotpath_report", "matplotlib", "numpy"):
        trapped += [traps / package_name / name for name in ("__init__.py", "__main__.py")]
    for path in trapped:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(code)
    libraries = subprocess.run(["ldd", HOTPATH], capture_output=True, text=True, check=True).stdout
    for library in re.findall(r"^\s+(\S+\.so\S*) =>", libraries, re.MULTILINE):
        (traps / library).write_text("no library")  # the loader would abort the program
    (traps / "matplotlibrc").write_text("no_such_key: 1\n")  # matplotlib would complain
    shell.environment |= {name: str(traps) for name in ("PYTHONPATH", "PYTHONHOME", "MATPLOTLIBRC")}
    shell.environment |= {"PYTHONSTARTUP": str(traps / "start.py"), "PYTHONUSERBASE": str(shell.folder)}
    shell.folder = traps  # commands start here
    for line, *_ in rows(tables.STARTS_PYTHON):
        exit_code, _, err = shell.command(*words(line, stock, run=run))
        assert not mark.exists(), mark.read_text()
        assert (exit_code, err) == (0, ""), line
