"""Options of ``ros navigator``: where to start, where to go, how long, and what to publish."""

from dataclasses import dataclass
from typing import Annotated

import typer


@dataclass(frozen=True)
class LiveDriveOptions:
    """Drive in a live graph: ``--start``, ``--goal``, ``--seconds``, ``--map``."""

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
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, help="Time after which to stop, in seconds; by default on Ctrl-C."),
    ] = None
    local_map: Annotated[
        bool,
        typer.Option(
            "--map/--no-map",
            help="Publish the local map, the plan and map -> odom too, for Nav2 and grid_map.",
        ),
    ] = True

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
