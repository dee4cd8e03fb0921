# SPDX-License-Identifier: Apache-2.0
"""The items of a reproduction, and its cells: each is one invocation of `hotpath` with a fixed seed and its own
folder. A live cell is one repetition in a fresh process. The order of live cells is drawn once from the seed and
kept in the plan."""

import random
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, product
from operator import attrgetter
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


@dataclass(frozen=True)
class Cell:
    """One invocation; the `options` of an analysis are its whole command."""

    name: str  # also of its folder
    study: str
    source: str  # simulated, live or analysis
    executors: list[str]
    graph: str
    load_percent: int  # of one core; for a timers-only set its utilisation
    duration_s: float
    warm_up_s: float
    repetition: int
    seed: int  # of everything random
    options: tuple[str, ...] = ()
    cores: int = 1

    def facts(self) -> dict[str, Any]:
        """Its attributes in results."""
        return {key: value for key, value in vars(self).items() if key not in ("options", "cores")}

    @property
    def seconds(self) -> float:
        """Expected duration."""
        return self.duration_s + self.warm_up_s + LIVE_OVERHEAD_S if self.source == "live" else OFFLINE_S

    def command(self) -> list[str]:
        """Arguments of `hotpath`, without the place of the cell and of its output."""
        if self.source == "analysis":
            return list(self.options)
        kind = ["run", "--repetitions", "1"] if self.source == "live" else ["simulate"]
        kind += ["--executors", ",".join(self.executors), "--graph", self.graph]
        kind += ["--duration", f"{self.duration_s:g}", "--warm-up", f"{self.warm_up_s:g}"]
        return [*kind, "--seed", str(self.seed), *self.options]


def cells_of(source: str, mode: Any) -> Iterator[Cell]:
    """The cells of all entries of a source: one per label, live also one per repetition and executor."""
    for spec in SPEC[source]:
        on_timers, live = spec["study"].startswith("timers"), source == "live"
        labels, executors = spec.get("labels", UTILISATIONS if on_timers else [""]), spec.get("executors", [])
        executors = EXECUTORS[executors] if isinstance(executors, str) else executors
        once = (1, getattr(mode, spec.get("duration_s", ""), 0))
        repetitions, duration_s = getattr(mode, spec["lengths"]) if live else once
        each = [[e] for e in executors] if live else [executors]
        for repetition, label, of_cell in product(range(repetitions), labels, each):
            words = [source, spec["study"], str(label), *([*of_cell, str(repetition + 1)] if live else [])]
            yield Cell(
                ".".join(word.replace(":", "_") for word in words if word),
                spec["study"],
                source,
                list(of_cell),
                graph=f"timers_only_{label}" if on_timers else "autoware",
                load_percent=label if isinstance(label, int) else PAPER_LOAD_PERCENT,
                duration_s=duration_s,
                warm_up_s=mode.warm_up_s,
                repetition=repetition,
                seed=repetition + 1,
                options=tuple(option.format(mode=mode) for option in spec.get("options", [])),
                cores=spec.get("cores", 1),
            )


def all_cells(mode: Any, seed: int) -> list[Cell]:
    """The plan: simulated cells, then analyses (bounds, release cost), then live cells in rounds of repetitions in
    random order, so that drift affects all executors alike."""
    cells, generator = [*cells_of("simulated", mode), *cells_of("analysis", mode)], random.Random(seed)
    live = sorted(cells_of("live", mode), key=attrgetter("repetition"))
    for _, repetition in groupby(live, key=attrgetter("repetition")):
        found = list(repetition)
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
