# SPDX-License-Identifier: Apache-2.0
"""`hotpath import ctf` of traces with faults, and of traces with random changes (HOTPATH_MUTATIONS sets
their number). Each fault gives one warning, and the import uses the rest, or one sentence and exit code 2.
With HOTPATH_PUBLISH=1, the counts are published as results/reliability/mutations.json."""

import os
import random
import shutil
from pathlib import Path
from typing import Any

import pytest

from analyze_case import COMMAND, graph_text
from ctf_trace import MS, CtfTrace, run_on, sensor_and_filter
from evidence import publish_on_request
from hotpath_command import CommandTest, RunFolder, assert_says
from import_case import ImportTest


def later(by_ms: int) -> Any:
    """The clock moves on by so many milliseconds before the trace goes on."""
    return lambda trace, handles: run_on(trace, handles, handles["at"] + by_ms * MS, 100)


def also(trace: Any, handles: Any, callback: Any, rmw: Any = None) -> None:
    """Runs a further callback after each period of the system."""
    for i in range(100):
        at = handles["at"] + 10 * i * MS
        run_on(trace, handles, at, 1)
        trace.job(at + 6 * MS, at + 7 * MS, callback, takes=rmw and (rmw, at + 5 * MS))


def two_nodes_of_one_name(trace: Any, handles: Any) -> None:
    also(trace, handles, trace.timer(3 * MS, trace.node(3 * MS, "sensor"), 10 * MS))


def topic_without_publisher(trace: Any, handles: Any) -> None:
    rmw, callback = trace.subscription(3 * MS, handles["nodes"][1], "/outer")
    also(trace, handles, callback, rmw)


def handle_used_again(trace: Any, handles: Any) -> None:
    at = handles["at"]
    timer = trace.timer(at, trace.node(at, "next"), 10 * MS, callback=handles["timer"])
    for i in range(1, 101):
        trace.job(at + 10 * i * MS, at + (10 * i + 1) * MS, timer)


# A change of a trace, options of the trace, words of the warning ("": none), and the number of jobs that
# are used; -1: the trace is rejected with these words.
FAULTS: list[tuple[Any, dict[str, Any], str, int]] = [
    (lambda trace, _: setattr(trace, "discarded", 17), {}, "discarded at least 17 events", 400),
    (later(10), {"initialised": False}, "no initialisation events", -1),
    (later(60_000), {}, "no event for 60.0 s from 2.0 s on", 600),
    (later(1200), {}, "no event for 1.2 s", 600),
    (later(900), {}, "static or static-jazzy", 600),  # less than ten periods
    (later(31_536_000_000), {}, "the trace's clock jumps, or the trace is damaged", -1),
    (later(-1000), {}, "breaks off: its clock jumps back after 2.0 s", 400),
    (lambda trace, h: trace.job(h["at"], None, h["timer"]), {}, "1 jobs have no end in the trace", 401),
    (two_nodes_of_one_name, {"periods": 0}, "another node sensor; node /sensor is called sensor_2", 300),
    (handle_used_again, {"periods": 100}, "1 addresses of callbacks were reused", 300),
    (topic_without_publisher, {"periods": 0}, "No callback of the trace publishes topic /outer", 300),
]


def imported(shell: CommandTest, trace: Path, *options: str) -> Any:
    """Content of import.json of an import that must succeed, into the folder `TRACE_imported`."""
    return ImportTest.imported(shell, trace, *options)[0]  # type: ignore[arg-type]


@pytest.mark.parametrize("change, options, words, jobs", FAULTS)
def test_a_fault(shell: CommandTest, change: Any, options: Any, words: str, jobs: int) -> None:
    trace, handles = sensor_and_filter(**options)
    change(trace, handles)
    folder = trace.write(shell.folder / "trace")
    if jobs < 0:
        shell.refused("import ctf trace --output refused", says=words)
        return
    facts = imported(shell, folder)
    assert facts["jobs"] == jobs
    assert any(words in w for w in facts["warnings"]) if words else facts["warnings"] == [], facts["warnings"]


