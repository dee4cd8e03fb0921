# SPDX-License-Identifier: Apache-2.0
"""Measures the hot path of a graph under one executor, on the real ROS 2 stack unless told otherwise:

ros2 launch hotpath hot_path.launch.py executor:=rm-ro duration:=60
"""

import shlex

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteProcess,
    OpaqueFunction,
    RegisterEventHandler,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

# Options of `hotpath run`: their defaults, and what they are.
OPTIONS = {
    "executor": ("rm-ro", "a name from `hotpath list executors`"),
    "graph": ("autoware", "a name from `hotpath list graphs`, or the absolute path of a file"),
    "duration": ("60", "seconds"),
    "stack": ("rclcpp", "rclcpp (the real ROS 2 stack) or native"),
    "domain": ("0", "DDS domain"),
}


def start(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """The benchmark, with whose end the launch ends."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    words = ["--repetitions=1", *(f"--{name}={value(name)}" for name in OPTIONS)]
    run = ExecuteProcess(cmd=["hotpath", "run", *words, *shlex.split(value("options"))], output="screen")
    end = RegisterEventHandler(OnProcessExit(target_action=run, on_exit=[EmitEvent(event=Shutdown())]))
    return [run, end]


def generate_launch_description() -> LaunchDescription:
    """Arguments for the options above, and one for all others of `hotpath run`."""
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=about)
        for name, (default, about) in OPTIONS.items()
    ]
    others = DeclareLaunchArgument(
        "options", default_value="", description="further options of `hotpath run`"
    )
    return LaunchDescription([*arguments, others, OpaqueFunction(function=start)])
