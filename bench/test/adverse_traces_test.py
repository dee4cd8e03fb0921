# SPDX-License-Identifier: Apache-2.0
"""`hotpath import ctf` of traces with faults, and of traces with random changes (HOTPATH_MUTATIONS sets
their number). Each fault gives one warning, and the import uses the rest, or one sentence and exit code 2.
With HOTPATH_PUBLISH=1, the counts are published as results/reliability/mutations.json."""

import json
import os
import random
import shutil
from pathlib import Path
from typing import Any

import pytest

from adverse_use_test import WRONG_USE, assert_rejected
from analyze_case import COMMAND, graph_text
from ctf_trace import MS, CtfTrace, run_on, sensor_and_filter
from evidence import publish_on_request
from hotpath_command import CommandTest, RunFolder
from import_case import ImportTest

HOUR = 3_600_000 * MS
FAULTS: list[Any] = []


def fault(words: str, jobs: int, trace: Any = sensor_and_filter) -> Any:
    """Registers a change of a trace, with words of the warning and the number of jobs that are used; -1:
    the trace is rejected with these words."""
    return lambda change: FAULTS.append(pytest.param(trace, change, words, jobs, id=change.__name__))


def without_periods() -> Any:
    return sensor_and_filter(0)


@fault("discarded at least 17 events", 400)
def discarded_events(trace: Any, _: Any) -> None:
    trace.discarded = 17


@fault("no initialisation events", -1, lambda: sensor_and_filter(initialised=False))
def no_initialisation(_trace: Any, _handles: Any) -> None:
    pass


