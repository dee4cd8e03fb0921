# SPDX-License-Identifier: Apache-2.0
"""Options, calls of `hotpath`, and publication of the tools that measure evidence for results/."""

import argparse
import contextlib
import functools
import json
import os
import platform
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from hotpath_report import hotpath_command
from hotpath_report.errors import InputError, RunError
from hotpath_report.files import make_folder, write_json

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "results"


def parser(description: str | None, file: str = "") -> argparse.ArgumentParser:
    """A parser for the first line of a description; with --publish for a tool with results/FILE."""
    made = argparse.ArgumentParser(description=(description or "").split("\n", maxsplit=1)[0])
    if file:
        made.add_argument("--publish", action="store_true", help=f"write the figures to results/{file}")
    return made


def hotpath(*words: object) -> str:
    """Standard output of `hotpath WORDS...`. A failure ends the tool."""
    try:
        return hotpath_command.output_of(*words)
    except (InputError, RunError) as error:
        sys.exit(f"{Path(sys.argv[0]).name}: hotpath {words[0]}: {error}")


def read(file: str | Path) -> Any:
    """The content of results/FILE; an empty object without the file."""
    path = RESULTS / file
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


@functools.cache
def revision() -> str:
    """The Git commit, with `-dirty` if files outside of results/ changed; empty without Git."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(ROOT), *words]
        return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()

    with contextlib.suppress(FileNotFoundError):
        changes = git("status", "--short", "-uno", ":!results")
        return git("rev-parse", "--short=12", "HEAD") + ("-dirty" if changes else "")
    return ""


def provenance() -> dict[str, Any]:
    """Machine, date, revision and command of this process."""
    model = re.search(r"model name\s*: (.+)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    machine = {"cpu_model": model[1] if model else "", "kernel": f"{platform.release()} {platform.machine()}"}
    settings = [f"{k}={v}" for k, v in os.environ.items() if k.startswith("HOTPATH_") and v.isdigit()]
    program = Path(sys.argv[0]).resolve()
    name = program.parent.name if program.stem == "__main__" else program.name  # `python3 -m pytest`
    tool = str(program.relative_to(ROOT)) if program.is_relative_to(ROOT) else name
    words = [tool, *(word.replace(f"{ROOT}/", "") for word in sys.argv[1:])]
    return {
        "machine": machine,
        "date": time.strftime("%Y-%m-%d"),
        "revision": revision(),
        "command": shlex.join([*sorted(settings), *words]),
    }


def publish(file: str | Path, facts: dict[str, Any], record: str = "") -> None:
    """Replaces results/FILE, or only one record of it, by the facts and their provenance.

    Facts win over the provenance of this process: a run may name another machine or date.
    """
    facts = provenance() | facts
    make_folder((RESULTS / file).parent)
    write_json(RESULTS / file, read(file) | {record: facts} if record else facts)


def publish_on_request(file: str, facts: dict[str, Any], record: str = "") -> None:
    """publish() for tests whose counts are evidence, if HOTPATH_PUBLISH is set."""
    if os.environ.get("HOTPATH_PUBLISH"):
        publish(file, facts, record)
