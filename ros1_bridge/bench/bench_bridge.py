#!/usr/bin/env -S PYTHONPATH=ros1_bridge/test /usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Starts roscore, the bridge and bench_bridge, and prints a table of latency and loss.

`--json FILE` also stores the rows. Other options go to bench_bridge. The environment variable
HOTPATH_PROGRAMS names the folder of the two programs (default: build/ros1_bridge)."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).resolve().parent
PROGRAMS = Path(os.environ.get("HOTPATH_PROGRAMS", FOLDER.parent.parent / "build" / "ros1_bridge")).resolve()
os.environ.setdefault("HOTPATH_BRIDGE", str(PROGRAMS / "hotpath_ros1_bridge"))

import partners  # noqa: E402

COLUMNS = (
    ("payload", "payload_bytes", "{:.0f}"), ("Hz", "rate_hz", "{:.0f}"), ("sent", "sent", "{}"), ("lost", "lost", "{}"),
    ("received Hz", "received_hz", "{:.1f}"), ("median ms", "median_us", "{:.2f}"), ("p99 ms", "p99_us", "{:.2f}"),
    ("max ms", "max_us", "{:.2f}"),
)  # fmt: skip


def text(name: str, value: Any, form: str) -> Any:
    if name == "payload_bytes" and value >= 1024:
        return f"{value // 1024} KiB" if value < 1 << 20 else f"{value >> 20} MiB"
    return form.format(value / 1000 if name.endswith("_us") else value)


class Measurement(partners.BridgeTest):
    """Reuses the set-up of the tests, which is isolated from other programs and cleans up."""

    options: list[str] = []
    rows: list[Any] = []

    def runTest(self) -> None:
        self.master.start()
        self.start_bridge("_bytes_topics:=bench_bridge").says("waiting for a benchmark")
        command: list[Any] = [PROGRAMS / "bench_bridge", "--domain", str(self.domain), *self.options]
        with subprocess.Popen(command, env=self.environment, stdout=subprocess.PIPE, text=True) as bench:
            assert bench.stdout
            next(bench.stdout, None)  # the warm-up
            print("| " + " | ".join(c[0] for c in COLUMNS) + " |\n|" + " ---: |" * len(COLUMNS), flush=True)
            for line in bench.stdout:
                row = json.loads(line)
                self.rows.append(row)
                print("| " + " | ".join(text(n, row[n], f) for _, n, f in COLUMNS) + " |", flush=True)
        if bench.returncode != 0:
            raise SystemExit(bench.returncode)


def main() -> None:
    options = sys.argv[1:]
    file = None
    if "--json" in options:
        at = options.index("--json")
        file = options[at + 1]
        del options[at : at + 2]
    if "--help" in options:
        print(__doc__)
        sys.exit(subprocess.call([PROGRAMS / "bench_bridge", "--help"]))
    Measurement.options = options
    result: Any = Measurement().run()
    for _, trace in result.errors + result.failures:
        sys.exit(trace)
    if file:
        with tempfile.NamedTemporaryFile("w", dir=os.path.dirname(file) or ".", delete=False) as part:
            json.dump(Measurement.rows, part, indent=1)
        os.rename(part.name, file)


if __name__ == "__main__":
    main()
