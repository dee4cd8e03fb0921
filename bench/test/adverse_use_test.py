# SPDX-License-Identifier: Apache-2.0
"""Commands used rightly and wrongly: each command does its work, each option has its effect or is
rejected, and wrong words end with one sentence and exit code 2."""

import csv
import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

import adverse_effects as entries
import adverse_tables as tables
import failing_calls_test
from adverse_tables import rows, words
from hotpath_command import CommandTest, RunFolder, clean_up

WRONG_USE = 2
TESTS = Path(__file__).parent
# Keys of run.json that describe the call, or the folder in which an import writes its graph.
NOT_ITS_RESULT = {"command", "inputs"}
# Those whose values differ between two runs in real time with the same options.
MEASURED = {"bounds", "calibration", "command", "date", "machine", "warnings"}
OF_A_RUN = ("executor", "repetition", "first_timestamps_ms", "live", "thread_policies")
OPTION = re.compile(r"^  (?:-\w,)?(--[\w-]+)(?:,--[\w-]+)* ([^ =\[:]+)(?= |=|$)", re.M)
NUMBER_KINDS = "N SECONDS MS US PERCENT LEVEL X JOBS FLOAT".split()


def assert_says(err: str, *parts: str) -> None:
    """Checks that hotpath printed exactly one error line, which contains all parts. Notes and Fast
    DDS's log do not count."""
    sentences = [line for line in err.splitlines() if line.startswith("hotpath: ")]
    assert len(sentences) == 1, err
    for part in parts:
        assert part in sentences[0]
    signs = r"terminate called|what\(\):|Aborted|core dumped|Traceback|std::|filesystem error"
    assert not re.search(signs, err)


def assert_rejected(shell: Any, line: list[Any], *parts: str) -> None:
    before = sorted(shell.folder.rglob("*"))
    code, out, err = shell.command(*line)
    assert (code, out) == (WRONG_USE, ""), err
    assert_says(err, *parts)
    assert sorted(shell.folder.rglob("*")) == before


@pytest.mark.parametrize("line, parts", [(row[0], row[1:]) for row in rows(tables.REJECTED)])
def test_wrong_words_are_rejected(shell: CommandTest, stock: Path, line: str, parts: list[str]) -> None:
    assert_rejected(shell, words(line, stock), *(part.format(stock=stock) for part in parts))


@pytest.mark.parametrize("line", tables.NUMBERS)
def test_numbers_are_read_strictly(shell: CommandTest, line: str) -> None:
    for number in tables.NUMBERS[line].split():
        assert_rejected(
            shell, [*line.split(), number], f"{line.split()[-1]}: `{number}` is not a whole number from"
        )


@pytest.mark.parametrize(
    "distribution, options, parts", [(*r[:2], r[2:]) for r in rows(tables.REJECTED_ON_ROS2)]
)
def test_the_stack_of_ros_2(shell: CommandTest, distribution: str, options: str, parts: list[str]) -> None:
    shell.environment |= {"AMENT_PREFIX_PATH": "/no/where", "ROS_DISTRO": distribution}
    shell.environment["HOTPATH_ROS2_RUNNER"] = "/bin/true"
    if not distribution:
        del shell.environment["ROS_DISTRO"]
    assert_rejected(shell, [*tables.ON_ROS2.split(), *options.split()], *parts)


def test_a_stack_of_ros_2_that_is_not_there(shell: CommandTest) -> None:
    for name in ("AMENT_PREFIX_PATH", "HOTPATH_ROS2_RUNNER"):
        shell.environment.pop(name, None)
    run = tables.ROS2_RUN.split()
    assert_rejected(shell, run, "setup.bash", "ros2_build.sh")
    shell.environment["AMENT_PREFIX_PATH"] = "/no/where"
    assert_rejected(shell, run, "hotpath_rclcpp_system")
    shell.environment["HOTPATH_ROS2_RUNNER"] = "/no/where"
    assert_rejected(shell, run, "no executable program /no/where")


