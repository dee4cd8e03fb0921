#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the instants that `hotpath watch` and LTTng record of the same run.

    tools/watch_instants.py --hotpath build/bench/hotpath --seconds 12 -- COMMAND...
    tools/watch_instants.py --own-clock -- faulty_program single clock 2000

`--own-clock` runs COMMAND without the watcher; it prints the clock that it read after each
tracepoint: the smallest difference that a recorder behind LTTng can have. Needs a sourced ROS 2 with
LTTng. The command should run longer than --seconds.
"""

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "ros2/hotpath_rclcpp/test"))
import lttng_session  # noqa: E402

EVENTS = ("callback_start", "callback_end", "rcl_publish", "rmw_publish", "rmw_take")
NEAR_NS = 2000

Instants = dict[str, list[tuple[str, int]]]  # by thread: names and instants


def by_thread(folder: Path) -> Instants:
    """The recorded EVENTS of a trace."""
    threads: Instants = {}
    for event in lttng_session.read(folder):
        name = event.name.removeprefix("ros2:")
        if name in EVENTS:
            threads.setdefault(event.thread, []).append((name, event.at_ns))
    return threads


def watch(hotpath: str, seconds: float, command: list[str], folder: Path) -> Path:
    """Runs the command under the watcher; returns the snapshot of all that it recorded."""
    words = [hotpath, "watch", "--once", "--record", str(folder), "--keep", str(seconds + 60), "--", *command]
    watcher = subprocess.Popen(words, stdout=subprocess.DEVNULL)
    time.sleep(seconds)
    watcher.send_signal(signal.SIGUSR1)
    while watcher.poll() is None and not (folder / "snapshot_1").exists():
        time.sleep(0.1)
    watcher.send_signal(signal.SIGINT)
    watcher.wait()
    return folder / "snapshot_1"


def differences(of_lttng: Instants, seen: Instants) -> list[int]:
    """Recorded instants minus LTTng's, which also recorded the end of the program."""
    found = []
    for thread, events in seen.items():
        expected = of_lttng.get(thread, [])[: len(events)]
        if [name for name, _ in events] != [name for name, _ in expected]:
            sys.exit(f"watch_instants.py: thread {thread} has other events than LTTng recorded")
        found += [at - other for (_, at), (_, other) in zip(events, expected)]
    return found


def main() -> None:
    """Prints one line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--hotpath", default="hotpath", help="the command (default: along PATH)")
    parser.add_argument("--seconds", type=float, default=10, help="length of the recording (default: 10)")
    parser.add_argument("--own-clock", action="store_true", help="without the watcher")
    parser.add_argument("command", nargs="+", help="program and arguments, after --")
    options = parser.parse_args()
    if missing := lttng_session.missing_programs():
        sys.exit(f"watch_instants.py: {missing} not found; install lttng-tools and babeltrace2")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "x"
        folder.mkdir()
        with lttng_session.recording(folder / "lttng", *(f"ros2:{event}" for event in EVENTS)):
            if options.own_clock:
                text = subprocess.run(options.command, check=True, capture_output=True, text=True).stdout
            else:
                snapshot = watch(options.hotpath, options.seconds, options.command, folder / "watch")
        of_lttng = by_thread(folder / "lttng")
        if options.own_clock:
            instants = [int(word) for word in text.split()]
            seen = {  # LTTng records all programs
                thread: [(name, at) for (name, _), at in zip(events, instants)]
                for thread, events in of_lttng.items()
                if len(events) == len(instants)
            }
        else:
            seen = by_thread(snapshot)
    found = sorted(differences(of_lttng, seen), key=abs)
    if not found:
        sys.exit("watch_instants.py: nothing was recorded; does the command call tracepoints?")
    near = sum(abs(difference) <= NEAR_NS for difference in found)
    at = {share: found[min(len(found) - 1, int(len(found) * share))] for share in (0.5, 0.99, 0.999)}
    print(
        f"{len(found)} instants, {100 * near / len(found):.3f} % within {NEAR_NS / 1000:g} us, recorded minus LTTng's: "
        f"median {at[0.5]} ns, p99 {at[0.99]} ns, p99.9 {at[0.999]} ns, most {found[-1]} ns"
    )


if __name__ == "__main__":
    main()
