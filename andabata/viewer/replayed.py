"""View of a recording: what the navigator makes of it, now."""

import math
from collections.abc import Callable
from pathlib import Path

from andabata.assembly.navigator import NavigatorParts
from andabata.machine.clock import CONTROL_PERIOD
from andabata.navigation.navigator import StepResult
from andabata.replay.recorded_drive import RecordedDrive
from andabata.report.drive_frames import FrameSource
from andabata.viewer.drive_view import DriveView
from andabata.viewer.export import EXPORT_PERIOD, EXPORT_POINTS, PageWriter
from andabata.viewer.offroad_scene import OffroadScene
from andabata.viewer.options import ViewConfig
from andabata.viewer.server import ViewServer
from worlds.catalogue import make_world
from worlds.splits import evaluation_world
from worlds.world import World


class ReplayView(DriveView):
    """View of a replay: its pace is the viewers', its commands are the navigator's."""

    def __init__(self, config: ViewConfig, status: Callable[[str], None]) -> None:
        """Begin to serve.

        Args:
            config: Choices of who watches.
            status: Function that prints a line for the user.

        Raises:
            ViewerError: If viser is not installed.
        """
        super().__init__(config, "andabata view", status)

    def watch_replay(self, parts: NavigatorParts, drive: RecordedDrive) -> None:
        """Watch a navigator that is sent a recording."""
        source = FrameSource(parts.navigator, parts.localizer, parts.perception)
        self.watch(parts.navigator, source, drive.config, recorded_world(drive))


class ReplayPage:
    """Writes a replay as a page that plays by itself."""

    def __init__(self, path: Path) -> None:
        """Begin with an empty scene.

        Args:
            path: File to write.

        Raises:
            ViewerError: If viser is not installed.
        """
        self._server = ViewServer("andabata view", 0)
        self._page = PageWriter(self._server.viser, path)
        self._drawn = -math.inf

    def __enter__(self) -> "ReplayPage":
        """Return the page."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        """Write the file, unless the replay has failed."""
        if math.isfinite(self._drawn):
            self._page.__exit__(kind, *error)
        self._server.close()

    def watch_replay(self, parts: NavigatorParts, drive: RecordedDrive) -> None:
        """Draw the steps of a navigator that is sent a recording."""
        self._source = FrameSource(parts.navigator, parts.localizer, parts.perception)
        world = recorded_world(drive)
        self._scene = OffroadScene(self._server.viser, drive.config, world, EXPORT_POINTS)
        parts.navigator.spectators.append(self._draw)

    def attend(self) -> None:
        """Wait for nothing."""

    def _draw(self, result: StepResult) -> None:
        """Draw a step if it is time for one."""
        self._source.advance(result)
        stamp = result.readings.stamp
        if stamp - self._drawn < EXPORT_PERIOD - CONTROL_PERIOD / 2:
            return
        if math.isfinite(self._drawn):
            self._page.hold(max(stamp - self._drawn, 0.0))
        self._scene.draw(self._source.frame(result), self._source.positions)
        if not math.isfinite(self._drawn):
            self._page.__enter__()
        self._drawn = stamp


def recorded_world(drive: RecordedDrive) -> World | None:
    """Return the world that a simulated robot recorded its drive in; None of any other recording.

    Args:
        drive: Recorded drive.
    """
    name, seed = drive.settings.get("world"), drive.settings.get("seed")
    if not isinstance(name, str) or not isinstance(seed, int):
        return None
    try:
        return make_world(name, evaluation_world(seed, 0))
    except (ValueError, OSError):
        # A world of another version, or a file that is not here.
        return None
