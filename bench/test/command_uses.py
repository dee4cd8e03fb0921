# SPDX-License-Identifier: Apache-2.0
"""One real use of each hotpath command, for tests that cover every command.

The uses must run in this order in one folder: later uses read the files of earlier ones.
"""

import json
import re
import shutil
from pathlib import Path
from typing import Any

SWEEP = """command: simulate
fixed: {graph: autoware, duration: 1, warm-up: 0}
axes:
  load: [40, 80]
"""
LIVE = ("--transport", "intra_process", "--load", 1, "--duration", 0.2, "--warm-up", 0)
# By command: its arguments, and a file that it writes or, after `>`, a text that it prints; None:
# neither.
USES = {
    "simulate": (("--executors", "default,rm-ro", "--duration", 1, "--warm-up", 0, "--output", "stored"),
                 "stored/summary.json"),
    "timeline": (("stored", "--perfetto", "trace.json"), "trace.json"),
    "explain": (("stored", "--executor", "default,rm-ro"), ">is faster than"),
    "check": (("stored",), ">one job per thread at a time"),
    "summarize": (("stored", "--responses", "responses.csv"), "responses.csv"),
    "recover": (("killed",), "killed/summary.json"),
    "report": (("stored", "--output", "page"), "page/report.html"),
    "diff": (("stored", "stored", "--gate", "--markdown", "gate.md"), "gate.md"),
    "validate": (("stored", "--output", "validation"), "validation/validation.json"),
    "export": (("ctf", "stored", "--output", "exported"), "exported/default-0/metadata"),
    "import": (("ctf", "exported/default-0", "--output", "imported"), "imported/graph.yaml"),
    "advise": (("autoware", "--repetitions", 1, "--duration", 1, "--output", "advice"), "advice/advice.json"),
    "analyze": (("timers_only_60", "--csv", "bounds.csv"), "bounds.csv"),
    "sweep": (("sweep.yaml", "--output", "swept"), "swept/table.csv"),
    "capacity": (("--executors", "rm-ro", "--duration", 1, "--coarse", 2, "--resolution", 20, "--output", "levels"),
                 "levels/levels.csv"),
    "experiment": (("waters", "--sets", 2, "--utilisations", 0.5, "--output", "waters"), "waters/waters.csv"),
    "graph": (("autoware",), ">chain hot_path:"),
    "list": (("executors",), ">rm-ro"),
    "machine": (("--duration", 0.01, "--output", "machine.json"), "machine.json"),
    "run": ((*LIVE, "--output", "live"), "live/summary.json"),
    "compare": ((*LIVE, "--executors", "default,rm-ro", "--output", "compared"), "compared/summary.json"),
    "watch": (("--once", "--", "true"), ">0 events"),
    "completion": (("bash",), ">complete"),
    "replay": (("live", "--live", "--duration", 0.1), None),
}  # fmt: skip
# Commands that print no table, and reject --json.
NO_TABLES = {"timeline", "check", "export", "import", "sweep", "graph", "completion", "replay"}
# The arguments with which a command prints JSON, where they are not those above and --json.
PRINTS_JSON: dict[str, tuple[object, ...]] = {
    "report": ("stored", "--json"),
    "watch": ("--once", "--json", "--", "true"),
}
# `bench` measures for minutes with programs next to the command: see bench_command_test.py.
ELSEWHERE = {"bench"}


def commands_of(help_text: str) -> set[Any]:
    """The names of the commands that `hotpath --help` lists."""
    return set(re.findall(r"^  ([a-z][a-z-]+)  ", help_text.partition("Subcommands:")[2], re.MULTILINE))


def prepare(name: str, folder: Path) -> None:
    """Makes the inputs of a use that no other command writes."""
    folder = Path(folder)
    if name == "sweep":
        (folder / "sweep.yaml").write_text(SWEEP)
    if name == "recover":
        killed = folder / "killed"
        shutil.copytree(folder / "stored", killed)
        (killed / "summary.json").unlink()
        for file in ("jobs.csv", "chains.csv"):
            (killed / file).rename(killed / f"{file}.part")
        run = json.loads((killed / "run.json").read_text())
        (killed / "run.json").write_text(json.dumps({**run, "complete": False}))
