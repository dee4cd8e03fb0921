# SPDX-License-Identifier: Apache-2.0
"""What a reproduction runs, from cells.toml: cells, each one invocation of `hotpath` with a fixed seed and a folder of
its own.

Live cells are one repetition in a fresh process. Their order is drawn once, from the seed, and kept in the plan.
"""

import random
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

SPEC: dict[str, Any] = tomllib.loads(Path(__file__).with_name("cells.toml").read_text(encoding="utf-8"))
MODES = {name: SimpleNamespace(name=name, **values) for name, values in SPEC["mode"].items()}
EXECUTORS: dict[str, tuple[str, ...]] = {name: tuple(found) for name, found in SPEC["executors"].items()}
UTILISATIONS = (60, 80, 90)
PAPER_LOAD_PERCENT = 80

# Between two live cells: calibration, a look at the machine's noise, discovery, writing.
LIVE_OVERHEAD_S = 2.8


@dataclass(frozen=True)
class Cell:
    """One invocation. An analysis states its whole command as `options`."""

    study: str
    source: str  # simulated, live or analysis
    label: str  # what tells it from other cells of its study; may be empty
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
        parts = [self.source, self.study, self.label]
        if self.source == "live":
            parts += [*self.executors, str(self.repetition + 1)]
        return ".".join(part.replace(":", "_") for part in parts if part)

    @property
    def seed(self) -> int:
        """Of all that is drawn at random."""
        return self.repetition + 1

    def command(self, output: object, place: Iterable[str] = ()) -> list[str]:
        """Words for `hotpath`; `place` are options that say where a live cell runs."""
        if self.source == "analysis":
            return [*self.options, "--output", str(output)]
        words = ["run", "--executor"] if self.source == "live" else ["simulate", "--executors"]
        words += [",".join(self.executors), "--graph", self.graph]
        words += [
            "--duration",
            f"{self.duration_s:g}",
            "--warm-up",
            f"{self.warm_up_s:g}",
            "--seed",
            str(self.seed),
        ]
        return [*words, *self.options, *place, "--output", str(output)]

    def facts(self) -> dict[str, Any]:
        """What results say of the cell."""
        fields = (
            "study",
            "source",
            "executors",
            "graph",
            "load_percent",
            "duration_s",
            "warm_up_s",
            "repetition",
        )
        return {"name": self.name, **{field: getattr(self, field) for field in fields}, "seed": self.seed}


def labels_of(spec: dict[str, Any], mode: Any) -> list[Any]:
    """The labels that an entry states, or those of the mode."""
    labels = spec.get("labels", [""])
    found: list[Any] = getattr(mode, labels) if isinstance(labels, str) else labels
    return found


def cell_of(spec: dict[str, Any], source: str, label: Any, mode: Any) -> Cell:
    """The cell that an entry makes for a label."""
    options = tuple(option.format(label=label, mode=mode) for option in spec.get("options", []))
    return Cell(
        study=spec["study"],
        source=source,
        label=str(label),
        seconds=spec.get("seconds", 0),
        executors=EXECUTORS[spec["executors"]] if "executors" in spec else (),
        graph=spec.get("graph", Cell.graph).format(label=label),
        load_percent=label if isinstance(label, int) else PAPER_LOAD_PERCENT,
        duration_s=getattr(mode, spec["duration_s"]) if "duration_s" in spec else 0,
        warm_up_s=mode.warm_up_s,
        options=options,
        cores=spec.get("cores", 1),
        alone=spec.get("alone", False),
    )


def offline_cells(mode: Any) -> list[Cell]:
    """Those in virtual time, then those that compute bounds and measure what a release costs here."""
    entries = [("simulated", spec) for spec in SPEC["simulated"]] + [
        ("analysis", spec) for spec in SPEC["analysis"]
    ]
    return [cell_of(spec, source, label, mode) for source, spec in entries for label in labels_of(spec, mode)]


def live_cells(mode: Any) -> list[Cell]:
    """All live repetitions."""
    cells = []
    for spec in SPEC["live"]:
        repetitions, duration_s = getattr(mode, spec["lengths"])
        for repetition in range(repetitions):
            for label in labels_of(spec, mode):
                cell = replace(
                    cell_of(spec, "live", label, mode), duration_s=duration_s, repetition=repetition
                )
                cell = replace(cell, seconds=duration_s + mode.warm_up_s + LIVE_OVERHEAD_S)
                cells += [replace(cell, executors=(executor,)) for executor in cell.executors]
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


def all_cells(mode: Any, seed: int) -> list[Cell]:
    """The plan of a reproduction."""
    return offline_cells(mode) + live_order(live_cells(mode), seed)