def test_an_empty_name_is_rejected(shell: CommandTest, commands: Any) -> None:
    tried = 0
    for command, text in commands.items():
        for option, kind in OPTION.findall(text):
            if kind not in NUMBER_KINDS and ("|" not in kind or "FILE" in kind):
                assert kind != "TEXT", f"{command} {option}: its help does not say what it takes"
                assert_rejected(shell, [*command, option, ""], f"hotpath: {option}")
                tried += 1
    assert tried > 60


def test_help_is_no_error(commands: Any) -> None:
    for text in commands.values():
        assert "Usage: hotpath" in text
        assert max(map(len, text.splitlines())) <= 120


# Each command at work.


def prepare(line: str, folder: Path) -> None:
    """Makes the inputs of a use that no other command writes."""
    if line.startswith("sweep"):
        (folder / "sweep.yaml").write_text(entries.SWEEP)
    if "killed" in line and not (folder / "killed").exists():
        killed = folder / "killed"
        shutil.copytree(folder / "stored", killed)
        (killed / "summary.json").unlink()
        for file in ("jobs.csv", "chains.csv"):
            (killed / file).rename(killed / f"{file}.part")
        run = json.loads((killed / "run.json").read_text())
        (killed / "run.json").write_text(json.dumps({**run, "complete": False}))


def test_each_command_does_its_work_and_only_live_runs_use_the_network(shell: Any, commands: Any) -> None:
    assert {command_of(commands, use) for use in entries.USES} == set(commands) - entries.MEASURES_FOR_MINUTES
    calls = shell.folder / "calls"
    noted = {"LD_PRELOAD": failing_calls_test.LIBRARY, "HOTPATH_CALLS": str(calls)}
    for line, result in entries.USES.items():
        prepare(line, shell.folder)
        calls.write_bytes(failing_calls_test.NO_PLACES)
        networked = line.split()[0] in entries.NETWORKED
        shell.environment |= {} if networked else noted
        out = shell.accepted(*line.split())
        if not networked:
            _, places = failing_calls_test.noted_places(calls)
            assert (places["socket"], places["bind"]) == ([], []), line
            assert places["malloc"] != [], "the calls are not noted"
            for variable in noted:
                del shell.environment[variable]
        assert "Usage: hotpath" not in out
        if result.startswith(">"):
            assert result[1:] in out, line
        elif result:
            assert (shell.folder / result).stat().st_size > 0, line


def test_each_command_that_prints_tables_prints_them_as_json(shell: Any) -> None:
    for line in entries.USES:
        prepare(line, shell.folder)
        if line.startswith(entries.NO_TABLES):
            code, _, err = shell.command(*line.split(), "--json")
            assert code == WRONG_USE, line
            shell.accepted(*line.split())  # later uses read its files
        else:
            assert json.loads(shell.accepted(*entries.PRINTS_JSON.get(line, f"{line} --json").split())), line


@pytest.mark.parametrize("line, holds", tables.JSON_HOLDS.items())
def test_json_has_numbers_under_the_names_of_the_stored_files(
    shell: Any, stock: Path, line: str, holds: Any
) -> None:
    data = json.loads(shell.accepted(*words(line, stock), "--json"))
    assert any(all(row.get(key, key) == value for key, value in holds.items()) for row in data), data


def test_json_of_a_run_is_its_summary(shell: CommandTest) -> None:
    printed = json.loads(shell.accepted(*tables.SUMMARISED.split(), "--output", "run", "--json"))
    assert printed == RunFolder(shell.folder / "run").summary()


# The effect of each option.


