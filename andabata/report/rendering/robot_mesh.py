"""Mesh of a robot: body, wheels that turn, and the laser's head on its mast."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.rendering.lighting import lit

_HULL, _DECK, _TYRE, _TREAD, _HUB = (
    (52, 60, 74),
    (240, 160, 30),
    (30, 30, 33),
    (66, 66, 70),
    (205, 205, 210),
)
_HEAD, _WINDOW = (235, 120, 30), (20, 20, 24)

_SIDES = 16
"""Number of corners of a wheel."""


class Mesh(NamedTuple):
    """Triangles with colours.

    Attributes:
        corners: Corners [m], counter-clockwise from outside, shape (n, 3, 3).
        colours: Colours, shape (n, 3).
    """

    corners: NDArray[np.float64]
    colours: NDArray[np.float64]

    def moved(self, rotation: NDArray[np.float64], place: NDArray[np.float64]) -> "Mesh":
        """Return the mesh after a rotation, shape (3, 3), and a displacement, shape (3,)."""
        return Mesh(self.corners @ rotation.T + place, self.colours)

    def shaded(self) -> "Mesh":
        """Return the mesh in the sun's light."""
        edges = self.corners[:, 1:] - self.corners[:, :1]
        normals = np.cross(edges[:, 0], edges[:, 1])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return Mesh(self.corners, self.colours * lit(normals)[:, None])


def robot_mesh(
    robot: RobotModel, pose: Pose, head: float | None = None, spins: tuple[float, float] = (0, 0)
) -> Mesh:
    """Return a robot in the map, in the sun's light.

    Args:
        robot: Body.
        pose: Pose in the map.
        head: Azimuth of the laser's head from straight ahead [rad]; None where it does not turn.
        spins: Angles by which the left and the right wheels have turned [rad].
    """
    parts = [*_body(robot), _head(robot, head or 0.0)]
    for side, spin in zip((1, -1), spins, strict=True):
        for end in (1, -1):
            place = np.array(
                [end * robot.wheelbase / 2, side * robot.track / 2, robot.wheel_radius]
            )
            turned = _wheel(robot.wheel_radius, robot.wheel_width).moved(_about_y(spin), place)
            parts.append(turned)
    return _joined(parts).moved(pose.matrix[:3, :3], pose.position).shaded()


def _body(robot: RobotModel) -> list[Mesh]:
    """Return hull, deck, nose and mast."""
    low = min(robot.clearance, robot.lidar_height / 4)
    deck = max(2 * robot.wheel_radius + 0.1, low + 0.1)
    inner = max(robot.track - robot.wheel_width - 0.02, 0.1)
    return [
        _box((robot.length, inner, deck - low), (0.0, 0.0, (low + deck) / 2), _HULL),
        _box((0.92 * robot.length, robot.width, 0.04), (0.0, 0.0, deck + 0.02), _DECK),
        _box((0.06, 0.5 * robot.width, 0.05), (0.45 * robot.length, 0.0, deck + 0.06), _HULL),
        _box(
            (0.06, 0.06, robot.lidar_height - deck),
            (0.0, 0.0, (robot.lidar_height + deck) / 2),
            _HULL,
        ),
    ]


def _head(robot: RobotModel, azimuth: float) -> Mesh:
    """Return the laser's head, with a window to either side of the plane that it scans."""
    parts = [
        _box((0.12, 0.18, 0.17), (0.0, 0.0, 0.0), _HEAD),
        _box((0.10, 0.02, 0.12), (0.0, 0.095, 0.0), _WINDOW),
        _box((0.05, 0.05, 0.06), (0.08, 0.0, 0.03), _WINDOW),
    ]
    return _joined(parts).moved(_about_z(azimuth), np.array([0.0, 0.0, robot.lidar_height]))


def _box(
    size: tuple[float, float, float],
    centre: tuple[float, float, float],
    colour: tuple[int, int, int],
) -> Mesh:
    """Return a box [m]."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = corners * np.array(size) / 2 + centre
    faces = np.array(_FACES)
    triangles = np.concatenate([faces[:, :3], faces[:, [0, 2, 3]]])
    return Mesh(corners[triangles], np.full((len(triangles), 3), colour, dtype=np.float64))


_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
"""Corners of a box's faces, counter-clockwise from outside."""


def _wheel(radius: float, width: float) -> Mesh:
    """Return a wheel about the y axis, with treads and hubs by which one sees it turn."""
    angles = np.linspace(0, 2 * np.pi, _SIDES + 1)
    rim = radius * np.stack([np.cos(angles), np.zeros(_SIDES + 1), np.sin(angles)], axis=1)
    out = np.array([0.0, width / 2, 0.0])
    a, b = rim[:-1], rim[1:]
    tyre = np.concatenate(
        [np.stack([a + out, b + out, b - out], 1), np.stack([a + out, b - out, a - out], 1)]
    )
    centre = np.zeros_like(a)
    discs = np.concatenate(
        [
            np.stack([centre + out, b + out, a + out], 1),
            np.stack([centre - out, a - out, b - out], 1),
        ]
    )
    hubs = 0.5 * discs * [1, 0, 1] + 1.08 * discs * [0, 1, 0]
    tread = np.where(np.arange(_SIDES)[:, None] % 2 == 0, _TYRE, _TREAD)
    spokes = np.where(np.arange(_SIDES)[:, None] % 4 == 0, _TYRE, _HUB)
    sides = np.full((2 * _SIDES, 3), _TYRE)
    colours = np.concatenate([tread, tread, sides, spokes, spokes]).astype(np.float64)
    return Mesh(np.concatenate([tyre, discs, hubs]), colours)


def _joined(parts: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    return Mesh(
        np.concatenate([part.corners for part in parts]),
        np.concatenate([part.colours for part in parts]),
    )


def _about_y(angle: float) -> NDArray[np.float64]:
    """Return the rotation about y that rolls a wheel forward by an angle [rad], shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _about_z(angle: float) -> NDArray[np.float64]:
    """Return the rotation about z by an angle [rad], shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
