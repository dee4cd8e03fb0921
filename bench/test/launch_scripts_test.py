# SPDX-License-Identifier: Apache-2.0
"""The scripts for users: each explains itself without doing anything, and rejects what it does not know."""

import subprocess
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "launch_scripts"
#: The others pass their arguments on: to hotpath, to fuzz.py or to a program of roslaunch.
STRICT = (
    "build",
    "colcon_build",
    "format",
    "package",
    "ros2_bars",
    "ros2_build",
    "sanitize",
    "setup",
    "test",
    "tidy",
)


def run(script: str, argument: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """The script as called from another folder. With no program but bash's own and these it cannot do its work."""
    for name in ("basename", "dirname", "env", "bash", "realpath", "sed"):
        if not (folder / name).exists():
            (folder / name).symlink_to(Path("/usr/bin") / name)
    return subprocess.run(
        [SCRIPTS / f"{script}.sh", argument],
        cwd=folder,
        env={"PATH": str(folder)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("script", [*STRICT, "fuzz", "hot_path"])
@pytest.mark.parametrize("option", ["--help", "-h"])
def test_help_prints_the_usage(script: str, option: str, tmp_path: Path) -> None:
    ended = run(script, option, tmp_path)
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.startswith(f"{script}.sh")
    assert "set -euo" not in ended.stdout


@pytest.mark.parametrize("script", STRICT)
def test_an_unknown_option_is_wrong_use(script: str, tmp_path: Path) -> None:
    ended = run(script, "--nonsense", tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.startswith(f"{script}.sh: ")
    assert "--nonsense" in ended.stderr
