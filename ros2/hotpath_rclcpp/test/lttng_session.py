# SPDX-License-Identifier: Apache-2.0
"""Records programs with LTTng, and reads what was recorded."""

import contextlib
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple


class Event(NamedTuple):
    """One recorded event; texts are without quotes."""

    name: str  # with its provider
    at_ns: int  # CLOCK_MONOTONIC
    thread: str
    fields: dict[str, str]


def missing_programs() -> str:
    """Programs that recording needs and that are not installed; empty if there are none."""
    return " and ".join(program for program in ("lttng", "babeltrace2") if shutil.which(program) is None)


@contextlib.contextmanager
def recording(folder: Path, *events: str) -> Iterator[None]:
    """Records `events` of all programs of this user into `folder`. Starts a session daemon if none
    runs; as a daemon it outlives the test, like any user's."""
    session = f"hotpath-{folder.parent.name}-{folder.name}"

    def lttng(*arguments: str) -> None:
        subprocess.run(["lttng", "--no-sessiond", *arguments], check=True, capture_output=True)

    subprocess.run(["lttng", "create", session, f"--output={folder}"], check=True, capture_output=True)
    try:
        lttng("enable-channel", "-u", "-s", session, "--subbuf-size=1M", "--num-subbuf=8", "all")
        for event in events:
            lttng("enable-event", "-u", "-s", session, "-c", "all", event)
        lttng("add-context", "-u", "-s", session, "-c", "all", "-t", "vtid")
        lttng("start", session)
        yield
        lttng("stop", session)
    finally:
        lttng("destroy", session)


def read(folder: Path) -> list[Event]:
    """The events of a trace, in order."""
    command = ["babeltrace2", "--clock-cycles", str(folder)]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    events = []
    for line in text.splitlines():
        head = re.match(r"\[0*(\d+)\] .*? ((?:hotpath|ros2):\w+): ", line)
        thread = re.search(r"vtid = (\d+)", line)
        assert head and thread, line
        fields = {key: value.strip('"') for key, value in re.findall(r'(\w+) = ("[^"]*"|[^ ,]+)', line)}
        events.append(Event(head[2], int(head[1]), thread[1], fields))
    return events
