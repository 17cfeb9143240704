"""Options of a live graph: where to start, where to go, how long, what to publish, and names."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from andabata.app.live import OpenGraph
    from andabata.ros.navigator_output import OutputForm

_GRAPH = "Graph"
"""Panel of the help."""


@dataclass(frozen=True)
class LiveDriveOptions:
    """Drive in a live graph: ``--start``, ``--goal``, ``--path``, ``--seconds`` and more."""

    start: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,YAW",
            help="Pose of the robot in the map, in metres and degrees; by default from "
            "/initialpose, or from the first fix and the compass.",
        ),
    ] = None
    goal: Annotated[
        str | None,
        typer.Option(metavar="X,Y", help="First goal, in metres; /goal gives others later."),
    ] = None
    path: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC",
            help="Follow another planner's nav_msgs/Path, as Nav2's /plan, rather than goals; our "
            "own /plan then needs another name.",
        ),
    ] = None
    seconds: Annotated[
        float | None,
        typer.Option(
            min=0.1,
            help="Duration of the drive, in seconds from the first pose on; by default until "
            "Ctrl-C.",
        ),
    ] = None
    local_map: Annotated[
        bool,
        typer.Option(
            "--map/--no-map",
            help="Publish the local map, the plan and map -> odom too, for Nav2 and grid_map.",
        ),
    ] = True
    record: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Record what the navigator uses and publishes, period by period, for `bag "
            "replay`: .mcap or .db3 in ROS 2, .bag in ROS 1.",
        ),
    ] = None

    def start_pose(self) -> tuple[float, ...] | None:
        """Return position [m] and yaw [deg] in the map, None to wait for them in the graph.

        Raises:
            UsageError: If the text is not three numbers.
        """
        from andabata.configuration.usage import numbers

        return None if self.start is None else numbers(self.start, 3, "--start")

    def first_goal(self) -> tuple[float, ...] | None:
        """Return the first goal in the map [m], None to wait for one in the graph.

        Raises:
            UsageError: If the text is not two numbers.
        """
        from andabata.configuration.usage import numbers

        return None if self.goal is None else numbers(self.goal, 2, "--goal")


@dataclass(frozen=True)
class OutputOptions:
    """Form of what the navigator publishes: ``--stamped``, ``--points``."""

    stamped: Annotated[
        bool,
        typer.Option(
            "--stamped",
            help="Publish /cmd_vel as TwistStamped, Nav2's type since Kilted, in place of Twist.",
            rich_help_panel=_GRAPH,
        ),
    ] = False
    points: Annotated[
        int,
        typer.Option(
            min=1,
            help="Largest number of points of a published cloud; larger ones are thinned.",
            rich_help_panel=_GRAPH,
        ),
    ] = 10_000

    def form(self) -> "OutputForm":
        """Return the form of the output in a ROS 2 graph."""
        from andabata.ros.navigator_output import OutputForm

        return OutputForm(self.stamped, self.points, latches_maps=True)


@dataclass(frozen=True)
class Ros2Options:
    """Node in a ROS 2 graph: ``--namespace``, ``--remap``, ``--use-sim-time``."""

    namespace: Annotated[
        str,
        typer.Option(
            metavar="/NAME",
            help="Prefix of the node and of all our topics, as /robot1.",
            rich_help_panel=_GRAPH,
        ),
    ] = ""
    remap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="OURS=THEIRS",
            help="Name of a topic in the graph, as /fix=/navsat/fix; may be repeated. "
            "/encoder_data may be a JointState, an Odometry or a TwistStamped.",
            rich_help_panel=_GRAPH,
        ),
    ] = None
    use_sim_time: Annotated[
        bool,
        typer.Option(
            "--use-sim-time",
            help="Take the time of /clock, as of a player.",
            rich_help_panel=_GRAPH,
        ),
    ] = False

    def opener(self, status: Callable[[str], None]) -> "OpenGraph":
        """Return the function that joins the graph as a node of a name.

        Args:
            status: Function that prints a line for the user.

        Raises:
            UsageError: If a renamed topic is not of the form ``a=b``.
            RosError: If there is no such topic, or a name is none of ROS 2.
        """
        from andabata.configuration.usage import pairs
        from andabata.ros.graph import TopicNames
        from andabata.ros.ros2_graph import Ros2Graph

        names = TopicNames(2, self.namespace, pairs(self.remap or (), "--remap"))
        return lambda name: Ros2Graph(name, names, self.use_sim_time, status)