@pytest.mark.parametrize("file, old, new, words, options", [
    ("metadata", b"freq =", b"frequency_hz =", "libbabeltrace2 does not survive it", ""),
    ("stream_0", b"filter\0", b"fil\xffer\0", "a name in `ros2:rcl_node_init` is not valid UTF-8", ""),
    ("stream_0", b"late\0", b"l\xffte\0", "not valid UTF-8", "--jobs 100"),  # after the first jobs
])  # fmt: skip
def test_changed_bytes(
    shell: CommandTest, file: str, old: bytes, new: bytes, words: str, options: str
) -> None:
    trace, handles = sensor_and_filter()
    trace.node(handles["at"], "late")
    changed = trace.write(shell.folder / "trace") / file
    changed.write_bytes(changed.read_bytes().replace(old, new))
    shell.refused(f"import ctf trace --output refused {options}", says=words)


@pytest.mark.parametrize("name, usable", [("autoware_static", True), ("timers_only_default", False)])
def test_a_stream_that_ends_within_a_packet(shell: CommandTest, name: str, usable: bool) -> None:
    trace = ImportTest.unpacked(shell, name)  # type: ignore[arg-type]
    whole = imported(shell, trace)
    stream = max(trace.rglob("ros2_*"), key=lambda f: f.stat().st_size)
    stream.write_bytes(stream.read_bytes()[:-100])
    temporary = shell.folder / "tmp"
    temporary.mkdir()
    shell.environment["TMPDIR"] = str(temporary)
    trace = trace.rename(shell.folder / "cut")
    if usable:
        cut = imported(shell, trace)
        assert [w for w in cut["warnings"] if f"within a packet of {stream.name}" in w]
        assert 0 < cut["jobs"] < whole["jobs"]
    else:
        says = f"breaks off (within a packet of {stream.name}"
        shell.refused("import ctf cut --output refused", says=says)
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
    facts = imported(shell, trace.write(shell.folder / "trace"))
    (executor,) = facts["executors"]
    assert executor["recognition"]["verdict"] == "none fits"
    assert executor["recognition"]["executors"] == []
    assert facts["self_check"]["light"] != "green"


def test_a_chain_without_outputs_is_not_green(shell: CommandTest) -> None:
    source, sink = "{name: Source, type: sensor, period_ms: 100}", COMMAND.format("Sink", "Source", 5000)
    (shell.folder / "graph.yaml").write_text(graph_text(source, sink))
    shell.accepted(
        "simulate --graph graph.yaml --executors events-re --duration 0.5 --warm-up 0 --output run"
    )
    shell.accepted("export ctf run --output trace")
    check = imported(shell, shell.folder / "trace", "--chain", "Source:Sink")["self_check"]
    assert check["light"] != "green"
    assert [c["recorded_ms"]["n"] for c in check["chains"]] == [0]
    assert "No output of Sink was recorded" in "".join(check["reasons"])


def test_a_failed_import_keeps_an_empty_folder(shell: CommandTest) -> None:
    (shell.folder / "old").mkdir()
    line = "import ctf {stock}/ctf/rm-ro-0 --deployments {stock}/nobody.yaml --output old"
    shell.refused(line, says="has no node Nobody")


def test_jobs_after_the_first_ones(shell: CommandTest) -> None:
    trace, _ = sensor_and_filter()
    facts = imported(shell, trace.write(shell.folder / "trace"), "--jobs", "100")
    assert (facts["window_jobs"], facts["jobs"]) == (100, 400)
    (jobs,) = RunFolder(shell.folder / "trace_imported" / "run").jobs().values()
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
        code, _, err = shell.command("import ctf trace --output imported")
        assert code in (0, 2), err
        if code == 2:  # a failed assertion of libbabeltrace2 may precede the sentence
            (line,) = [line for line in err.strip().splitlines() if "Assertion" not in line]
            assert_says(line)
        shutil.rmtree(shell.folder / "imported", ignore_errors=True)
        read += code == 0
        library_ended += "libbabeltrace2 does not survive it" in err
    assert count < 40 or 0 < read < count, f"{read} of {count} were read"
    facts = {"tried": count, "read": read, "library_ended": library_ended}
    publish_on_request("reliability/mutations.json", facts)
