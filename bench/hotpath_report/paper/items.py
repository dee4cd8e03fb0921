# SPDX-License-Identifier: Apache-2.0
"""The items of a reproduction, from items.toml."""

import tomllib
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Item:
    """A table or figure of the paper, or one beyond it."""

    name: str
    title: str
    paper: str  # where the paper shows it; empty: it does not
    studies: tuple[str, ...]
    figure: str  # name of its file
    caption: str
    draw: str
    table: str
    text: str
    options: dict[str, str] = field(default_factory=dict)


def read() -> tuple[Item, ...]:
    """All items in their order on the page."""
    found = tomllib.loads(Path(__file__).with_name("items.toml").read_text(encoding="utf-8"))["item"]
    return tuple(Item(studies=tuple(item.pop("studies")), **item) for item in found)


ITEMS = read()
NAMES = tuple(item.name for item in ITEMS)
