# SPDX-License-Identifier: Apache-2.0
"""The bridge to ROS 1 alone, for a benchmark that runs elsewhere with `hotpath run --live`:

ros2 launch hotpath bridge.launch.py domain:=7

It needs a running roscore, and hotpath_ros1_bridge on PATH: the Debian package hotpath-ros1-bridge.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description() -> LaunchDescription:
    """The bridge with the parameters that ros1_bridge/README.md lists."""
    value = LaunchConfiguration
    bridge = ExecuteProcess(
        cmd=[
            "hotpath_ros1_bridge",
            ["--domain=", value("domain")],
            ["__ns:=", value("ns")],
            ["_chains:=", value("chains")],
            ["_all_interfaces:=", value("all_interfaces")],
        ],
        output="screen",
    )
    about_chains = "chains whose latency is published, separated by commas; empty: all"
    return LaunchDescription(
        [
            DeclareLaunchArgument("domain", default_value="0", description="DDS domain of the benchmark"),
            DeclareLaunchArgument(
                "ns", default_value="/", description="namespace of the bridge and its topics"
            ),
            DeclareLaunchArgument("chains", default_value="", description=about_chains),
            DeclareLaunchArgument(
                "all_interfaces", default_value="false", description="also receives from other machines"
            ),
            bridge,
        ]
    )
