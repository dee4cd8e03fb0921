# SPDX-License-Identifier: Apache-2.0
"""The scripts for users: each explains itself without doing anything, and rejects what it does not know."""

import subprocess
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).parents[2] / "launch_scripts"
#: The others pass their arguments on: to hotpath, to fuzz.py or to a program of roslaunch.
STRICT = "build colcon_build format package ros2_bars ros2_build sanitize setup test tidy".split()


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


def test_the_hot_path_is_simulated_then_measured(tmp_path: Path) -> None:
    """With stand-ins for set-up, build and hotpath: which commands run, in which order."""
    scripts, program = tmp_path / "launch_scripts", tmp_path / "build" / "bench" / "hotpath"
    scripts.mkdir()
    program.parent.mkdir(parents=True)
    for name in ("hot_path", "usage"):
        (scripts / f"{name}.sh").write_bytes((SCRIPTS / f"{name}.sh").read_bytes())
    for name in ("setup", "build"):
        (scripts / f"{name}.sh").write_text("#!/bin/sh\n")
        (scripts / f"{name}.sh").chmod(0o755)
    program.write_text(
        '#!/bin/sh\nif [ "$2" = --help-all ]; then echo "--executors --load --graph"; else echo "ran $*"; fi\n'
    )
    program.chmod(0o755)

    def commands(*options: str) -> list[str]:
        done = subprocess.run(
            ["bash", scripts / "hot_path.sh", *options],
            env={"PATH": "/usr/bin:/bin", "HOTPATH_OUTPUT": "out"},
            capture_output=True,
            text=True,
            check=True,
        )
        return [line for line in done.stdout.splitlines() if line.startswith("ran ")]

    executors = "--executors default,static,events-ro,rm-ro,edf-ro"
    simulated, measured = commands()
    assert simulated == f"ran simulate {executors} --duration 60 --no-trace --output out-simulated"
    assert measured.startswith(f"ran run {executors} --repetitions 3 --duration 5.5 --warm-up 0.5 --cpus ")
    assert measured.endswith(" --output out")
    simulated, measured = commands("--all", "--load", "50", "--cpus", "0", "--quick", "--stack=native")
    assert (
        simulated == "ran simulate --executors all --load 50 --duration 60 --no-trace --output out-simulated"
    )
    assert measured == "ran run --executors all --output out --load 50 --cpus 0 --quick --stack=native"
