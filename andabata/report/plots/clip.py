"""Clip of a drive: the robot, its laser points, polar cells in colour, plan and goal, in its world.

The view is cast with the world's own rays, from a camera that follows the robot; no screen and no
graphics card are needed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.machine.pose import Pose, wrap
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.report.drive_frames import DriveFrame, FrameSource
from andabata.report.plots.drive_picture import LEGEND_COLOURS, draw_drive
from andabata.report.plots.film import PICTURE, film
from andabata.report.rendering.camera import Camera
from andabata.report.rendering.scenery import Scenery

WIDTH, HEIGHT = 480, 300
"""Size of a picture of a film [pixels]."""

STILL_WIDTH, STILL_HEIGHT = 1200, 675
"""Size of a single picture [pixels]."""

MAX_FRAMES = 320
"""Largest number of frames that a recorder keeps."""

_MAX_POINTS = 6000
"""Largest number of laser points of a frame."""

_RATES = {".gif": 6.0, ".mp4": 10.0}
"""Number of pictures a second by the end of a film's name [Hz]."""

_TURN_BLEND = 0.08
"""Share of the robot's turn that the camera follows from frame to frame."""


class Stand(NamedTuple):
    """Place of a camera relative to the robot.

    Attributes:
        back: Distance behind the robot [m].
        up: Height above it [m].
        ahead: Distance before it of the point that the camera looks at [m].
        aside: Distance to the robot's left [m].
    """

    back: float
    up: float
    ahead: float
    aside: float = 0.0

    def camera(self, pose: Pose, yaw: float, size: tuple[int, int]) -> Camera:
        """Return a camera that looks over the robot's shoulder.

        Args:
            pose: Pose of the robot.
            yaw: Direction of the view [rad].
            size: Width and height of the picture [pixels].
        """
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        left = np.array([-ahead[1], ahead[0], 0.0])
        eye = pose.position - self.back * ahead + self.aside * left + [0.0, 0.0, self.up]
        return Camera.looking_at(eye, pose.position + self.ahead * ahead, size)


_FOLLOWING = Stand(back=6.5, up=5.0, ahead=3.5)
"""Place of the camera of a film."""

_OVERLOOKING = Stand(back=9.0, up=5.5, ahead=9.0, aside=2.0)
"""Place of the camera of a single picture."""


class ClipRecorder:
    """Observer of a navigator that keeps the frames of a clip.

    Attributes:
        frames: Frames so far, evenly spaced in time, fewer than ``MAX_FRAMES``.
    """

    def __init__(self, simulated_robot: SimulatedRobot) -> None:
        """Begin without frames and watch a robot's navigator.

        Args:
            simulated_robot: Robot that drives.

        Raises:
            ValueError: If the robot makes no clouds.
        """
        if assembler_of(simulated_robot.perception) is None:
            raise ValueError(
                "clip: expected a robot with the rotating laser, got the horizontal scanner; "
                "leave out --clip"
            )
        self._source = FrameSource(
            simulated_robot.navigator,
            simulated_robot.localizer,
            simulated_robot.perception,
            simulated_robot.simulator.walkers,
        )
        self._scene, self._config = simulated_robot.scene, simulated_robot.config
        self._interval = 2
        self.frames: list[DriveFrame] = []
        simulated_robot.navigator.observers.append(self)

    @property
    def positions(self) -> list[NDArray[np.float64]]:
        """True positions so far [m], each of shape (3,)."""
        return self._source.positions

    def __call__(self, result: StepResult) -> None:
        """Keep a control step, one in as many as the drive's length asks for."""
        self._source.advance(result)
        if len(self.positions) % self._interval:
            return
        self.frames.append(self._source.frame(result).thinned(_MAX_POINTS))
        if len(self.frames) == MAX_FRAMES:
            # A longer drive gets wider spaced frames, so that memory has a bound.
            self.frames = self.frames[1::2]
            self._interval *= 2

    def film(self, kind: str = ".gif", seconds: float = 8.0, rate: float | None = None) -> bytes:
        """Return the drive as a film's file, or its last moment as a picture's.

        Args:
            kind: End of the file's name: ``.gif`` or ``.mp4``, ``.png`` for a single picture.
            seconds: Longest duration of the clip [s]; longer drives are shown faster.
            rate: Number of pictures a second [Hz]; None for few in a GIF, which holds each whole.

        Raises:
            FilmError: If there is no ffmpeg for an MP4.
            ValueError: If there are no frames.
        """
        if not self.frames:
            raise ValueError("clip: expected a drive of two steps or more, got a shorter one")
        scenery, rate = Scenery(self._scene.world), rate or _RATES.get(kind, 1.0)
        if kind == PICTURE:
            pose = self.frames[-1].pose
            size = (STILL_WIDTH, STILL_HEIGHT)
            camera = _OVERLOOKING.camera(pose, pose.yaw, size)
            return film([self._picture(self.frames[-1], camera, scenery)], rate, kind)
        count = min(len(self.frames), max(1, round(seconds * rate)))
        chosen = np.linspace(0, len(self.frames) - 1, count).round().astype(int)
        yaw, pictures = self.frames[0].pose.yaw, []
        for frame in (self.frames[number] for number in chosen):
            yaw += _TURN_BLEND * wrap(frame.pose.yaw - yaw)
            camera = _FOLLOWING.camera(frame.pose, yaw, (WIDTH, HEIGHT))
            pictures.append(self._picture(frame, camera, scenery))
        return film(pictures, rate, kind, LEGEND_COLOURS)

    def _picture(self, frame: DriveFrame, camera: Camera, scenery: Scenery) -> Image.Image:
        """Return the picture of a frame."""
        path = np.array(self.positions[: frame.n_positions])
        return draw_drive(frame, path, camera, scenery, self._config.grid, self._config.robot)
