"""Drawing of where the robot has been and where it goes: path, plan, sub-goal, goal, walkers."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.cell_drawing import plane_height
from andabata.viewer.world_drawing import GroundHeight
from terrain.classes import SemanticClass
from worlds.walking import WalkerTrack

if TYPE_CHECKING:
    import viser

_PATH, _PLAN, _GOAL, _SUBGOAL = (208, 0, 111), (0, 71, 200), (0, 71, 200), (255, 140, 0)

_MOST_SEGMENTS = 1500
"""Largest number of segments of the path."""

_PATH_LIFT, _PLAN_LIFT = 0.16, 0.2
"""Heights over the ground [m]."""

_NEW_POSITIONS = 5
"""Number of control steps after which the path is drawn on."""


class WayDrawing:
    """Path, plan, sub-goal and goal."""

    def __init__(self, scene: "viser.SceneApi", root: str, ground: GroundHeight | None) -> None:
        """Begin without any.

        Args:
            scene: Scene to draw in.
            root: Name of the node of the map.
            ground: Height of the ground; None takes the plane under the robot.
        """
        self._ground = ground
        none = np.zeros((0, 2, 3), dtype=np.float32)
        self._path = scene.add_line_segments(f"{root}/path", none, _PATH, thickness=0.05)
        self._plan = scene.add_line_segments(f"{root}/plan", none, _PLAN, thickness=0.035)
        self._goal = scene.add_frame(f"{root}/goal", show_axes=False, visible=False)
        scene.add_cylinder(
            f"{root}/goal/pole",
            radius=0.06,
            height=2.4,
            color=_GOAL,
            position=(0.0, 0.0, 1.2),
            cast_shadow=False,
        )
        scene.add_icosphere(
            f"{root}/goal/ball",
            radius=0.25,
            color=_GOAL,
            position=(0.0, 0.0, 2.5),
            cast_shadow=False,
        )
        self._target = scene.add_icosphere(
            f"{root}/subgoal", radius=0.16, color=_SUBGOAL, visible=False, cast_shadow=False
        )
        self._drawn, self._shows_plan = 0, True
        self._flag = np.full(2, np.nan)

    def show_plan(self, visible: bool) -> None:
        """Show or hide plan and sub-goal."""
        self._shows_plan = visible
        if not visible:
            self._plan.visible = self._target.visible = False

    def draw(self, frame: DriveFrame, positions: Sequence[NDArray[np.float64]]) -> None:
        """Draw a frame.

        Args:
            frame: The frame.
            positions: Positions of the path [m], those of the frame and perhaps later ones.
        """
        count = frame.n_positions
        if not 0 <= count - self._drawn < _NEW_POSITIONS:
            self._drawn = count
            self._path.points = path_lines(positions[:count])
        self._draw_goal(frame)
        if self._shows_plan:
            self._draw_plan(frame)

    def _draw_goal(self, frame: DriveFrame) -> None:
        """Put the flag on the goal."""
        self._goal.visible = frame.goal is not None
        if frame.goal is not None and not np.array_equal(frame.goal, self._flag):
            x, y = self._flag = frame.goal
            self._goal.position = (x, y, float(self._height(frame, x, y)))

    def _draw_plan(self, frame: DriveFrame) -> None:
        """Draw the planned way from the robot on, and the sub-goal."""
        plan = frame.plan
        self._plan.visible = self._target.visible = plan is not None
        if plan is None:
            return
        places = np.concatenate([frame.odometry.position[None, :2], plan.way, plan.target[None]])
        c, s = np.cos(frame.turn), np.sin(frame.turn)
        ahead, left = (places - frame.odometry.position[:2]).T
        x = frame.pose.position[0] + c * ahead - s * left
        y = frame.pose.position[1] + s * ahead + c * left
        heights = self._height(frame, x, y) + _PLAN_LIFT
        way = np.stack([x, y, heights], axis=1)
        self._target.position = way[-1] + [0.0, 0.0, 0.2]
        self._plan.points = np.stack([way[:-2], way[1:-1]], axis=1).astype(np.float32)

    def _height(self, frame: DriveFrame, x: object, y: object) -> NDArray[np.float64]:
        """Return the height of the ground at places in the map [m]."""
        places = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        if self._ground is not None:
            return self._ground(*places)
        return plane_height(frame, *places)


class WalkerDrawing:
    """Walkers as upright cylinders."""

    def __init__(self, scene: "viser.SceneApi", root: str) -> None:
        """Begin without any."""
        self._scene, self._name = scene, f"{root}/walkers"
        self._handles: list[viser.CylinderHandle] = []

    def draw(self, track: WalkerTrack | None) -> None:
        """Draw the walkers of a moment."""
        if track is None:
            return
        rows = track.now
        colour = tuple(CLASS_COLOURS[SemanticClass.WALKER].tolist())
        for number in range(len(self._handles), len(rows)):
            # The largest radius that it ever has is known once it is there: 1 until then.
            self._handles.append(
                self._scene.add_cylinder(
                    f"{self._name}/{number}",
                    radius=1.0,
                    height=1.0,
                    color=(colour[0], colour[1], colour[2]),
                    cast_shadow=False,
                    visible=False,
                )
            )
        for handle, (x, y, z, radius, height) in zip(self._handles, rows.tolist(), strict=False):
            handle.visible = radius > 0.0
            if radius > 0.0:
                handle.position = (x, y, z + height / 2)
                handle.scale = (radius, radius, height)


def path_lines(positions: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
    """Return a path as segments, long ones in longer steps, float32, shape (n, 2, 3)."""
    if len(positions) < 2:
        return np.zeros((0, 2, 3), dtype=np.float32)
    every = -(-len(positions) // _MOST_SEGMENTS)
    places = np.array([*positions[:-1:every], positions[-1]])
    places[:, 2] += _PATH_LIFT
    return np.stack([places[:-1], places[1:]], axis=1).astype(np.float32)
