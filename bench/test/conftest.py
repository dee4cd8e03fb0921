# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the tests that are tables of cases."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hotpath_command
import test_inputs
from hotpath_command import HOTPATH, CommandTest, commands_below


@pytest.fixture
def shell() -> Iterator[CommandTest]:
    """Runs commands in a folder of its own."""
    case = CommandTest()
    case.setUp()
    yield case
    hotpath_command.clean_up(case)


@pytest.fixture(scope="session")
def stock() -> Iterator[Path]:
    """A folder with one small file of each format; tests that change one take a copy."""
    folder = test_inputs.make_inputs(HOTPATH)
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def commands() -> dict[tuple[str, ...], Any]:
    """The help text of each command, by its words."""
    found = commands_below()
    assert len(found) > 15
    return found
