# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the tests that are tables of cases."""

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hotpath_command
import test_inputs
from adverse_tables import PLACES
from hotpath_command import HOTPATH, CommandTest, commands_below


@pytest.fixture
def shell(stock: Path) -> Iterator[CommandTest]:
    """Runs command lines of adverse_tables.py in a folder of its own, outside of a ROS 2 workspace."""
    case = CommandTest()
    case.setUp()
    case.places = PLACES | {"stock": stock}
    for name in ("AMENT_PREFIX_PATH", "HOTPATH_ROS2_RUNNER", "ROS_DISTRO"):
        case.environment.pop(name, None)
    yield case
    hotpath_command.clean_up(case)


@pytest.fixture(scope="session")
def stock() -> Iterator[Path]:
    """A folder with one small file of each format; tests that change one take a copy."""
    folder = test_inputs.make_inputs(HOTPATH)
    subprocess.run(["chmod", "-R", "a+rX", folder], check=True)  # some tests read it as another user
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def commands() -> dict[tuple[str, ...], Any]:
    """The help text of each command, by its words."""
    found = commands_below()
    assert len(found) > 15
    return found
