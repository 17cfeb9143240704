"""Options of the live view, shared by the commands that have one."""

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from andabata.viewer.options import ViewConfig

_VIEW = "Live view"

View = Annotated[
    bool,
    typer.Option(
        "--view",
        help="Show it live in a browser, on a page of this machine (extra `viewer`).",
        rich_help_panel=_VIEW,
    ),
]
ViewPort = Annotated[
    int,
    typer.Option(
        min=0,
        max=65535,
        help="Port of the page; the next free one where it is in use, 0 takes any.",
        rich_help_panel=_VIEW,
    ),
]
ViewPoints = Annotated[
    int,
    typer.Option(
        min=100, max=1_000_000, help="Largest number of laser points shown.", rich_help_panel=_VIEW
    ),
]
ViewSpeed = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=100.0,
        help="Seconds of the drive in a second at first; 0 is as fast as it goes.",
        rich_help_panel=_VIEW,
    ),
]

ViewWait = Annotated[
    bool,
    typer.Option(
        "--view-wait",
        help="With --view: begin the drive when the first page is open.",
        rich_help_panel=_VIEW,
    ),
]

AllowCommands = Annotated[
    bool,
    typer.Option(
        "--allow-commands",
        help="With --view: who has the printed link may send the robot to a goal. Keep it secret.",
        rich_help_panel=_VIEW,
    ),
]


@dataclass(frozen=True)
class PageOptions:
    """Page of a view: ``--view-port``, ``--view-points``, ``--view-speed``."""

    view_port: ViewPort = 8080
    view_points: ViewPoints = 32_000
    view_speed: ViewSpeed = 1.0

    def view_config(self) -> "ViewConfig":
        """Return the choices of who watches."""
        from andabata.viewer.options import ViewConfig

        return ViewConfig(self.view_port, self.view_points, self.view_speed or math.inf)


@dataclass(frozen=True)
class ViewOptions(PageOptions):
    """Live view of a command that can do without: ``--view`` and its page."""

    view: View = False


@dataclass(frozen=True)
class DriveViewOptions(ViewOptions):
    """Live view of a drive in simulation, which can wait for who watches: ``--view-wait``."""

    view_wait: ViewWait = False

    def wanted(self) -> "ViewConfig | None":
        """Return the choices of who watches; None without a view.

        Raises:
            UsageError: If the drive is to wait for a page, and there is none.
        """
        from andabata.configuration.usage import UsageError

        if self.view:
            return replace(self.view_config(), waits=self.view_wait)
        if self.view_wait:
            raise UsageError("--view-wait: expected --view beside it, got no live view")
        return None


@dataclass(frozen=True)
class RobotViewOptions(ViewOptions):
    """Live view of a real robot, which is watched alone unless told: ``--allow-commands``."""

    allow_commands: AllowCommands = False

    def wanted(self) -> "ViewConfig | None":
        """Return the choices of who watches; None without a view.

        Raises:
            UsageError: If pages are to command the robot, and there is none.
        """
        from andabata.configuration.usage import UsageError

        if self.view:
            return replace(self.view_config(), allow_commands=self.allow_commands)
        if self.allow_commands:
            raise UsageError("--allow-commands: expected --view beside it, got no live view")
        return None
