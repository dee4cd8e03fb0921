# SPDX-License-Identifier: Apache-2.0
"""What a reproduction runs: cells, each one invocation of `hotpath` with a fixed seed and a folder of its own.

Live cells are one repetition in a fresh process. Their order is drawn once, from the seed, and kept in the plan.
"""

import random
from dataclasses import dataclass

UTILISATIONS = (60, 80, 90)
TIMER_EXECUTORS = ("default", "static", "events-ro", "events-re", "rm-ro", "rm-re", "edf-ro", "edf-re")
PAPER_HOT_PATH = ("default", "static", "events-ro", "rm-ro")
SINGLE_CORE = TIMER_EXECUTORS
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
    """How long and how often. `duration` of live timers-only cells is a multiple of the hyperperiod of 4.2 s."""

    name: str
    warm_up_s: float
    simulated_timers_s: float
    simulated_autoware_s: float
    simulated_loads: tuple
    simulated_load_s: float
    simulated_draws: int
    simulated_draw_s: float
    waters_sets: int
    live_autoware: tuple  # repetitions, seconds each
    live_variants: tuple
    live_timers: tuple
    live_loads: tuple
    live_load_s: float
    live_draws: int
    live_draw_s: float


ALL_LOADS = tuple(range(20, 121, 10))
MODES = {
    mode.name: mode
    for mode in (
        Mode(
            "quick",
            1,
            21,
            60,
            tuple(range(20, 121, 20)),
            30,
            50,
            4,
            200,
            (1, 5),
            (1, 4),
            (1, 4.2),
            (40, 120),
            4,
            2,
            4,
        ),
        Mode(
            "standard",
            2,
            300,
            600,
            ALL_LOADS,
            60,
            200,
            20,
            1000,
            (5, 60),
            (3, 60),
            (3, 60),
            (20, 40, 60, 100, 120),
            20,
            5,
            20,
        ),
        Mode(
            "full",
            2,
            300,
            600,
            ALL_LOADS,
            60,
            200,
            60,
            1000,
            (5, 600),
            (3, 600),
            (3, 300),
            (20, 40, 60, 100, 120),
            60,
            10,
            60,
        ),
    )
}


@dataclass(frozen=True)
class Cell:
    name: str
    study: str
    source: str  # simulated, live or analysis
    arguments: tuple  # of `hotpath`, without --output and where it runs
    seconds: float  # expected
    repetition: int = 0
    cores: int = 1
    alone: bool = False  # measures this machine, though it is no live cell

    def command(self, output, place=()):
        return [*self.arguments, *place, "--output", str(output)]


def number(value):
    return f"{value:g}"


def file_name(*parts):
    return ".".join(str(part).replace(":", "_") for part in parts)


def simulated(study, label, executors, duration_s, mode, *more, expected_s):
    arguments = ("simulate", "--executors", ",".join(executors), "--duration", number(duration_s))
    arguments += ("--warm-up", number(mode.warm_up_s), "--seed", "1", *more)
    return Cell(file_name("simulated", study, *label), study, "simulated", arguments, expected_s)


def simulated_cells(mode):
    cells = []
    for percent in UTILISATIONS:
        graph = ("--graph", f"timers_only_{percent}")
        cells.append(
            simulated("timers", (percent,), TIMER_EXECUTORS, mode.simulated_timers_s, mode, *graph, expected_s=3)
        )
        with_cost = (*graph, "--release-cost-us", number(PAPER_DELTA_US))
        ours = [e for e in TIMER_EXECUTORS if e.startswith("rm")]
        cells.append(
            simulated(
                "timers_with_release_cost", (percent,), ours, mode.simulated_timers_s, mode, *with_cost, expected_s=2
            )
        )
    light = ("--no-trace",)
    autoware_s = mode.simulated_autoware_s
    cells.append(simulated("autoware", ("one_core",), SINGLE_CORE, autoware_s, mode, *light, expected_s=3))
    two_cores = ("--cores", str(MULTI_CORES), *light)
    cells.append(simulated("autoware", ("multi",), ("multi",), autoware_s, mode, *two_cores, expected_s=1))
    cells.append(simulated("rules", (), RULE_VARIANTS, autoware_s, mode, *light, expected_s=3))
    for load in mode.simulated_loads:
        at_load = ("--load", str(load), *light)
        cells.append(simulated("load", (load,), MAP_EXECUTORS, mode.simulated_load_s, mode, *at_load, expected_s=1))
    draws = ("--phases", "random", "--repetitions", str(mode.simulated_draws), *light)
    cells.append(simulated("phases", (), MAP_EXECUTORS, mode.simulated_draw_s, mode, *draws, expected_s=6))
    return cells


def analysis_cells(mode):
    waters = ("experiment", "waters", "--sets", str(mode.waters_sets), "--seed", "1")
    return [
        Cell("analysis.waters", "waters", "analysis", waters, 3),
        Cell("analysis.wcrt", "wcrt", "analysis", ("experiment", "wcrt-table"), 1, alone=True),
    ]


def live(study, label, executor, duration_s, repetition, mode, *more, cores=1):
    arguments = ("run", "--executor", executor, "--duration", number(duration_s))
    arguments += ("--warm-up", number(mode.warm_up_s), "--seed", str(repetition + 1), *more)
    name = file_name("live", study, *label, executor, repetition + 1)
    expected = duration_s + mode.warm_up_s + LIVE_OVERHEAD_S
    return Cell(name, study, "live", arguments, expected, repetition, cores)


def live_cells(mode):
    cells = []
    repetitions, duration = mode.live_autoware
    for r in range(repetitions):
        cells += [live("autoware", (), e, duration, r, mode) for e in SINGLE_CORE]
        cells.append(live("autoware", (), f"multi:{MULTI_CORES}", duration, r, mode, cores=MULTI_CORES))
    repetitions, duration = mode.live_variants
    cells += [live("rules", (), e, duration, r, mode) for r in range(repetitions) for e in LIVE_VARIANTS]
    repetitions, duration = mode.live_timers
    for r in range(repetitions):
        for percent in UTILISATIONS:
            graph = ("--graph", f"timers_only_{percent}")
            cells += [live("timers", (percent,), e, duration, r, mode, *graph) for e in TIMER_EXECUTORS]
    for load in mode.live_loads:
        at_load = ("--load", str(load))
        cells += [live("load", (load,), e, mode.live_load_s, 0, mode, *at_load) for e in LIVE_MAP_EXECUTORS]
    for r in range(mode.live_draws):
        drawn = ("--phases", "random")
        cells += [live("phases", (), e, mode.live_draw_s, r, mode, *drawn) for e in LIVE_PHASE_EXECUTORS]
    return cells


def live_order(cells, seed):
    """Round after round of repetitions, each in random order, so that a drift of the machine meets all executors."""
    generator = random.Random(seed)
    rounds = {}
    for cell in cells:
        rounds.setdefault(cell.repetition, []).append(cell)
    ordered = []
    for repetition in sorted(rounds):
        generator.shuffle(rounds[repetition])
        ordered += rounds[repetition]
    return ordered


def all_cells(mode, seed):
    return simulated_cells(mode) + analysis_cells(mode) + live_order(live_cells(mode), seed)
