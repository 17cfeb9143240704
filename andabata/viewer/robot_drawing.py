"""Drawing of a robot: body, wheels and laser, and its sweep."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.report.drive_frames import DriveFrame

if TYPE_CHECKING:
    import viser

_BODY, _TYRE, _HUB, _LASER = (45, 50, 60), (25, 25, 28), (200, 200, 205), (235, 120, 30)
_BEAM = (255, 200, 0)

_BEAMS = 48
"""Number of beams of the sweep that are drawn."""

_UPRIGHT = (0.7071068, 0.7071068, 0.0, 0.0)
"""Quaternion w, x, y, z that lays a cylinder's axis along y."""


def quaternion_wxyz(pose: Pose) -> NDArray[np.float64]:
    """Return the rotation of a pose as w, x, y, z, shape (4,)."""
    return np.roll(pose.quaternion, 1)


class RobotDrawing:
    """Body with turning wheels and laser, and the beams of the moment."""

    def __init__(
        self, scene: "viser.SceneApi", root: str, odom: str, robot: RobotModel, turns: bool
    ) -> None:
        """Draw a robot at the origin.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            odom: Name of the node of ``odom``.
            robot: Body.
            turns: True if its laser turns.
        """
        self._robot, self._spin, self._stamp = robot, [0.0, 0.0], 0.0
        self._base = scene.add_frame(f"{root}/robot", show_axes=False)
        self._add_body(scene, f"{root}/robot")
        self._wheels = [
            (side, self._add_wheel(scene, f"{root}/robot/wheel_{end}_{side}", x, y))
            for side, y in enumerate((1, -1))
            for end, x in enumerate((1, -1))
        ]
        self._head = self._add_head(scene, f"{root}/robot/head") if turns else None
        none = np.zeros((_BEAMS, 2, 3), dtype=np.float32)
        self._sweep = scene.add_line_segments(
            f"{odom}/sweep", none, _BEAM, thickness=0.006, visible=False
        )
        self._shows_sweep = True

    def show_sweep(self, visible: bool) -> None:
        """Show or hide the beams of the moment."""
        self._shows_sweep = visible
        self._sweep.visible = visible

    def draw(self, frame: DriveFrame) -> None:
        """Move the robot to a frame."""
        self._base.position = frame.pose.position
        self._base.wxyz = quaternion_wxyz(frame.pose)
        self._turn_wheels(frame)
        if self._head is not None and frame.head is not None:
            self._head.wxyz = _about_z(frame.head)
        beams = self._beams(frame) if self._shows_sweep else None
        self._sweep.visible = beams is not None
        if beams is not None:
            self._sweep.points = beams

    def _turn_wheels(self, frame: DriveFrame) -> None:
        """Turn the wheels by what they have rolled since the last frame."""
        elapsed = max(frame.stamp - self._stamp, 0.0)
        self._stamp = frame.stamp
        for side, speed in enumerate((frame.wheels.left, frame.wheels.right)):
            self._spin[side] = (self._spin[side] + speed * elapsed) % (2 * np.pi)
        for side, handle in self._wheels:
            half = self._spin[side] / 2
            handle.wxyz = (np.cos(half), 0.0, np.sin(half), 0.0)

    def _beams(self, frame: DriveFrame) -> NDArray[np.float32] | None:
        """Return lines from the laser to what it measured last, in ``odom``; None without any."""
        if not frame.parts:
            return None
        points = frame.parts[-1].points[-12 * _BEAMS :: 12]
        lines = np.empty((_BEAMS, 2, 3), dtype=np.float32)
        top = frame.odometry.position + np.array([0.0, 0.0, self._robot.lidar_height])
        lines[:, 0] = top
        lines[:, 1] = top
        lines[: len(points), 1] = points[:_BEAMS]
        return lines

    def _add_body(self, scene: "viser.SceneApi", name: str) -> None:
        """Add the body: a box between the wheels, one above them, and the mast of the laser."""
        robot = self._robot
        low = min(robot.clearance, robot.lidar_height / 4)
        deck = max(2 * robot.wheel_radius + 0.12, low + 0.1)
        inner = max(robot.track - robot.wheel_width - 0.02, 0.1)
        boxes = {
            "hull": ((robot.length, inner, deck - low), (low + deck) / 2, _BODY),
            "deck": ((robot.length, robot.width, 0.05), deck + 0.025, (240, 160, 30)),
        }
        for part, (size, height, colour) in boxes.items():
            scene.add_box(
                f"{name}/{part}",
                colour,
                dimensions=size,
                position=(0.0, 0.0, height),
                cast_shadow=False,
            )
        mast = max(robot.lidar_height - deck - 0.05, 0.02)
        scene.add_cylinder(
            f"{name}/mast",
            radius=0.025,
            height=mast,
            color=_BODY,
            position=(0.0, 0.0, deck + 0.05 + mast / 2),
            cast_shadow=False,
        )
        # A nose tells front from back.
        scene.add_box(
            f"{name}/nose",
            _LASER,
            dimensions=(0.05, robot.width * 0.5, 0.04),
            position=(robot.length / 2, 0.0, deck + 0.05),
            cast_shadow=False,
        )

    def _add_wheel(
        self, scene: "viser.SceneApi", name: str, x: int, y: int
    ) -> "viser.SceneNodeHandle":
        """Add a wheel with a spoke; ``x`` and ``y`` are the signs of its place."""
        robot = self._robot
        place = (x * robot.wheelbase / 2, y * robot.track / 2, robot.wheel_radius)
        axle = scene.add_frame(name, show_axes=False, position=place)
        scene.add_cylinder(
            f"{name}/tyre",
            radius=robot.wheel_radius,
            height=robot.wheel_width,
            color=_TYRE,
            radial_segments=16,
            wxyz=_UPRIGHT,
            cast_shadow=False,
        )
        scene.add_box(
            f"{name}/spoke",
            _HUB,
            dimensions=(1.5 * robot.wheel_radius, robot.wheel_width + 0.01, 0.03),
            cast_shadow=False,
        )
        return axle

    def _add_head(self, scene: "viser.SceneApi", name: str) -> "viser.SceneNodeHandle":
        """Add the head of the laser, which looks along its own x."""
        head = scene.add_frame(name, show_axes=False, position=(0.0, 0.0, self._robot.lidar_height))
        for part, size, place in (
            ("housing", (0.1, 0.12, 0.12), 0.0),
            ("window", (0.03, 0.08, 0.09), 0.06),
        ):
            scene.add_box(
                f"{name}/{part}",
                _LASER if part == "housing" else (30, 30, 30),
                dimensions=size,
                position=(place, 0.0, 0.0),
                cast_shadow=False,
            )
        return head


def _about_z(angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion w, x, y, z of a turn about z [rad]."""
    return float(np.cos(angle / 2)), 0.0, 0.0, float(np.sin(angle / 2))
