# SPDX-License-Identifier: Apache-2.0
"""What a reproduction runs: cells, each one invocation of `hotpath` with a fixed seed and a folder of its own.

Live cells are one repetition in a fresh process. Their order is drawn once, from the seed, and kept in the plan.
"""

import random
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

UTILISATIONS = (60, 80, 90)
TIMER_EXECUTORS = ("default", "static", "events-ro", "events-re", "rm-ro", "rm-re", "edf-ro", "edf-re")
WITH_BOUNDS = ("rm-ro", "rm-re")
PAPER_HOT_PATH = ("default", "static", "events-ro", "rm-ro")
ALL_ON_AUTOWARE = ("default", "static", "multi", "events-ro", "events-re", "rm-ro", "rm-re", "edf-ro", "edf-re")
MULTI_CORES = 2
RULE_VARIANTS = ("rm-ro", "rm-ro:first", "rm-ro:fifo", "rm-ro:first:fifo", "edf-ro", "edf-ro:first")
LIVE_VARIANTS = ("rm-ro:first", "rm-ro:fifo", "rm-ro:first:fifo")
MAP_EXECUTORS = ("default", "static", "events-ro", "rm-ro", "rm-re", "edf-ro", "edf-re")
LIVE_MAP_EXECUTORS = ("default", "events-ro", "rm-ro")
LIVE_PHASE_EXECUTORS = ("default", "rm-ro")
PAPER_DELTA_US = 119
PAPER_LOAD_PERCENT = 80

# Between two live cells: calibration, a look at the machine's noise, discovery, writing.
LIVE_OVERHEAD_S = 2.8


@dataclass(frozen=True)
class Mode:
    """How long and how often; `live_...`: repetitions, and seconds of each. Those of live timers-only cells are a
    multiple of the hyperperiod of 4.2 s."""

    name: str
    warm_up_s: float
    simulated_timers_s: float
    simulated_autoware_s: float
    simulated_loads: tuple[int, ...]  # percent of one core
    simulated_load_s: float
    simulated_draws: int
    simulated_draw_s: float
    waters_sets: int
    live_autoware: tuple[int, float]
    live_variants: tuple[int, float]
    live_timers: tuple[int, float]
    live_loads: tuple[int, ...]
    live_load_s: float
    live_draws: tuple[int, float]


SOME_LOADS, ALL_LOADS = tuple(range(20, 121, 20)), tuple(range(20, 121, 10))
LIVE_LOADS = (20, 40, 60, 100, 120)
# fmt: off
MODES = {
    mode.name: mode
    for mode in (
        Mode("quick", 1, 21, 60, SOME_LOADS, 30, 50, 4, 200, (1, 5), (1, 4), (1, 4.2), (40, 120), 4, (2, 4)),
        Mode("standard", 2, 300, 600, ALL_LOADS, 60, 200, 20, 1000, (5, 60), (3, 60), (3, 60), LIVE_LOADS, 20, (5, 20)),
        Mode("full", 2, 300, 600, ALL_LOADS, 60, 200, 60, 1000, (5, 600), (3, 600), (3, 300), LIVE_LOADS, 60, (10, 60)),
    )
}
# fmt: on


@dataclass(frozen=True)
class Cell:
    """One invocation. An analysis states its whole command as `options`."""

    study: str
    source: str  # simulated, live or analysis
    label: tuple[object, ...]  # what tells it from other cells of its study
    seconds: float  # expected
    executors: tuple[str, ...] = ()
    graph: str = "autoware"
    load_percent: int = PAPER_LOAD_PERCENT  # of one core; for a timers-only set its utilisation
    duration_s: float = 0
    warm_up_s: float = 0
    repetition: int = 0
    options: tuple[str, ...] = ()
    cores: int = 1
    alone: bool = False  # measures this machine, though it is no live cell

    @property
    def name(self) -> str:
        """Of its folder."""
        parts = [self.source, self.study, *self.label]
        if self.source == "live":
            parts += [*self.executors, self.repetition + 1]
        return ".".join(str(part).replace(":", "_") for part in parts)

    @property
    def seed(self) -> int:
        """Of all that is drawn at random."""
        return self.repetition + 1

    def command(self, output: object, place: Iterable[str] = ()) -> list[str]:
        """Words for `hotpath`; `place` are options that say where a live cell runs."""
        if self.source == "analysis":
            return [*self.options, "--output", str(output)]
        live = self.source == "live"
        words = ["run", "--executor"] if live else ["simulate", "--executors"]
        words += [",".join(self.executors), "--graph", self.graph]
        words += ["--duration", f"{self.duration_s:g}", "--warm-up", f"{self.warm_up_s:g}", "--seed", str(self.seed)]
        return [*words, *self.options, *place, "--output", str(output)]

    def facts(self) -> dict[str, Any]:
        """What results say of the cell."""
        fields = ("study", "source", "executors", "graph", "load_percent", "duration_s", "warm_up_s", "repetition")
        return {"name": self.name, **{field: getattr(self, field) for field in fields}, "seed": self.seed}


