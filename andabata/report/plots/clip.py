"""Clip of a drive: laser points of the last half turn, and cells of the virtual scan in colour.

The view is cast with the world's own rays, from a camera that follows the robot; no screen and no
graphics card are needed.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.drive_frames import DriveFrame, FrameSource
from andabata.report.plots.film import film
from traversability.grid import PolarGrid
from worlds.rays.scene import RayScene
from worlds.walking import cover_rays

WIDTH, HEIGHT = 480, 300
"""Size of the picture [pixels]."""

_SAMPLES = 2
"""Number of rays along an edge of a pixel."""

MAX_FRAMES = 320
"""Largest number of frames that a recorder keeps."""

_MAX_POINTS = 6000
"""Largest number of laser points of a frame."""

_NEW = 0.3
"""Age below which laser points are drawn as the beam of the moment [s]."""

_BACK, _UP, _AHEAD = 8.0, 5.5, 4.0
"""Place of the camera behind and above the robot, and of the point it looks at ahead [m]."""

_NEAR = 5.5
"""Distance from the camera at which its rays begin, past crowns that would hide the robot [m]."""

_TINT_HEIGHT = 1.5
"""Height above the robot's foot up to which surfaces take the colour of their cell [m]."""

_FOCAL = 0.9
"""Focal length over the width of the picture."""

_TURN_BLEND = 0.08
"""Share of the robot's turn that the camera follows from frame to frame."""

_SUN = np.array([0.4, -0.5, 0.77])
"""Unit vector towards the sun."""

_FREE, _BLOCKED = np.array([70, 180, 80]), np.array([215, 65, 55])
_SKY, _PATH_COLOUR, _BEAM, _POINT = (200, 222, 240), (208, 0, 111), (255, 210, 40), (35, 60, 150)
_BODY, _LASER = (45, 50, 60), (235, 120, 30)


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
        self.frames.append(self._source.frame(result, with_plan=False).thinned(_MAX_POINTS))
        if len(self.frames) == MAX_FRAMES:
            # A longer drive gets wider spaced frames, so that memory has a bound.
            self.frames = self.frames[1::2]
            self._interval *= 2

    def film(self, kind: str = ".gif", seconds: float = 8.0, rate: float = 10.0) -> bytes:
        """Return the drive as a film's file.

        Args:
            kind: End of the file's name: ``.gif`` or ``.mp4``.
            seconds: Longest duration of the clip [s]; longer drives are shown faster.
            rate: Number of pictures a second [Hz].

        Raises:
            FilmError: If there is no ffmpeg for an MP4.
            ValueError: If there are no frames.
        """
        if not self.frames:
            raise ValueError("clip: expected a drive of two steps or more, got a shorter one")
        count = min(len(self.frames), max(1, round(seconds * rate)))
        chosen = np.linspace(0, len(self.frames) - 1, count).round().astype(int)
        path, yaw, pictures = np.array(self.positions), self.frames[0].pose.yaw, []
        for frame in (self.frames[number] for number in chosen):
            turn = (frame.pose.yaw - yaw + np.pi) % (2 * np.pi) - np.pi
            yaw += _TURN_BLEND * turn
            camera = Camera.behind(frame.pose, yaw)
            shown = path[: frame.n_positions]
            pictures.append(_picture(frame, shown, camera, self._scene.rays, self._config))
        return film(pictures, rate, kind)