class Results:
    """Runs command lines, each in a new folder, and caches their results."""

    def __init__(self, commands: Any, stock: Path, folder: Path, live: bool = False) -> None:
        self.commands, self.stock, self.folder, self.live = commands, stock, folder, live
        self.known: dict[Any, Any] = {}
        self.folders: dict[Any, Path] = {}

    def arguments(self, use: str) -> dict[str, list[str]]:
        """The words of a command line by option; the first ones as `command`."""
        line = words(use, self.stock)
        length = len(command_of(self.commands, use))
        return {"command": line[:length]} | arguments_of(line[length:])

    def facts_of(self, run: Any) -> Any:
        """The part of run.json that follows from the options."""
        if not self.live:
            return {key: value for key, value in run.items() if key not in NOT_ITS_RESULT}
        runs = [{key: r[key] for key in OF_A_RUN if key in r} for r in run["runs"]]
        return {key: value for key, value in run.items() if key not in MEASURED} | {"runs": runs}

    def result_of(self, path: Path) -> Any:
        """What follows from the options: of a run in real time, which rows have CPU times."""
        if not self.live:
            return path.read_bytes()
        return path.name == "jobs.csv" and any(row["cpu_ns"] for row in csv.DictReader(path.open()))

    def of(self, arguments: dict[str, list[str]]) -> Any:
        """(exit code, output and files by path, each run.json by path, standard error)"""
        line = tuple(word for values in arguments.values() for word in values)
        if line not in self.known:
            folder = self.folder / str(len(self.known))
            folder.mkdir()
            case = CommandTest()
            case.setUp()
            case.folder = folder
            code, out, err = case.command(*line)
            clean_up(case)
            files = {str(f.relative_to(folder)): f for f in sorted(folder.rglob("*")) if f.is_file()}
            runs = {name for name in files if name.endswith("run.json")}
            facts = {name: self.facts_of(json.loads(files[name].read_text())) for name in runs}
            found = {name: self.result_of(files[name]) for name in files.keys() - runs}
            self.folders[line] = folder
            self.known[line] = (code, found | {"": "" if self.live else out}, facts, err)
        return self.known[line]


def command_of(commands: Any, line: str) -> Any:
    """The command with which a line begins."""
    return max((c for c in commands if line.split()[: len(c)] == list(c)), key=len)


def arguments_of(line: list[str]) -> dict[str, list[str]]:
    """Words by option; those before the options as `operand`. `-NAME` is an option to take away."""
    found: dict[str, list[str]] = {"operand": []} if line and line[0][0] != "-" else {}
    name = "operand"
    for word in line:
        if word.startswith("--"):
            name = word.partition("=")[0]
            found[name] = []
        elif word.startswith("-"):
            found[word[1:] if word == "-operand" else "-" + word] = []
            continue
        found[name].append(word)
    return found


def check_effect(results: Results, use: str, effect: str) -> None:
    line, *signs = re.split(r" ([+!=@]) ", effect)
    said = dict(zip(signs[::2], signs[1::2]))
    if "@" in said:
        if said["@"].endswith(".py"):
            text = (TESTS / said["@"]).read_text()
            assert all(option in text for option in line.split())
        return
    given = results.arguments(use) | arguments_of(words(said.get("+", ""), results.stock))
    with_it = results.of(given | arguments_of(words(line, results.stock)))
    if "!" in said:
        assert with_it[0] == WRONG_USE, with_it[3]
        assert said["!"] in with_it[3]
        return
    without = results.of(given)
    assert without[0] == 0, without[3]
    assert with_it[0] == 0, f"{line} ends with an error: {with_it[3]}"
    if "=" in said:
        assert with_it[:2] == without[:2], said["="]
        return
    assert with_it[: 3 if results.live else 2] != without[: 3 if results.live else 2], f"{line} is ignored"
    if without[2] and not use.startswith("advise"):  # its runs are those of `simulate`
        assert with_it[2] != without[2], f"run.json does not record {line}"


def name_of(effect: str) -> str:
    return effect.split()[0].partition("=")[0]


def effects(uses: dict[str, str]) -> list[tuple[str, str]]:
    """(use, effect) of each option of the tables; a later line for an option replaces an earlier one."""
    found = []
    for use, table in uses.items():
        common = "--output elsewhere\n" if "--output out" in use else ""
        lines = {name_of(line): line for line in (common + table).splitlines() if line}
        found += [(use, line) for line in lines.values()]
    return found


