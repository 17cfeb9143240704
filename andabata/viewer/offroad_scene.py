"""Scene of an off-road drive: world, robot, cloud, cells, map, way."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.navigator import NavigatorConfig
from andabata.report.drive_frames import DriveFrame
from andabata.viewer.cell_drawing import CellDrawing, MapDrawing
from andabata.viewer.cloud_drawing import CloudDrawing
from andabata.viewer.estimate_drawing import EstimateDrawing
from andabata.viewer.robot_drawing import RobotDrawing
from andabata.viewer.way_drawing import WalkerDrawing, WayDrawing
from andabata.viewer.world_drawing import WorldDrawing
from worlds.world import World

if TYPE_CHECKING:
    import viser

ROOT = "/map"
"""Name of the node of the map. While the camera follows, the map moves under it, not the camera:
so turning and zooming by hand goes on undisturbed."""

_ODOM = f"{ROOT}/odom"

_FIELD_OF_VIEW = 0.72
"""Vertical field of view of the page, until it is changed there [rad]."""

_MAP_PERIOD = 0.4
"""Time between two drawings of the local map [s]."""

LAYERS = ("cloud", "sweep", "cells", "ranges", "plan", "estimate", "objects")
"""Names of what can be shown and hidden."""


class OffroadScene:
    """Draws the frames of a drive.

    Attributes:
        follows: True if the camera follows the robot.
    """

    def __init__(
        self,
        server: "viser.ViserServer",
        config: NavigatorConfig,
        world: World | None,
        most_points: int,
    ) -> None:
        """Draw what stays.

        Args:
            server: Server of the page.
            config: Body, laser and grid of the robot.
            world: World of the drive; None where it is not known.
            most_points: Largest number of points of the cloud.
        """
        scene, self._server = server.scene, server
        ground = None if world is None else world.ground.height_at
        self._root = scene.add_frame(ROOT, show_axes=False)
        self._odom = scene.add_frame(_ODOM, show_axes=False)
        light(scene)
        turns = config.sensing.scanner == "rotating"
        self._world = None if world is None else WorldDrawing(scene, ROOT, world)
        if world is None:
            scene.add_grid(
                f"{ROOT}/plane", width=200.0, height=200.0, cell_size=1.0, section_size=10.0
            )
        self._robot = RobotDrawing(scene, ROOT, _ODOM, config.robot, turns)
        self._estimate = EstimateDrawing(scene, ROOT, config.robot, ground)
        self.cloud = CloudDrawing(scene, _ODOM, most_points)
        self._cells = CellDrawing(scene, ROOT, config.grid, ground)
        self._map = MapDrawing(scene, ROOT, ground)
        self._way = WayDrawing(scene, ROOT, ground)
        self._walkers = WalkerDrawing(scene, ROOT)
        self._map_stamp, self._map_name, self.follows = -np.inf, "none", True
        # Far away with a long lens: near ones tilt what is upright.
        server.initial_camera.position = (-8.0, -5.0, 6.2)
        server.initial_camera.look_at = (1.2, 0.0, 0.2)
        server.initial_camera.fov = _FIELD_OF_VIEW

    def show(self, layer: str, visible: bool) -> None:
        """Show or hide a layer.

        Args:
            layer: One of ``LAYERS``.
            visible: True to show it.
        """
        shows: dict[str, Callable[[bool], None]] = {
            "cloud": self.cloud.show,
            "sweep": self._robot.show_sweep,
            "cells": self._cells.show_cells,
            "ranges": self._cells.show_ranges,
            "plan": self._way.show_plan,
            "estimate": self._estimate.show,
            "objects": lambda on: None if self._world is None else self._world.show_objects(on),
        }
        shows[layer](visible)

    def draw(self, frame: DriveFrame, positions: Sequence[NDArray[np.float64]]) -> None:
        """Draw a frame.

        Args:
            frame: The frame.
            positions: Positions of the path [m], those of the frame and perhaps later ones.
        """
        # One batch: the page never shows half a frame.
        with self._server.atomic():
            if self.follows:
                self._root.position = -frame.pose.position
            self._place_odom(frame)
            self._robot.draw(frame)
            self._estimate.draw(frame)
            self.cloud.draw(frame)
            self._cells.draw(frame)
            self._draw_map(frame)
            self._way.draw(frame, positions)
            self._walkers.draw(frame.walkers)
        self._server.flush()

    @property
    def offset(self) -> NDArray[np.float64]:
        """Position of the map's origin in the scene [m], shape (3,)."""
        return np.asarray(self._root.position, dtype=np.float64)

    def _place_odom(self, frame: DriveFrame) -> None:
        """Put ``odom`` where what lies in it surrounds the drawn robot."""
        c, s = np.cos(frame.turn), np.sin(frame.turn)
        x, y, z = frame.odometry.position
        shift = frame.pose.position - [c * x - s * y, s * x + c * y, z]
        self._odom.position = shift
        self._odom.wxyz = (np.cos(frame.turn / 2), 0.0, 0.0, np.sin(frame.turn / 2))

    def _draw_map(self, frame: DriveFrame) -> None:
        """Draw the map's layer now and then: it has thousands of cells."""
        layer = None if frame.plan is None or frame.plan.map is None else frame.plan.map
        name = "none" if layer is None else layer.name
        age = frame.stamp - self._map_stamp
        if name == self._map_name and 0 <= age < _MAP_PERIOD:
            return
        if name != "none" or self._map_name != "none":
            self._map.draw(frame)
        self._map_stamp, self._map_name = frame.stamp, name


def light(scene: "viser.SceneApi") -> None:
    """Light the scene without shadows, which a browser without a graphics card draws slowly."""
    scene.set_up_direction("+z")
    scene.set_background_image(_sky())
    scene.configure_default_lights(enabled=False)
    scene.add_light_ambient("/light/ambient", intensity=1.2)
    scene.add_light_directional(
        "/light/sun", intensity=1.4, position=(4.0, -5.0, 7.7), cast_shadow=False
    )


def _sky() -> NDArray[np.uint8]:
    """Return a sky that is lighter at the horizon, uint8, shape (64, 8, 3)."""
    share = np.linspace(0.0, 1.0, 64)[:, None]
    rows = (1 - share) * np.array([150, 190, 230]) + share * np.array([235, 242, 248])
    return np.repeat(rows[:, None], 8, axis=1).astype(np.uint8)
