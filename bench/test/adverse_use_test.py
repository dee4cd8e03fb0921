# SPDX-License-Identifier: Apache-2.0
"""Commands used rightly and wrongly: each command does its work, each option has its effect or is
rejected, and wrong words end with one sentence and exit code 2."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest

import adverse_effects as effects
import adverse_tables as tables
import failing_calls_test
from adverse_tables import rows
from hotpath_command import CommandTest, RunFolder, clean_up

OPTION = re.compile(r"^  (?:-\w,)?(--[\w-]+)(?:,--[\w-]+)* ([^ =\[:]+)(?= |=|$)", re.M)


def rejected() -> Iterator[tuple[str, list[str]]]:
    """Command lines, with parts of the sentences that reject them."""
    yield from ((line, parts) for line, *parts in rows(tables.REJECTED))
    for line, *options in rows(tables.EXCLUDED):
        last = re.findall(r"--[\w-]+", line)[-1]
        yield from ((f"{line} {option}", [last, option.split()[0]]) for option in options)


@pytest.mark.parametrize("line, parts", rejected())
def test_wrong_words_are_rejected(shell: CommandTest, line: str, parts: list[str]) -> None:
    shell.refused(*filter(None, [line]), says=[part.format(**shell.places) for part in parts])


def wrong_values(kind: str) -> list[tuple[str, list[str]]]:
    """Values of an option, and what is said of them; the kind of its values is that of its help."""
    if kind in ("N", "JOBS"):
        return [(n, [f"`{n}` is not a whole number from"]) for n in tables.WHOLE_NUMBERS.split()]
    if kind in ("SECONDS", "MS", "US", "PERCENT", "LEVEL", "X"):
        return [(n, [f"`{n}` is not a number from"]) for n in tables.OTHER_NUMBERS.split()]
    if re.fullmatch(r"[a-z_]+(\|[a-z_]+)+", kind):
        return [("nothing", ["nothing", *kind.split("|")])]
    return [("", [])]


def test_each_option_rejects_wrong_values(shell: CommandTest, commands: Any) -> None:
    """Numbers are read strictly; a name is not empty; an unknown word is answered with the known ones."""
    (shell.folder / "runs").mkdir()  # where the names of results are reserved while options are checked
    tried = 0
    for command, text in commands.items():
        for option, kind in OPTION.findall(text):
            assert kind != "TEXT", f"{command} {option}: its help does not say what it takes"
            for value, says in wrong_values(kind):
                shell.refused(*command, option, value, says=[f"hotpath: {option}", *says])
                tried += 1
    assert tried > 300


def command_of(commands: Any, line: str) -> Any:
    """The command with which a line begins."""
    return max((c for c in commands if line.split()[: len(c)] == list(c)), key=len)


def test_each_command_does_its_work(shell: CommandTest, commands: Any) -> None:
    """It writes its file or prints its text, and JSON with the names of stored files unless it rejects
    --json. Only live runs use the network."""
    assert {command_of(commands, use) for use in effects.USES} == set(commands) - effects.MEASURES_FOR_MINUTES
    calls = shell.folder / "calls"

    noted = f"LD_PRELOAD={failing_calls_test.LIBRARY} HOTPATH_CALLS={calls}"

    def printed(line: str) -> str:
        calls.write_bytes(failing_calls_test.NO_PLACES)
        unnoted = line.startswith(effects.UNNOTED)
        out = shell.accepted(line, given=effects.GIVEN.get(result, "") + ("" if unnoted else noted))
        _, places = failing_calls_test.noted_places(calls)
        assert (places["socket"], places["bind"]) == ([], []), line
        assert unnoted or places["malloc"] != [], "the calls are not noted"
        assert "Usage: hotpath" not in out
        return str(out)

    for line, result in effects.USES.items():
        command = " ".join(command_of(commands, line))
        as_json = line.replace(command, f"{command} --json", 1)
        if line.startswith(effects.NO_TABLES):
            shell.refused(as_json, says="--json")
            out = printed(line)
        else:
            data = json.loads(printed(as_json))
            holds = effects.JSON_HOLDS.get(line, {})
            assert data and (not holds or any(holds.items() <= row.items() for row in data)), line
            if result == "stored/summary.json":
                assert data == RunFolder(shell.folder / "stored").summary()
            out = printed(line) if result.startswith(">") else ""
        if result.startswith(">"):
            assert result[1:] in out, line
        else:
            assert (shell.folder / result).stat().st_size > 0, line


# The effect of each option.


class Result(NamedTuple):
    code: int
    files: dict[str, bytes]  # by path; "": standard output; of runs in real time, none counts
    runs: dict[str, Any]  # what follows from the options in each run.json
    err: str
    folder: Path


NOT_ITS_RESULT = {"bounds", "calibration", "command", "date", "inputs", "machine", "warnings"}
OF_A_RUN = ("executor", "repetition", "first_timestamps_ms", "live", "thread_policies")


def facts_of(file: Path) -> dict[str, Any]:
    run = json.loads(file.read_text())
    run["runs"] = [{key: r[key] for key in OF_A_RUN if key in r} for r in run["runs"]]
    return {key: run[key] for key in run.keys() - NOT_ITS_RESULT}


def by_option(line: str) -> dict[str, str]:
    """Parts of a line by option; the part before the options under an empty name. `-NAME` takes one away."""
    parts = {re.split("[ =]", part)[0] if part[0] == "-" else "": part for part in re.split(" (?=-)", line)}
    return {f"-{name}" if re.match("-[a-z]", name) else name: part for name, part in parts.items()}


class Results(dict[str, Result]):
    """The results of command lines, each of which runs once in a folder of its own."""

    def __init__(self, stock: Path, folder: Path) -> None:
        super().__init__()
        self.places, self.folder = tables.PLACES | {"stock": stock}, folder

    def __missing__(self, line: str) -> Result:
        case = CommandTest()
        case.setUp()
        case.folder = self.folder / str(len(self))
        case.folder.mkdir()
        code, out, err = case.command(line)
        clean_up(case)
        files = {str(f.relative_to(case.folder)): f for f in sorted(case.folder.rglob("*")) if f.is_file()}
        runs = {name: facts_of(files.pop(name)) for name in list(files) if name.endswith("run.json")}
        found = {name: f.read_bytes() for name, f in files.items()}
        found[""] = out.replace(str(case.folder), "").encode()
        self[line] = Result(code, {} if line.startswith("run") else found, runs, err, case.folder)
        return self[line]

    def of(self, *lines: str) -> Result:
        """The result of a use with the options of further lines, which replace those before."""
        options: dict[str, str] = {}
        for line in filter(None, lines):
            options |= by_option(line.format(**self.places))
        return self[" ".join(part for part in options.values() if re.match("--|[a-z]", part))]

    def check(self, use: str, effect: str) -> None:
        """Checks an effect of the tables."""
        line, *signs = re.split(r" ([+!=@]) ", effect)
        says = dict(zip(signs[::2], signs[1::2]))
        if "@" in says:
            elsewhere = Path(__file__).with_name(says["@"])
            assert says["@"][-3:] != ".py" or all(option in elsewhere.read_text() for option in line.split())
            return
        both = says.get("+", "")
        with_it = self.of(use, both, line)
        if "!" in says:
            assert with_it.code == 2 and says["!"] in with_it.err, with_it.err
            return
        without = self.of(use, both)
        assert without.code == 0, without.err
        assert with_it.code == 0, f"{line} ends with an error: {with_it.err}"
        if "=" in says:
            assert with_it.files == without.files, says["="]
        else:
            assert with_it.files != without.files or not without.files, f"{line} is ignored"
            if without.runs and not use.startswith("advise"):  # its runs are those of `simulate`
                assert with_it.runs != without.runs, f"run.json does not record {line}"


def effects_of() -> list[tuple[str, str]]:
    """(use, effect) of each option; a later line for an option replaces an earlier one."""
    found = []
    for use, table in effects.EFFECTS.items():
        lines = {[*by_option(line)][0]: line for line in table.splitlines() if line}
        found += [(use, line) for line in lines.values()]
    for option, *values in rows(effects.MORE_VALUES):
        found += [(effects.SIMULATION, f"{option} {value}") for value in values]
    return found


@pytest.fixture(scope="session")
def results(stock: Path, tmp_path_factory: Any) -> Results:
    return Results(stock, tmp_path_factory.mktemp("results"))


@pytest.mark.parametrize("use, effect", effects_of())
def test_each_option_has_its_effect(results: Results, use: str, effect: str) -> None:
    results.check(use, effect)


def test_each_stored_run_has_all_of_its_options(results: Results) -> None:
    """The command of a run makes the same files, and its simulation the run; one command compares all."""
    for use, effect in effects_of():
        if use == effects.SIMULATION:
            results.check(use, effect)
    lines = [line for line in results if line.startswith("simulate") and "--no-trace" not in line]
    runs = [RunFolder(file.parent) for line in lines for file in results[line].folder.glob("*/run.json")]
    for run in runs:
        assert "threads" not in " ".join(run.run["command"]), "it changes no result"
        again = results[" ".join([*run.run["command"], "--output", "again"])].folder / "again"
        for name in ("run.json", "summary.json", "jobs.csv", "chains.csv"):
            assert (again / name).read_bytes() == (run.path / name).read_bytes(), run.path
    compared = results[" ".join(["diff", *(str(r.path) for r in runs), "--simulated --output validation"])]
    comparisons = json.loads(compared.files["validation/validation.json"])["runs"]
    assert len(comparisons) == sum(len(run.run["runs"]) for run in runs) > len(runs) > 25
    for both in (entry["comparison"] for entry in comparisons):
        assert (both["similarity"], both["first_difference"]) == (1, None), both
        assert both["measured"] == both["other"] and both["measured"]["jobs"] > 10


@pytest.mark.parametrize(
    "effect, says",
    [("--entity-order creation", "record|is ignored"), ("--phases nonsense", "ends with an error")],
)
def test_the_check_finds_an_option_that_is_ignored(results: Results, effect: str, says: str) -> None:
    with pytest.raises(AssertionError, match=says):
        results.check(effects.SIMULATION, effect)


def test_no_command_and_no_option_is_forgotten(commands: Any) -> None:
    named: dict[Any, set[str]] = {command: {"--output", "--json"} for command in commands}
    for use, effect in effects_of():
        line, _, elsewhere = effect.partition(" @ ")
        named[command_of(commands, use)] |= set(line.split()) if elsewhere else {[*by_option(effect)][0]}
    for command, text in commands.items():
        options = options_of(text)
        assert named[command] - options <= {"--output", "--json"}, f"{command} has no such options"
        assert options <= named[command], f"{command}: list their effect in the tables"
        assert "Usage: hotpath" in text and max(map(len, text.splitlines())) <= 120


def options_of(help_text: str) -> set[str]:
    return set(re.findall(r"^  (--(?!help)[a-z0-9-]+)", help_text, re.MULTILINE))


def test_an_option_that_no_executor_uses_is_noted(shell: CommandTest) -> None:
    line = "simulate --duration 1 --output out --executors rm-ro --entity-order reverse"
    code, _, err = shell.command(line)
    assert code == 0 and "note: --entity-order changes nothing" in err
