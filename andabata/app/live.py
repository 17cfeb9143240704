"""Nodes in a live graph, from the start of the graph to its end."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from andabata.app.console import Console
from andabata.app.driven_plant import announce_plant
from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.records.frames.sensor_pose import GivenMounting
from andabata.records.topics import PATH, POINT_CLOUD, Topic
from andabata.replay.datum import given_geo_reference
from andabata.ros.graph import Graph
from andabata.ros.live_recording import LiveRecording
from andabata.ros.navigator_node import NavigatorNode
from andabata.ros.navigator_output import OutputForm
from andabata.ros.robot_node import RobotNode
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.viewer.options import ViewConfig
from andabata.viewer.robot_view import RobotView
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world

OpenGraph = Callable[[str], Graph]
"""Function that joins a graph as a node of a name."""


def run_navigator(
    open_graph: OpenGraph,
    controller: str,
    configure: Callable[[SimulatedRobotConfig], SimulatedRobotConfig],
    base: SimulatedRobotConfig,
    models: Models,
    console: Console,
    *,
    cloud: str | None = None,
    mountings: Mapping[str, GivenMounting] | None = None,
    sources: Mapping[str, str] | None = None,
    start: tuple[float, ...] | None = None,
    goal: tuple[float, ...] | None = None,
    path: str | None = None,
    seconds: float | None = None,
    local_map: bool = True,
    view: ViewConfig | None = None,
    form: OutputForm | None = None,
    record: Path | None = None,
) -> dict[str, Any]:
    """Run the navigator in a live graph and return its figures, ready for JSON.

    Args:
        open_graph: Function that joins the graph.
        controller: Name of the controller.
        configure: Function that puts the user's settings over a configuration.
        base: Robot before the user's settings.
        models: Classifiers and policy.
        console: Console that shows the progress and the datum.
        cloud: Topic of a 3D laser; None for the turning laser's two.
        mountings: Mountings by sensor that the user gives.
        sources: Frame of the only source that is read, by topic.
        start: Position [m] and yaw [deg] in the map; None to wait for them in the graph.
        goal: First goal in the map [m]; None to wait for one in the graph.
        path: Topic of another planner's path to follow; None to drive to goals alone.
        seconds: Time after which to stop [s]; None to run until the graph ends.
        local_map: True to publish the local map and the plan.
        view: Choices of who watches in a browser; None for no such view.
        form: Form of the output; None for the paper's.
        record: Path of a recording of what is used and published; None for none.

    Raises:
        RosError: If ROS is not installed or there is no graph to join.
        ViewerError: If there is to be a view, and viser is not installed.
    """
    config = configure(base)
    steering = make_steering(controller, None, config, models)
    with _graph(open_graph, "andabata") as graph, _recording(record, graph) as recording:
        node = NavigatorNode(
            graph,
            config,
            models,
            steering,
            _topic(cloud, POINT_CLOUD),
            mountings or {},
            given_geo_reference(configure),
            console.status,
            local_map,
            sources,
            form,
            recording,
            _topic(path, PATH),
        )
        if goal is not None:
            node.set_goal(np.array(goal))
        with ExitStack() as stack, console.progress("seconds", None) as step:
            if view is not None:
                shown = stack.enter_context(RobotView(view, console.status))
                shown.watch_robot(node.parts, config, node.set_goal)
            return node.run(_pose(start), seconds, lambda: step(1))


def run_robot(
    open_graph: OpenGraph,
    world: str,
    seed: int,
    config: SimulatedRobotConfig,
    seconds: float,
    console: Console,
) -> dict[str, Any]:
    """Run a simulated robot in a live graph and return its figures, ready for JSON.

    Args:
        open_graph: Function that joins the graph.
        world: Preset of the world.
        seed: Seed of the drive.
        config: The robot.
        seconds: Longest drive to each goal [s].
        console: Console that shows the progress.

    Raises:
        PlantError: If the robot's plant is not installed.
        RosError: If ROS is not installed or there is no graph to join.
    """
    announce_plant(config.plant, console)
    scene = SceneCache(1).get(world, evaluation_world(seed, 0))
    # The robot may wait for its navigator without being stuck.
    rules = TerminationConfig(time_limit=seconds, stuck_time=max(seconds, 20.0))
    rng = np.random.default_rng([seed, 0, 1])
    with _graph(open_graph, "andabata_robot") as graph:
        node = RobotNode(graph, scene, config)
        with console.progress("seconds", None) as step:
            return node.run(scene.world.tasks[0], rng, rules, lambda: step(1))


@contextmanager
def _graph(open_graph: OpenGraph, name: str) -> Iterator[Graph]:
    """Join the graph as a node, and leave it at the end."""
    graph = open_graph(name)
    try:
        yield graph
    finally:
        graph.close()


@contextmanager
def _recording(path: Path | None, graph: Graph) -> Iterator[LiveRecording | None]:
    """Create a recording, and finish it at the end; None without a path."""
    recording = None if path is None else LiveRecording(path, graph.ros)
    try:
        yield recording
    finally:
        if recording is not None:
            recording.close()


def _topic(name: str | None, kind: str) -> Topic | None:
    """Return a topic that the user names, of a message type; None without a name."""
    return Topic(name, name, kind, None) if name else None


def _pose(start: tuple[float, ...] | None) -> Pose | None:
    """Return a level pose at a position [m] and a yaw [deg]."""
    if start is None:
        return None
    x, y, degrees = start
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, float(np.deg2rad(degrees)))