def timers_only(percent: int) -> dict[str, Any]:
    """Graph, load and label of a timers-only set."""
    return {"graph": f"timers_only_{percent}", "load_percent": percent, "label": (percent,)}


def simulated_cells(mode: Mode) -> list[Cell]:
    """Those in virtual time."""

    def cell(study: str, executors: tuple[str, ...], duration_s: float, seconds: float, **more: Any) -> Cell:
        fields = {"label": (), "warm_up_s": mode.warm_up_s, **more}
        return Cell(study, "simulated", seconds=seconds, executors=executors, duration_s=duration_s, **fields)

    cells, with_cost = [], ("--release-cost-us", str(PAPER_DELTA_US))
    for percent in UTILISATIONS:
        graph, length = timers_only(percent), mode.simulated_timers_s
        cells.append(cell("timers", TIMER_EXECUTORS, length, 3, **graph))
        cells.append(cell("timers_with_release_cost", WITH_BOUNDS, length, 2, options=with_cost, **graph))
    light = ("--no-trace",)
    length = mode.simulated_autoware_s
    cells.append(cell("autoware", TIMER_EXECUTORS, length, 3, label=("one_core",), options=light))
    two_cores = ("--cores", str(MULTI_CORES), *light)
    cells.append(cell("autoware", ("multi",), length, 1, label=("multi",), options=two_cores))
    cells.append(cell("rules", RULE_VARIANTS, length, 3, options=light))
    for load in mode.simulated_loads:
        at_load = {"label": (load,), "load_percent": load, "options": ("--load", str(load), *light)}
        cells.append(cell("load", MAP_EXECUTORS, mode.simulated_load_s, 1, **at_load))
    draws = ("--phases", "random", "--repetitions", str(mode.simulated_draws), *light)
    cells.append(cell("phases", MAP_EXECUTORS, mode.simulated_draw_s, 6, options=draws))
    return cells


def analysis_cells(mode: Mode) -> list[Cell]:
    """Those that compute bounds, and measure what a release costs here."""
    waters = ("experiment", "waters", "--sets", str(mode.waters_sets), "--seed", "1")
    return [
        Cell("waters", "analysis", (), 3, options=waters),
        Cell("wcrt", "analysis", (), 1, options=("experiment", "wcrt-table"), alone=True),
    ]


def live(study: str, executor: str, repetition: int, duration_s: float, mode: Mode, **more: Any) -> Cell:
    """One live repetition."""
    fields = {"label": (), "warm_up_s": mode.warm_up_s, **more}
    expected = duration_s + mode.warm_up_s + LIVE_OVERHEAD_S
    fields |= {"executors": (executor,), "duration_s": duration_s, "repetition": repetition}
    return Cell(study, "live", seconds=expected, **fields)


def live_cells(mode: Mode) -> list[Cell]:
    """All live repetitions."""
    cells = []
    repetitions, duration = mode.live_autoware
    for r in range(repetitions):
        cells += [live("autoware", e, r, duration, mode) for e in TIMER_EXECUTORS]
        cells.append(live("autoware", f"multi:{MULTI_CORES}", r, duration, mode, cores=MULTI_CORES))
    repetitions, duration = mode.live_variants
    cells += [live("rules", e, r, duration, mode) for r in range(repetitions) for e in LIVE_VARIANTS]
    repetitions, duration = mode.live_timers
    for r in range(repetitions):
        for percent in UTILISATIONS:
            cells += [live("timers", e, r, duration, mode, **timers_only(percent)) for e in TIMER_EXECUTORS]
    for load in mode.live_loads:
        at_load = {"label": (load,), "load_percent": load, "options": ("--load", str(load))}
        cells += [live("load", e, 0, mode.live_load_s, mode, **at_load) for e in LIVE_MAP_EXECUTORS]
    repetitions, duration = mode.live_draws
    drawn = {"options": ("--phases", "random")}
    for r in range(repetitions):
        cells += [live("phases", e, r, duration, mode, **drawn) for e in LIVE_PHASE_EXECUTORS]
    return cells


def live_order(cells: list[Cell], seed: int) -> list[Cell]:
    """Round after round of repetitions, each in random order, so that a drift of the machine meets all executors."""
    generator = random.Random(seed)
    rounds: dict[int, list[Cell]] = {}
    for cell in cells:
        rounds.setdefault(cell.repetition, []).append(cell)
    ordered = []
    for repetition in sorted(rounds):
        generator.shuffle(rounds[repetition])
        ordered += rounds[repetition]
    return ordered


def all_cells(mode: Mode, seed: int) -> list[Cell]:
    """The plan of a reproduction."""
    return simulated_cells(mode) + analysis_cells(mode) + live_order(live_cells(mode), seed)
