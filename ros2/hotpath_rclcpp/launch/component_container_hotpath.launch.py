# SPDX-License-Identifier: Apache-2.0
"""A component container under PriorityExecutor, into which `ros2 component load` loads nodes:

ros2 launch hotpath_rclcpp component_container_hotpath.launch.py config:=/path/to/executor.yaml
ros2 launch hotpath_rclcpp component_container_hotpath.launch.py executor:=edf-ro timer_thread:=fifo:90

Include it in a launch file of your system, and give LoadComposableNodes the container's name.
"""

from launch import LaunchContext, LaunchDescription, LaunchDescriptionEntity
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# Parameters of component_container_hotpath: their types, and what they set.
PARAMETERS = {
    "config": (str, "YAML file with all options, as `hotpath advise` writes it; the others override it"),
    "executor": (str, "rm-ro, edf-ro, fp-ro, ...: see `hotpath list executors`"),
    "threads": (int, "number of threads that run callbacks"),
    "priorities": (str, "file of priorities for fp-*"),
    "graph": (str, "graph along which priorities are inherited, a path or a bare name"),
    "offsets": (str, "file of phases for the timers of `graph`"),
    "learn": (bool, "whether to learn which callback feeds which; true or false"),
    "service_wait_ms": (int, "longest wait of services before they run next, in ms; 0: no limit"),
    "timer_thread": (str, "required policy of the timer thread, such as fifo:90"),
    "executor_threads": (str, "required policy of the threads that run callbacks"),
    "middleware_threads": (str, "required policy of the threads in which the middleware receives samples"),
}
WORDS = {"true": True, "false": False}


def start(context: LaunchContext) -> list[LaunchDescriptionEntity]:
    """The container with the parameters that were given; the others keep the container's defaults."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    parameters: dict[str, str | int | bool] = {}
    for name, (kind, _) in PARAMETERS.items():
        if text := value(name):
            if kind is bool and text not in WORDS:
                raise ValueError(f"{name}:={text}: give true or false")
            parameters[name] = WORDS[text] if kind is bool else kind(text)
    container = Node(
        package="hotpath_rclcpp",
        executable="component_container_hotpath",
        name=value("name"),
        namespace=value("namespace"),
        parameters=[parameters],
        output="screen",
    )
    return [container]


def generate_launch_description() -> LaunchDescription:
    """Arguments for the container's name and for each of its parameters."""
    arguments = [
        DeclareLaunchArgument("name", default_value="container", description="name of the container's node"),
        DeclareLaunchArgument("namespace", default_value="", description="its namespace"),
    ]
    for name, (_, about) in PARAMETERS.items():
        arguments.append(DeclareLaunchArgument(name, default_value="", description=about))
    return LaunchDescription([*arguments, OpaqueFunction(function=start)])
