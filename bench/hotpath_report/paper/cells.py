# SPDX-License-Identifier: Apache-2.0
"""The items of a reproduction, and its cells: each is one invocation of `hotpath` with a fixed seed and its own
folder. A live cell is one repetition in a fresh process. The order of live cells is drawn once from the seed and
kept in the plan."""

import random
import tomllib
from collections.abc import Iterator, Sequence
from itertools import groupby, product
from operator import itemgetter
from pathlib import Path
from types import SimpleNamespace
from typing import Any


def read_spec(name: str) -> dict[str, Any]:
    """A TOML file beside this one."""
    return tomllib.loads(Path(__file__).with_name(name).read_text(encoding="utf-8"))


SPEC = read_spec("cells.toml")
MODES = {
    name: SimpleNamespace(name=name, **{key: values[: k + 1][-1] for key, values in SPEC["modes"].items()})
    for k, name in enumerate(("quick", "standard", "full"))
}
EXECUTORS: dict[str, list[str]] = SPEC["executors"]
UTILISATIONS = (60, 80, 90)
PAPER_LOAD_PERCENT = 80
# In the order of the page.
ITEMS = {
    name: SimpleNamespace(**{"name": name, "paper": "", "figure": name.replace("-", "_")} | item)
    for name, item in read_spec("items.toml").items()
}

CAUSES = ("stolen", "throttled", "others")  # of disturbances: the kernel's counters in run.json
# Expected durations: of a simulation or analysis, and between two live cells (noise, discovery, writing).
OFFLINE_S, LIVE_OVERHEAD_S = 2, 2.8

Cell = dict[str, Any]  # facts, as in its cell.json


def cells_of(source: str, mode: Any, cpus: Sequence[int] = (), build: str = "") -> Iterator[Cell]:
    """The cells of all entries of a source (simulated, live or analysis): one per label, live also one per repetition
    and executor, on the first `cpus`."""
    live = source == "live"
    for spec in SPEC[source]:
        study, on_timers = spec["study"], spec["study"].startswith("timers")
        labels, executors = spec.get("labels", UTILISATIONS if on_timers else [""]), spec.get("executors", [])
        executors = EXECUTORS[executors] if isinstance(executors, str) else executors
        once = (1, getattr(mode, spec.get("duration_s", ""), 0))
        repetitions, duration_s = getattr(mode, spec["lengths"]) if live else once
        options = [option.format(mode=mode) for option in spec.get("options", [])]
        each = [[e] for e in executors] if live else [executors]
        for repetition, label, of_cell in product(range(repetitions), labels, each):
            words = [source, study, str(label), *([*of_cell, str(repetition + 1)] if live else [])]
            cell = {
                "command": [],
                "build": build,  # of the program
                "complete": True,
                "name": ".".join(word.replace(":", "_") for word in words if word),  # also of its folder
                "study": study,
                "source": source,
                "executors": of_cell,
                "graph": f"timers_only_{label}" if on_timers else "autoware",
                # Of one core; for a timers-only set its utilisation.
                "load_percent": label if isinstance(label, int) else PAPER_LOAD_PERCENT,
                "duration_s": duration_s,
                "warm_up_s": mode.warm_up_s,
                "repetition": repetition,
                "seed": repetition + 1,  # of everything random
                "cpus": sorted(cpus[: spec.get("cores", 1)]),
            }
            yield cell | {"command": command_of(cell, options)}


def command_of(cell: Cell, options: list[str]) -> list[str]:
    """Its command line; the options of an analysis are its whole command."""
    words = list(options)
    if cell["source"] != "analysis":
        kind = ["run", "--repetitions", "1"] if cell["source"] == "live" else ["simulate"]
        kind += ["--executors", ",".join(cell["executors"]), "--graph", cell["graph"]]
        kind += ["--duration", f"{cell['duration_s']:g}", "--warm-up", f"{cell['warm_up_s']:g}"]
        words = [*kind, "--seed", str(cell["seed"]), *options]
    words += ["--cpus", ",".join(map(str, cell["cpus"])), "--domain", "0"] if cell["cpus"] else []
    return ["hotpath", *words, "--output", f"cells/{cell['name']}"]


def seconds_of(cell: Cell) -> float:
    """Expected duration."""
    live_s: float = cell["duration_s"] + cell["warm_up_s"] + LIVE_OVERHEAD_S
    return live_s if cell["source"] == "live" else OFFLINE_S


def all_cells(mode: Any, seed: int, cpus: Sequence[int] = (), build: str = "") -> list[Cell]:
    """The plan: simulated cells, then analyses (bounds, release cost), then live cells in rounds of repetitions in
    random order, so that drift affects all executors alike."""
    cells = [*cells_of("simulated", mode, (), build), *cells_of("analysis", mode, (), build)]
    generator, repetition = random.Random(seed), itemgetter("repetition")
    for _, of in groupby(sorted(cells_of("live", mode, cpus, build), key=repetition), repetition):
        found = list(of)
        generator.shuffle(found)
        cells += found
    return cells


def duration_text(seconds: float) -> str:
    """Hours and minutes, or minutes and seconds."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes:02} min"
    return f"{minutes} min {rest:02} s" if minutes else f"{rest} s"