class Camera(NamedTuple):
    """A pinhole camera in the map.

    Attributes:
        place: Position [m], shape (3,).
        axes: Rows: unit vectors to the right, down and forward, shape (3, 3).
    """

    place: NDArray[np.float64]
    axes: NDArray[np.float64]

    @classmethod
    def behind(cls, pose: Pose, yaw: float) -> "Camera":
        """Return a camera that looks over the robot's shoulder along a yaw [rad]."""
        ahead = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        place = pose.position - _BACK * ahead + [0.0, 0.0, _UP]
        forward = pose.position + _AHEAD * ahead - place
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return cls(place, np.stack([right, np.cross(forward, right), forward]))

    def rays(self, width: int, height: int) -> NDArray[np.float32]:
        """Return a ray for each pixel, row by row, float32, shape (height * width, 6).

        Each begins ``_NEAR`` metres from the camera.
        """
        u = (np.arange(width) + 0.5 - width / 2) / (_FOCAL * width)
        v = (np.arange(height) + 0.5 - height / 2) / (_FOCAL * width)
        columns, rows = np.meshgrid(u, v)
        directions = np.stack([columns, rows, np.ones_like(columns)], axis=-1) @ self.axes
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        origins = self.place + _NEAR * directions
        return np.concatenate([origins, directions], axis=-1).reshape(-1, 6).astype(np.float32)

    def project(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return column, row [pixels] and distance [m] of points, shape (n, 3); NaN behind."""
        x, y, z = self.axes @ (points.astype(np.float64) - self.place).T
        depth = np.where(z > 0.1, z, np.nan)
        column = WIDTH / 2 + _FOCAL * WIDTH * x / depth
        row = HEIGHT / 2 + _FOCAL * WIDTH * y / depth
        distance = np.linalg.norm(points - self.place, axis=1)
        return np.stack([column, row, np.where(np.isfinite(depth), distance, np.nan)], axis=1)


def _picture(
    frame: DriveFrame,
    path: NDArray[np.float64],
    camera: Camera,
    rays: RayScene,
    config: SimulatedRobotConfig,
) -> Image.Image:
    """Return one picture: the world, the cells on it, laser points, path and robot."""
    width, height = _SAMPLES * WIDTH, _SAMPLES * HEIGHT
    lines = camera.rays(width, height)
    # Without an optical depth porous objects stop every ray: what is drawn is their hull.
    depths = np.zeros(len(lines), dtype=np.float32)
    ranges, classes = rays.cast(lines, depths, 120.0)
    if frame.walkers is not None:
        times = np.full(len(lines), frame.walkers.latest)
        cover_rays(lines, times, frame.walkers, 120.0, ranges, classes)
    hits = np.asarray(
        lines[:, :3] + lines[:, 3:] * np.where(np.isfinite(ranges), ranges, 120.0)[:, None],
        dtype=np.float64,
    )
    shade = _shade(hits.reshape(height, width, 3)).reshape(-1, 1)
    colours = CLASS_COLOURS[classes].astype(np.float64) * shade
    colours = _tinted(colours, hits, frame, config.grid)
    colours[~np.isfinite(ranges)] = _SKY
    colours = colours.reshape(HEIGHT, _SAMPLES, WIDTH, _SAMPLES, 3).mean(axis=(1, 3))
    image = Image.fromarray(colours.clip(0, 255).astype(np.uint8))
    seen = _NEAR + ranges.reshape(height, width)[::_SAMPLES, ::_SAMPLES]
    draw = ImageDraw.Draw(image)
    points, ages = frame.points()
    _draw_points(draw, camera.project(points), ages, seen)
    _draw_path(draw, camera.project(path + np.array([0.0, 0.0, 0.15])), seen)
    _draw_robot(draw, camera, frame.pose, config.robot)
    return image


def _shade(hits: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the brightness of hits by the sun on their normals, shape (height, width)."""
    across = np.gradient(hits, axis=1)
    down = np.gradient(hits, axis=0)
    normals = np.cross(across, down)
    length = np.linalg.norm(normals, axis=-1)
    facing = np.abs(normals @ _SUN) / np.maximum(length, 1e-9)
    return np.asarray(0.55 + 0.55 * facing)


def _tinted(
    colours: NDArray[np.float64], hits: NDArray[np.float64], frame: DriveFrame, grid: PolarGrid
) -> NDArray[np.float64]:
    """Return colours with the polar cells of the virtual scan on them."""
    if frame.scan is None:
        return colours
    x, y, z = (hits - frame.pose.position).T
    rings = np.searchsorted(grid.ring_edges, np.hypot(x, y), side="right") - 1
    # Crowns overhead stay as they are: cells are about the ground and what stands on it.
    inside = (rings >= 0) & (rings < grid.n_rings) & (z < _TINT_HEIGHT)
    bearing = np.arctan2(y, x) - frame.pose.yaw
    sectors = ((bearing / (2 * np.pi) + 1.5) * grid.n_sectors).astype(int) % grid.n_sectors
    log_odds = frame.scan.log_odds_of(grid)[sectors, np.where(inside, rings, 0)]
    found = colours.copy()
    for chosen, tint in ((log_odds < 0, _FREE), (log_odds >= 0, _BLOCKED)):
        found[chosen & inside] = 0.6 * found[chosen & inside] + 0.4 * tint
    return found


def _visible(
    projected: NDArray[np.float64], seen: NDArray[np.float32], slack: float
) -> NDArray[np.bool_]:
    """Return which projected points are in the picture and not behind something, shape (n,)."""
    column, row, distance = projected.T
    with np.errstate(invalid="ignore"):
        inside = (column >= 0) & (column < WIDTH) & (row >= 0) & (row < HEIGHT)
    i = np.where(inside, np.nan_to_num(row), 0).astype(int)
    j = np.where(inside, np.nan_to_num(column), 0).astype(int)
    return np.asarray(inside & (distance < seen[i, j] + slack))


def _draw_points(
    draw: ImageDraw.ImageDraw,
    projected: NDArray[np.float64],
    ages: NDArray[np.float32],
    seen: NDArray[np.float32],
) -> None:
    """Draw laser points, those of the moment last and in the colour of the beam."""
    shown = _visible(projected, seen, 0.4)
    for chosen, colour, size in ((ages >= _NEW, _POINT, 0), (ages < _NEW, _BEAM, 1)):
        for column, row, _ in projected[shown & chosen]:
            draw.rectangle((column, row, column + size, row + size), fill=colour)


def _draw_path(
    draw: ImageDraw.ImageDraw, projected: NDArray[np.float64], seen: NDArray[np.float32]
) -> None:
    """Draw the path behind the robot."""
    shown = _visible(projected, seen, 0.6)
    for k in range(1, len(projected)):
        if shown[k] and shown[k - 1]:
            draw.line([*projected[k - 1, :2], *projected[k, :2]], fill=_PATH_COLOUR, width=2)


def _draw_robot(draw: ImageDraw.ImageDraw, camera: Camera, pose: Pose, robot: RobotModel) -> None:
    """Draw the body as a box and the turning laser on it as a disc."""
    half = np.array([robot.length, robot.width, 0.0]) / 2
    corners = np.array([[x, y, z] for z in (0.08, 0.4) for x, y in _CORNERS])
    corners[:, :2] *= half[:2]
    placed = corners @ pose.matrix[:3, :3].T + pose.matrix[:3, 3]
    projected = camera.project(placed)
    order = sorted(_FACES, key=lambda face: -float(projected[list(face), 2].mean()))
    for face in order:
        outline = [(float(x), float(y)) for x, y, _ in projected[list(face)]]
        draw.polygon(outline, fill=_BODY, outline=(90, 95, 105))
    top = pose.matrix[:3] @ np.array([0.0, 0.0, robot.lidar_height, 1.0])
    ((x, y, distance),) = camera.project(top[None])
    radius = 0.09 * _FOCAL * WIDTH / distance
    foot = projected[4:, :2].mean(axis=0)
    draw.line([*foot, x, y], fill=_BODY, width=3)
    draw.ellipse((x - radius, y - radius, x + radius, y + radius), fill=_LASER)


_CORNERS = ((1, 1), (1, -1), (-1, -1), (-1, 1))
_FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
"""Corners of the box, and its faces by their numbers."""
