"""View of a robot that drives by itself in a live graph: watched, and sent to goals if allowed."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.navigator import NavigatorConfig, NavigatorParts
from andabata.report.drive_frames import FrameSource
from andabata.viewer.drive_view import DriveView
from andabata.viewer.options import ViewConfig


class RobotView(DriveView):
    """View of a live navigator. Nobody can hold it up: a robot that moves waits for no browser."""

    def __init__(self, config: ViewConfig, status: Callable[[str], None]) -> None:
        """Begin to serve.

        Args:
            config: Choices of who watches; the speed is the robot's own.
            status: Function that prints a line for the user.

        Raises:
            ViewerError: If viser is not installed.
        """
        live = replace(config, speed=math.inf, is_paused=False)
        self._allow_commands = config.allow_commands
        super().__init__(live, "andabata ros navigator", status, is_live=True)

    def watch_robot(
        self,
        parts: NavigatorParts,
        config: NavigatorConfig,
        set_goal: Callable[[NDArray[np.float64]], None],
    ) -> None:
        """Watch a navigator.

        Args:
            parts: Navigator with its localizer and its perception.
            config: Its settings.
            set_goal: Function that takes a goal in the map [m], shape (2,), from any thread. Pages
                have a control for it only where the choices allow commands.
        """
        source = FrameSource(parts.navigator, parts.localizer, parts.perception)
        allowed = set_goal if self._allow_commands else None
        self.watch(parts.navigator, source, config, None, set_goal=allowed)
