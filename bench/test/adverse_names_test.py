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
from adverse_tables import rows
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


def printed(shell: CommandTest, *words: object, codes: Any = (0,)) -> tuple[str, str]:
    """Standard output and error of a command that ends with one of these codes; nothing controls a
    terminal."""
    code, out, err = shell.command(*words, errors="replace")
    assert code in codes, err
    assert not CONTROL.search(out + err) and "Traceback" not in err
    return out, err


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
    words = [word.replace("NAME", NAME).replace("LINES", LINES) for word in line.split()]
    _, err = printed(shell, *words, codes=(1, 2))
    assert len([line for line in err.splitlines() if not line.startswith("note: ")]) == 1, err


def test_hostile_names_in_a_graph(shell: CommandTest) -> None:
    nodes = [{"name": "a", "type": "sensor", "period_ms": 100}]
    source = json.dumps({"name": "good", "description": LINES, "nodes": nodes})
    shell.environment["HOTPATH_GRAPHS"] = str(shell.folder)
    wrong = [source.replace(word, json.dumps(NAME)) for word in ('"a"', '"sensor"', '"nodes"')]
    for text in (source, source.replace('"good"', json.dumps(SHORT)), *wrong):
        (shell.folder / "graph.yaml").write_text(text)
        for line in ("graph graph.yaml", "graph graph.yaml --as dot"):
            _, err = printed(shell, line, codes=(0 if text == source else 2,))
            assert ("<script>" in err) == (text != source), "an error names what it rejects"
        assert "\ngraph " in printed(shell, "list graphs")[0]


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
        assert part in "".join(printed(shell, line, codes=(int(code),)))
    done = package.call(shell.folder, shell.environment, "report", run)
    assert not CONTROL.search(done.stdout + done.stderr)
    assert check_pages(shell.folder) > 5


def test_hostile_names_in_a_trace(shell: CommandTest) -> None:
    trace, _ = sensor_and_filter()
    for *_, fields in trace.events:
        for key, value in fields.items():
            if value in ("sensor", "/points"):
                fields[key] = value + LINES
    folder = trace.write(shell.folder / NAME.replace("/", ""))
    shell.environment["HOTPATH_FIGURES"] = "all"
    assert "Reproduction:" in printed(shell, "import", "ctf", folder, "--output", "imported")[0]
    assert check_pages(shell.folder / "imported") == 1
    printed(shell, "graph imported/graph.yaml")
    task = json.loads((shell.folder / "imported" / "run" / "run.json").read_text())["tasks"][0]["task"]
    assert "finished" in printed(shell, "explain", "--worst", "imported/run", "--task", task)[0]


# Nothing is executed from the current folder, or from paths in Python's environment variables. The
# test fills the folder with traps: every module that a report imports, the package itself, the modules
# that Python imports at start-up, the program's own libraries, a matplotlibrc. Each would leave a mark.


def test_nothing_is_executed_from_the_current_folder(shell: CommandTest, stock: Path) -> None:
    mark, traps = shell.folder / "executed", shell.folder / "traps"
    asked = f"/usr/bin/python3 -X importtime -I -B {BENCH} report {stock}/run --output {shell.folder}/report"
    environment = shell.environment | {"HOTPATH": HOTPATH}
    done = subprocess.run(asked.split(), capture_output=True, text=True, check=True, env=environment)
    names = {*re.findall(r"\| +(\w+)", done.stderr), "sitecustomize", "usercustomize", "start"}
    assert len(names) > 100
    site = shell.folder / "lib" / "python{}.{}".format(*sys.version_info) / "site-packages"
    trapped = [traps / f"{name}.py" for name in names] + [site / "usercustomize.py"]
    for package_name in ("hotpath_report", "matplotlib", "numpy"):
        trapped += [traps / package_name / name for name in ("__init__.py", "__main__.py")]
    for path in trapped:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"import os\nopen({str(mark)!r}, 'a').write(__file__ + chr(10))\nos._exit(9)\n")
    libraries = subprocess.run(["ldd", HOTPATH], capture_output=True, text=True, check=True).stdout
    for library in re.findall(r"^\s+(\S+\.so\S*) =>", libraries, re.MULTILINE):
        (traps / library).write_text("no library")  # the loader would abort the program
    (traps / "matplotlibrc").write_text("no_such_key: 1\n")  # matplotlib would complain
    shell.environment |= dict.fromkeys(("PYTHONPATH", "PYTHONHOME", "MATPLOTLIBRC"), str(traps))
    shell.environment |= {"PYTHONSTARTUP": str(traps / "start.py"), "PYTHONUSERBASE": str(shell.folder)}
    shell.environment["HOTPATH_FIGURES"] = "all"
    shell.folder = traps  # commands start here
    for line in (
        "simulate sequences --duration 2 --executors default,rm-ro --output made",
        "report {stock}/run --output page",
    ):
        exit_code, _, err = shell.command(line)
        assert not mark.exists(), mark.read_text()
        assert (exit_code, err) == (0, ""), line