# After the last event, the clock moves on by so many milliseconds before the trace goes on.
for name, moved, words_of_it, used in (
    ("jump", 60_000, "no event for 60.0 s from 2.0 s on", 600),
    ("gap of more than ten periods", 1200, "no event for 1.2 s", 600),
    ("gap of nine periods", 900, "", 600),
    ("jump by a year", 365 * 24 * HOUR // MS, "the trace's clock jumps, or the trace is damaged", -1),
    ("jump back", -1000, "breaks off: its clock jumps back after 2.0 s", 400),
):
    FAULTS.append(
        pytest.param(
            sensor_and_filter,
            lambda trace, handles, moved=moved: run_on(trace, handles, handles["at"] + moved * MS, 100),
            words_of_it,
            used,
            id=name,
        )
    )


@fault("1 jobs have no end in the trace", 401)
def a_callback_that_never_ends(trace: Any, handles: Any) -> None:
    trace.job(handles["at"], None, handles["timer"])


@fault("another node sensor; node /sensor is called sensor_2", 300, without_periods)
def two_nodes_of_one_name(trace: Any, handles: Any) -> None:
    second = trace.timer(3 * MS, trace.node(3 * MS, "sensor"), 10 * MS)
    for i in range(100):
        at = handles["at"] + 10 * i * MS
        run_on(trace, handles, at, 1)
        trace.job(at + 6 * MS, at + 7 * MS, second)


@fault("1 addresses of callbacks were reused", 300, lambda: sensor_and_filter(100))
def handles_used_again(trace: Any, handles: Any) -> None:
    at = handles["at"]
    timer = trace.timer(at, trace.node(at, "next"), 10 * MS, callback=handles["timer"])
    for i in range(1, 101):
        trace.job(at + 10 * i * MS, at + (10 * i + 1) * MS, timer)


@fault("No callback of the trace publishes topic /outer", 300, without_periods)
def a_topic_without_publisher(trace: Any, handles: Any) -> None:
    outer = trace.subscription(3 * MS, handles["nodes"][1], "/outer")
    for i in range(100):
        at = handles["at"] + 10 * i * MS
        run_on(trace, handles, at, 1)
        trace.job(at + 6 * MS, at + 7 * MS, outer[1], takes=(outer[0], at + 5 * MS))


@fault("Nobody published /silent", 400)
def a_topic_on_which_nobody_publishes(trace: Any, handles: Any) -> None:
    trace.subscription(3 * MS, handles["nodes"][1], "/silent")
    trace.events.sort(key=lambda event: event[0])


def imported(shell: CommandTest, folder: Path, *options: object) -> tuple[Any, Path]:
    """(content of import.json, output folder) of an import that must succeed."""
    output = folder.with_name(f"{folder.name}_imported")
    shell.accepted("import", "ctf", folder, "--output", output, *options)
    return json.loads((output / "import.json").read_text()), output


def assert_refused(shell: CommandTest, says: str, folder: Path, *options: object) -> None:
    assert_rejected(shell, ["import", "ctf", folder, "--output", "refused", *options], says)


@pytest.mark.parametrize("trace, change, words, jobs", FAULTS)
def test_a_fault(shell: CommandTest, trace: Any, change: Any, words: str, jobs: int) -> None:
    made, handles = trace()
    change(made, handles)
    folder = made.write(shell.folder / "trace")
    if jobs < 0:
        assert_refused(shell, words, folder)
        return
    facts, _ = imported(shell, folder)
    assert facts["jobs"] == jobs
    assert any(words in w for w in facts["warnings"]) if words else facts["warnings"] == [], facts["warnings"]


@pytest.mark.parametrize("file, old, new, words, options", [
    ("metadata", b"freq =", b"frequency_hz =", "libbabeltrace2 does not survive it", ()),
    ("stream_0", b"filter\0", b"fil\xffer\0", "a name in `ros2:rcl_node_init` is not valid UTF-8", ()),
    ("stream_0", b"late\0", b"l\xffte\0", "not valid UTF-8", ("--jobs", 100)),  # after the first jobs
])  # fmt: skip
def test_changed_bytes(
    shell: CommandTest, file: str, old: bytes, new: bytes, words: str, options: Any
) -> None:
    trace, handles = sensor_and_filter()
    trace.node(handles["at"], "late")
    folder = trace.write(shell.folder / "trace")
    (folder / file).write_bytes((folder / file).read_bytes().replace(old, new))
    assert_refused(shell, words, folder, *options)


@pytest.mark.parametrize("name, usable", [("autoware_static", True), ("timers_only_default", False)])
def test_a_stream_that_ends_within_a_packet(shell: CommandTest, name: str, usable: bool) -> None:
    trace = ImportTest.unpacked(shell, name)  # type: ignore[arg-type]
    whole, _ = imported(shell, trace)
    stream = max(trace.rglob("ros2_*"), key=lambda f: f.stat().st_size)
    stream.write_bytes(stream.read_bytes()[:-100])
    temporary = shell.folder / "tmp"
    temporary.mkdir()
    shell.environment["TMPDIR"] = str(temporary)
    trace = trace.rename(shell.folder / "cut")
    if usable:
        cut, _ = imported(shell, trace)
        assert [w for w in cut["warnings"] if f"within a packet of {stream.name}" in w]
        assert 0 < cut["jobs"] < whole["jobs"]
    else:
        assert_refused(shell, f"breaks off (within a packet of {stream.name}", trace)
    assert list(temporary.iterdir()) == []


def test_an_executor_that_none_fits(shell: CommandTest) -> None:
    trace, numbers = CtfTrace(), random.Random(1)
    node = trace.node(0, "sensor")
    timers = [trace.timer(MS, node, 20 * MS) for _ in range(6)]
    for period in range(1, 200):
        at = (1 + 20 * period) * MS
        for timer in numbers.sample(timers, len(timers)):
            trace.job(at, at + MS, timer)
            at += MS
    facts, _ = imported(shell, trace.write(shell.folder / "trace"))
    (executor,) = facts["executors"]
    assert executor["recognition"]["verdict"] == "none fits"
    assert executor["recognition"]["executors"] == []
    assert facts["self_check"]["light"] != "green"


def test_a_chain_without_outputs_is_not_green(shell: CommandTest) -> None:
    source, sink = "{name: Source, type: sensor, period_ms: 100}", COMMAND.format("Sink", "Source", 5000)
    (shell.folder / "graph.yaml").write_text(graph_text(source, sink))
    brief = ("--graph", "graph.yaml", "--executors", "events-re", "--duration", 0.5, "--warm-up", 0)
    shell.accepted("simulate", *brief, "--output", "run")
    shell.accepted("export", "ctf", "run", "--output", "trace")
    check = imported(shell, shell.folder / "trace", "--chain", "Source:Sink")[0]["self_check"]
    assert check["light"] != "green"
    assert [c["recorded_ms"]["n"] for c in check["chains"]] == [0]
    assert "No output of Sink was recorded" in "".join(check["reasons"])


def test_a_failed_import_keeps_an_empty_folder(shell: CommandTest, stock: Path) -> None:
    (shell.folder / "old").mkdir()
    asked = ("import", "ctf", stock / "ctf" / "rm-ro-0", "--deployments", stock / "nobody.yaml")
    assert shell.command(*asked, "--output", "old")[0] == WRONG_USE
    assert list((shell.folder / "old").iterdir()) == []


def test_jobs_after_the_first_ones(shell: CommandTest) -> None:
    trace, _ = sensor_and_filter()
    facts, output = imported(shell, trace.write(shell.folder / "trace"), "--jobs", 100)
    assert (facts["window_jobs"], facts["jobs"]) == (100, 400)
    (jobs,) = RunFolder(output / "run").jobs().values()
    assert [job.outcome for job in jobs].count("ran") == 100


def test_any_bytes(shell: CommandTest) -> None:
    whole = sensor_and_filter(20)[0].write(shell.folder / "whole")
    numbers = random.Random(1)
    count = int(os.environ.get("HOTPATH_MUTATIONS", "40"))
    read = library_ended = 0
    for _ in range(count):
        trace = Path(shutil.copytree(whole, shell.folder / "trace", dirs_exist_ok=True))
        file = numbers.choice(sorted(f for f in trace.iterdir() if f.is_file()))
        content = bytearray(file.read_bytes())
        for _ in range(numbers.choice((1, 1, 4))):
            at, size = numbers.randrange(len(content)), numbers.choice((1, 1, 4, 8))
            content[at : at + size] = numbers.choice(
                (numbers.randbytes(size), b"\xff" * size, bytes(size), b"")
            )
        file.write_bytes(content)
        code, _, err = shell.command("import", "ctf", trace, "--output", "imported")
        assert code in (0, WRONG_USE), err
        if code == WRONG_USE:  # a failed assertion of libbabeltrace2 may precede the sentence
            assert [line[:9] for line in err.strip().splitlines() if "Assertion" not in line] == [
                "hotpath: "
            ], err
        shutil.rmtree(shell.folder / "imported", ignore_errors=True)
        read += code == 0
        library_ended += "libbabeltrace2 does not survive it" in err
    assert count < 40 or 0 < read < count, f"{read} of {count} were read"
    publish_on_request(
        "reliability/mutations.json", {"tried": count, "read": read, "library_ended": library_ended}
    )
