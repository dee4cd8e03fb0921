#!/usr/bin/env -S PYTHONPATH=bench /usr/bin/python3 -B
# SPDX-License-Identifier: Apache-2.0
"""Explores interleavings of the live executor's threads with interleavings_test, and counts them."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from evidence import ROOT, parser, publish

RESULT = "reliability/interleavings.json"
PROGRAM = ROOT / "build/executor/hotpath_executor_interleavings_test"
COUNTS = ("preemptions", "systematic", "complete", "random", "lost_and_found", "executors")


def main() -> int:
    """Exit code of the test."""
    arguments = parser(__doc__, RESULT)
    arguments.add_argument("--interleavings", type=int, default=70000, help="at most, of each kind")
    arguments.add_argument("--program", type=Path, default=PROGRAM)
    options = arguments.parse_args()
    environment = os.environ | {"HOTPATH_INTERLEAVINGS": str(options.interleavings)}
    with tempfile.TemporaryDirectory(prefix="hotpath_interleavings_") as scratch:
        report = Path(scratch) / "report.json"
        command = [options.program, f"--gtest_output=json:{report}"]
        if code := subprocess.run(command, env=environment, check=False).returncode:
            return code
        content = json.loads(report.read_text(encoding="utf-8"))
    facts = {name: int(content[name]) for name in COUNTS}
    print(json.dumps(facts, indent=1))
    if options.publish:
        publish(RESULT, facts)
    return 0


if __name__ == "__main__":
    sys.exit(main())