def options_of(help_text: str) -> set[str]:
    return set(re.findall(r"^  (--[a-z0-9-]+)", help_text, re.MULTILINE))


@pytest.fixture(scope="session")
def results(commands: Any, stock: Path, tmp_path_factory: Any) -> Results:
    return Results(commands, stock, tmp_path_factory.mktemp("results"))


@pytest.mark.parametrize(
    "use, effect",
    effects(entries.EFFECTS)
    + [(entries.SIMULATION, line) for line in entries.MORE_VALUES.strip().splitlines()],
)
def test_each_option_has_its_effect(results: Results, use: str, effect: str) -> None:
    check_effect(results, use, effect)


def test_a_stored_run_records_all_of_its_options(shell: CommandTest, results: Results) -> None:
    """Its command makes the same files again, and its simulation is the run."""
    runs = []
    more = [(entries.SIMULATION, line) for line in entries.MORE_VALUES.strip().splitlines()]
    for use, effect in effects({entries.SIMULATION: entries.EFFECTS[entries.SIMULATION]}) + more:
        line, *signs = re.split(r" ([+!=@]) ", effect)
        if not {"!", "@"} & set(signs) and "--no-trace" not in line:
            whole = f"{signs[1]} {line}" if "+" in signs else line
            arguments = results.arguments(use) | arguments_of(words(whole, results.stock))
            assert results.of(arguments)[0] == 0
            folder = results.folders[tuple(word for values in arguments.values() for word in values)]
            runs.append(next(folder.glob("*/run.json")).parent)
    for run in runs:
        again = shell.folder / f"again{len(list(shell.folder.iterdir()))}"
        shell.accepted(*RunFolder(run).run["command"], "--output", again)
        for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
            assert (again / name).read_bytes() == (run / name).read_bytes(), run
    shell.accepted(*entries.VALIDATE, *runs, "--output", "validation")
    compared = json.loads((shell.folder / "validation" / "validation.json").read_text())["runs"]
    assert len(compared) == sum(len(RunFolder(run).run["runs"]) for run in runs) > 60
    for entry in compared:
        both = entry["comparison"]
        assert (both["similarity"], both["first_difference"]) == (1, None), entry["run"]
        assert both["measured"] == both["other"] and both["measured"]["jobs"] > 10


def test_a_command_is_stored_without_what_changes_no_result(shell: CommandTest) -> None:
    shell.accepted(*entries.STORED.split(), "--threads=1", "--output", "run")
    assert RunFolder(shell.folder / "run").run["command"] == entries.STORED.split()


def test_no_command_and_no_option_is_forgotten(commands: Any) -> None:
    uses = entries.EFFECTS | entries.LIVE_EFFECTS
    named: dict[Any, set[str]] = {command_of(commands, use): {"--output", "--json"} for use in uses}
    assert set(named) == set(commands)
    for use, effect in effects(uses):
        line, _, elsewhere = effect.partition(" @ ")
        named[command_of(commands, use)] |= set(line.split()) if elsewhere else {name_of(effect)}
    for command, text in commands.items():
        options = options_of(text)
        assert named[command] | options == options | {"--output", "--json"}, f"{command} has no such options"
        assert options - named[command] == set(), f"{command}: list their effect in the tables"


@pytest.mark.parametrize(
    "effect, says", [("--entity-order creation", "is ignored"), ("--phases nonsense", "ends with an error")]
)
def test_the_check_finds_an_option_that_is_ignored(results: Results, effect: str, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        check_effect(results, next(iter(entries.EFFECTS)), effect)


def test_an_option_that_no_executor_uses_is_noted(shell: CommandTest) -> None:
    code, _, err = shell.command(*tables.NOTED.split())
    assert code == 0
    assert "note: --entity-order changes nothing" in err
