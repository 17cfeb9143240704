"""Groups of options of ``andabata drive``."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from andabata.evaluation.drive import Recording

Controller = Annotated[
    str | None,
    typer.Option(
        help="planner, policy+planner, policy, imitation+planner, imitation, actor-critic, "
        "reactive, reactive+planner, straight, random+planner, away+planner or oracle. The "
        "default is planner, beside --policy policy+planner."
    ),
]
Record = Annotated[
    Path | None,
    typer.Option(help="Record to this file: .bag (ROS 1), .mcap or .db3 (ROS 2)."),
]
Clouds = Annotated[bool, typer.Option(help="Record the clouds too: 8 MB a second.")]
LocalMap = Annotated[
    bool,
    typer.Option(
        "--map/--no-map",
        help="Record the local map, the plan and the heading error too, for Nav2, grid_map "
        "and Foxglove.",
    ),
]
Goals = Annotated[
    list[str] | None,
    typer.Option(
        metavar="X,Y",
        help="Goal of your own in the map, in metres, instead of the world's; may be repeated.",
    ),
]
Clip = Annotated[
    Path | None,
    typer.Option(
        help="Draw the drive as a moving picture: a .gif, or an .mp4 where there is ffmpeg; a "
        ".png is a picture of its last moment."
    ),
]


@dataclass(frozen=True)
class RecordOptions:
    """Recording of a drive: ``--record``, ``--clouds``, ``--map``."""

    record: Record = None
    clouds: Clouds = True
    local_map: LocalMap = True

    def recording(self) -> "Recording | None":
        """Return the recording to write, or None."""
        from andabata.evaluation.drive import Recording

        return Recording(self.record, self.clouds, self.local_map) if self.record else None


@dataclass(frozen=True)
class ClipOptions:
    """Moving picture of a drive: ``--clip``."""

    clip: Clip = None

    def checked(self) -> Path | None:
        """Return the file of the moving picture, or None.

        Raises:
            UsageError: If its format cannot be written here.
        """
        from andabata.configuration.usage import UsageError
        from andabata.report.plots.film import FilmError, check_film

        if self.clip is not None:
            try:
                check_film(self.clip)
            except FilmError as error:
                raise UsageError(str(error)) from error
        return self.clip
