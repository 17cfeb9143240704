"""Drawing of what the robot believes: its body there, the error ellipse and the heading's wedge."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.localization.estimator_status import (
    EstimatorStatus,
    error_ellipse,
    heading_sector,
)
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.class_colours import HEALTH_COLOURS, rgb
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.cell_drawing import plane_height
from andabata.viewer.world_drawing import GroundHeight

if TYPE_CHECKING:
    import viser

_RIM, _ARC = 48, 12
"""Numbers of segments of the ellipse and of the wedge's arc."""

_LIFT = 0.14
"""Height over the ground [m]."""

_OPACITY = 0.35


class EstimateDrawing:
    """Outline of the body where it is believed to be, ellipse and wedge of two sigma.

    Their colour is that of the health.
    """

    def __init__(
        self, scene: "viser.SceneApi", root: str, robot: RobotModel, ground: GroundHeight | None
    ) -> None:
        """Begin without an estimate.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            robot: Body.
            ground: Height of the ground; None takes the plane under the robot.
        """
        self._robot, self._ground = robot, ground
        none, colour = np.zeros((_RIM + 8, 2, 3), dtype=np.float32), rgb(HEALTH_COLOURS[Health.OK])
        self._lines = scene.add_line_segments(f"{root}/estimate", none, colour, thickness=0.03)
        self._fans = [
            scene.add_mesh_simple(
                f"{root}/estimate_{name}",
                np.zeros((count + 2, 3), dtype=np.float32),
                fan(count),
                opacity=_OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            for name, count in (("ellipse", _RIM), ("wedge", _ARC))
        ]
        self._health: Health | None = None
        self._shows = True

    def show(self, visible: bool) -> None:
        """Show or hide the estimate."""
        self._shows = visible
        for handle in (self._lines, *self._fans):
            handle.visible = visible

    def draw(self, frame: DriveFrame) -> None:
        """Draw the estimate of a frame; nothing where none is known."""
        status = frame.status
        for handle in (self._lines, *self._fans):
            handle.visible = self._shows and status is not None
        if status is None or not self._shows:
            return
        self._colour(status.health)
        rim = ellipse_rim(frame.estimate, status)
        sector = wedge(frame.estimate, status)
        ellipse, around = self._on_ground(frame, rim), self._on_ground(frame, sector)
        body = body_lines(frame.estimate, self._robot)
        edge = np.stack([ellipse[1:-1], ellipse[2:]], axis=1)
        self._lines.points = np.concatenate([body, edge]).astype(np.float32)
        for handle, places in zip(self._fans, (ellipse, around), strict=True):
            handle.vertices = places.astype(np.float32)

    def _colour(self, health: Health) -> None:
        """Give all parts the colour of a health, once it changes."""
        if health is self._health:
            return
        self._health = health
        colour = rgb(HEALTH_COLOURS[health])
        self._lines.colors = np.full((_RIM + 8, 2, 3), colour, dtype=np.uint8)
        for handle in self._fans:
            handle.color = colour

    def _on_ground(self, frame: DriveFrame, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places in the map [m], shape (n, 2), a little over the ground, shape (n, 3)."""
        x, y = places.T
        heights = plane_height(frame, x, y) if self._ground is None else self._ground(x, y)
        return np.column_stack([places, heights + _LIFT])


def fan(count: int) -> NDArray[np.uint32]:
    """Return the triangles of a fan around vertex 0, shape (count, 3).

    Args:
        count: Number of triangles; the rim begins at vertex 1.
    """
    first = np.arange(1, count + 1, dtype=np.uint32)
    return np.stack([np.zeros_like(first), first, first + 1], axis=1)


def ellipse_rim(pose: Pose, status: EstimatorStatus) -> NDArray[np.float64]:
    """Return middle and closed rim of the error ellipse [m], shape (_RIM + 2, 2)."""
    rim = error_ellipse(status.covariance[:2, :2], _RIM)
    return np.asarray(pose.position[:2] + np.concatenate([np.zeros((1, 2)), rim, rim[:1]]))


def wedge(pose: Pose, status: EstimatorStatus) -> NDArray[np.float64]:
    """Return tip and arc of the sector that holds the heading [m], shape (_ARC + 2, 2)."""
    return np.asarray(pose.position[:2] + heading_sector(pose.yaw, status.yaw_sigma, _ARC + 1))


def body_lines(pose: Pose, robot: RobotModel) -> NDArray[np.float64]:
    """Return the outline of the body at a pose, low and high, as segments [m], shape (8, 2, 3)."""
    half = (robot.length / 2, robot.width / 2)
    corners = np.array([[x, y] for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))]) * half
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    placed = pose.position[:2] + corners @ np.array([[c, s], [-s, c]])
    low = np.column_stack([placed, np.full(4, pose.position[2] + 0.1)])
    high = low + np.array([0.0, 0.0, 0.35])
    rings = [np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (low, high)]
    return np.concatenate(rings)
