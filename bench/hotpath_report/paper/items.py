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
    paper: str  # place in the paper; empty: not in the paper
    studies: list[str]
    figure: str  # name of its file
    caption: str
    draw: str
    table: str
    text: str
    options: dict[str, str] = field(default_factory=dict)


CONTENT = tomllib.loads(Path(__file__).with_name("items.toml").read_text(encoding="utf-8"))
ITEMS = tuple(Item(**item) for item in CONTENT["item"])  # in their order on the page
NAMES = tuple(item.name for item in ITEMS)
