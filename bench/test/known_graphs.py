# SPDX-License-Identifier: Apache-2.0
"""The graphs of the whole-program tests, described independently of their YAML files."""

from dataclasses import dataclass, field
from typing import Any


@dataclass
class Node:
    name: str
    kind: str
    inputs: list = field(default_factory=list)
    outputs: list = field(default_factory=list)  # parallel to the inputs of an intersection
    period_ms: int = 0


@dataclass
class KnownGraph:
    nodes: list[Any]  # in creation order
    chains: dict[str, Any]  # name: (source nodes, sink node)

    def timers(self) -> dict[Any, Any]:
        return {n.name: n.period_ms * 1_000_000 for n in self.nodes if n.period_ms}

    def subscriptions(self) -> list[Any]:
        return [f"{n.name}/{topic}" for n in self.nodes for topic in n.inputs]

    def publishers(self, topic: str) -> Any:
        """Tasks whose jobs publish to the topic."""
        tasks = []
        for n in self.nodes:
            if n.kind == "intersection":
                tasks += [f"{n.name}/{i}" for i, o in zip(n.inputs, n.outputs) if o == topic]
            elif topic in n.outputs:
                tasks += [n.name] if n.period_ms else [f"{n.name}/{i}" for i in n.inputs]
        return tasks


def sensor(name: str, period_ms: int, output: Any = None) -> Any:
    return Node(name, "sensor", [], [output or name], period_ms)


def transform(name: str, topic: str, output: Any = None) -> Any:
    return Node(name, "transform", [topic], [output or name])


def fusion(name: str, *topics: str) -> Any:
    return Node(name, "fusion", list(topics), [name])


def command(name: str, topic: str) -> Any:
    return Node(name, "command", [topic])


AUTOWARE = KnownGraph(
    [
        sensor("FrontLidarDriver", 100),
        sensor("RearLidarDriver", 100),
        sensor("PointCloudMap", 120),
        sensor("Visualizer", 60),
        sensor("Lanelet2Map", 100),
        sensor("EuclideanClusterSettings", 25),
        transform("PointsTransformerFront", "FrontLidarDriver"),
        transform("PointsTransformerRear", "RearLidarDriver"),
        transform("VoxelGridDownsampler", "PointCloudFusion"),
        transform("PointCloudMapLoader", "PointCloudMap"),
        transform("RayGroundFilter", "PointCloudFusion"),
        transform("ObjectCollisionEstimator", "EuclideanClusterDetector"),
        transform("MPCController", "BehaviorPlanner"),
        transform("ParkingPlanner", "Lanelet2MapLoader"),
        transform("LanePlanner", "Lanelet2MapLoader"),
        fusion("PointCloudFusion", "PointsTransformerFront", "PointsTransformerRear"),
        fusion("NDTLocalizer", "VoxelGridDownsampler", "PointCloudMapLoader"),
        fusion("VehicleInterface", "MPCController", "BehaviorPlanner"),
        fusion("Lanelet2GlobalPlanner", "Visualizer", "NDTLocalizer"),
        fusion("Lanelet2MapLoader", "Lanelet2Map", "Lanelet2GlobalPlanner"),
        Node(
            "BehaviorPlanner",
            "cyclic",
            [
                "ObjectCollisionEstimator",
                "NDTLocalizer",
                "Lanelet2GlobalPlanner",
                "Lanelet2MapLoader",
                "ParkingPlanner",
                "LanePlanner",
            ],
            ["BehaviorPlanner"],
            100,
        ),
        Node(
            "EuclideanClusterDetector",
            "intersection",
            ["RayGroundFilter", "EuclideanClusterSettings"],
            ["EuclideanClusterDetector", "EuclideanIntersection"],
        ),
        command("VehicleDBWSystem", "VehicleInterface"),
        command("IntersectionOutput", "EuclideanIntersection"),
    ],
    {"hot_path": ({"FrontLidarDriver", "RearLidarDriver"}, "ObjectCollisionEstimator")},
)

SEQUENCES = KnownGraph(
    [
        sensor("LidarDriver", 200),
        transform("PointsTransformer", "LidarDriver"),
        transform("Localization", "PointsTransformer"),
        sensor("FrontCamera", 84),
        transform("ImageProcessingFront", "FrontCamera"),
        transform("LaneDetection", "ImageProcessingFront"),
        sensor("IMU", 30),
    ],
    {
        "localization": ({"LidarDriver"}, "Localization"),
        "lane_detection": ({"FrontCamera"}, "LaneDetection"),
    },
)

MANY_TO_MANY = KnownGraph(
    [
        sensor("SensorA", 25, "Data"),
        sensor("SensorB", 41, "Data"),
        sensor("SensorC", 51, "Data"),
        transform("ProcessorX", "Data", "Sink"),
        transform("ProcessorY", "Data", "Sink"),
        command("SinkLogger", "Sink"),
    ],
    {f"sensor_{s.lower()}": ({f"Sensor{s}"}, "SinkLogger") for s in "ABC"},
)

TIMERS_ONLY = KnownGraph(
    [sensor(f"{n}LidarDriver", 200) for n in ("Front", "Rear")]
    + [sensor(f"{n}Camera", 84) for n in ("Front", "Rear", "Left", "Right")]
    + [sensor("IMU", 30)],
    {},
)
