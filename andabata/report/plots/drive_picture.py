"""Picture of one moment of a drive in its world: cells, laser points, path, plan, goal, robot."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from andabata.machine.robot import RobotModel
from andabata.report.class_colours import (
    BLOCKED_COLOUR,
    FREE_COLOUR,
    PATH_COLOUR,
    PLAN_COLOUR,
    rgb,
)
from andabata.report.drive_frames import DriveFrame
from andabata.report.plots.captions import caption, legend_line
from andabata.report.plots.film import Colour
from andabata.report.rendering.camera import Camera
from andabata.report.rendering.canvas import Canvas
from andabata.report.rendering.lighting import SUN
from andabata.report.rendering.robot_mesh import robot_mesh
from andabata.report.rendering.scenery import Scenery
from traversability.grid import PolarGrid

FREE, BLOCKED = rgb(FREE_COLOUR), rgb(BLOCKED_COLOUR)
PATH, PLAN = rgb(PATH_COLOUR), rgb(PLAN_COLOUR)
POINT: Colour = (30, 45, 90)
BEAM: Colour = (255, 210, 40)

LEGEND_COLOURS = (FREE, BLOCKED, PATH, PLAN, BEAM, POINT)
"""Colours of what a picture shows on the world."""

_SAMPLES = 2
"""Number of rays along an edge of a pixel."""

_NEW = 0.3
"""Age below which laser points are drawn as the beams of the moment [s]."""

_BEAMS = 40
"""Largest number of beams that are drawn from the laser to its newest points."""

_NEAR = 0.78
"""Distance from the camera, over that of the robot, from which on things are drawn: what stands
before it would hide it."""

_BEHIND = 0.8
"""Distance from the camera, over that of the robot, beyond which laser points are drawn."""

_TINT_HEIGHT = 1.5
"""Height above the robot's foot up to which surfaces take the colour of their cell [m]."""

_TINT, _RIM = 0.5, 0.12
"""Share of a cell's colour on what is in it, and near its edges."""

_EDGE = 0.035
"""Distance from a cell's edge that is near [m]."""

_LIFT = 0.12
"""Height of path and plan above the ground [m]."""

_SHADOW = 0.62
"""Brightness of the ground in the robot's shadow."""

_CLEAR = 0.45
"""Distance from the robot's middle within which no plan is drawn [m]."""

_POLE, _LEAST_POLE = 1.6, 0.05
"""Least height of the goal's pole [m], and least share of its distance."""


class LegendEntry(NamedTuple):
    """An entry of a legend.

    Attributes:
        text: Text.
        colour: Colour.
        is_area: True for a filled area, False for a line.
    """

    text: str
    colour: Colour
    is_area: bool = False


def draw_drive(
    frame: DriveFrame,
    path: NDArray[np.float64],
    camera: Camera,
    scenery: Scenery,
    grid: PolarGrid,
    robot: RobotModel,
) -> Image.Image:
    """Return the picture of a moment.

    Args:
        frame: The moment.
        path: Positions up to this moment [m], shape (k, 3).
        camera: Camera.
        scenery: World around the robot.
        grid: Polar grid of the scan.
        robot: Body.
    """
    focus = float(np.linalg.norm(frame.pose.position - camera.place))
    view = scenery.view(camera.sampled(_SAMPLES), _NEAR * focus, frame.walkers)
    colours = tinted(view.colours, view.hits, frame, grid)
    canvas = view.canvas(under_robot(colours, view.hits, frame, robot))
    scenery.plants.draw(canvas, focus)
    _draw_laser(canvas, frame, robot)
    canvas.strip(path + np.array([0.0, 0.0, _LIFT]), 0.04, np.array(PATH), 0.3)
    ground = scenery.world.ground
    way = way_in_map(frame)
    way = way[np.hypot(*(way - frame.pose.position[:2]).T) > _CLEAR]
    canvas.strip(lifted(way, scenery), 0.05, np.array(PLAN), 0.3)
    if frame.goal is not None:
        foot = np.array([*frame.goal, float(ground.height_at(*frame.goal))])
        _draw_goal(canvas, foot)
    spins = _spins(path, robot)
    canvas.triangles(*robot_mesh(robot, frame.pose, frame.head, spins))
    image = Image.fromarray(canvas.pixels(_SAMPLES))
    draw = ImageDraw.Draw(image)
    caption(draw, camera.width, status(frame))
    legend_line(draw, camera.width, camera.height, legend(frame))
    return image


def legend(frame: DriveFrame) -> list[LegendEntry]:
    """Return the legend of what a picture of a frame shows."""
    found = []
    if frame.scan is not None:
        found += [LegendEntry("free", FREE, True), LegendEntry("blocked", BLOCKED, True)]
    if frame.parts:
        found += [LegendEntry("laser", BEAM)]
    if frame.n_positions > 1:
        found += [LegendEntry("driven", PATH)]
    if len(way_in_map(frame)) > 1:
        found += [LegendEntry("plan", PLAN)]
    return found


def status(frame: DriveFrame) -> str:
    """Return the time, and the distance of the goal, in words."""
    text = f"{frame.stamp:.0f} s"
    if frame.goal is None:
        return text
    return f"{text}, goal {np.hypot(*(frame.goal - frame.pose.position[:2])):.0f} m away"


def way_in_map(frame: DriveFrame) -> NDArray[np.float64]:
    """Return the places of the planned way as they lie around the drawn robot [m], shape (k, 2)."""
    if frame.plan is None or not len(frame.plan.way):
        return np.empty((0, 2))
    c, s = np.cos(frame.turn), np.sin(frame.turn)
    x, y = (frame.plan.way - frame.odometry.position[:2]).T
    return np.stack([c * x - s * y, s * x + c * y], axis=1) + frame.pose.position[:2]


def lifted(places: NDArray[np.float64], scenery: Scenery) -> NDArray[np.float64]:
    """Return places [m], shape (k, 2), a little above the ground, shape (k, 3)."""
    heights = scenery.world.ground.height_at(places[:, 0], places[:, 1])
    return np.column_stack([places, heights + _LIFT])


def tinted(
    colours: NDArray[np.float64], hits: NDArray[np.float64], frame: DriveFrame, grid: PolarGrid
) -> NDArray[np.float64]:
    """Return colours with the polar cells of the virtual scan on them, lighter at their edges.

    Args:
        colours: Colour of each hit, shape (n, 3).
        hits: Places in the map [m], shape (n, 3).
        frame: Frame with the scan.
        grid: Polar grid of the scan.
    """
    if frame.scan is None:
        return colours
    pose = frame.scan_pose or frame.pose
    x, y, z = (hits - pose.position).T
    distance = np.hypot(x, y)
    rings = np.searchsorted(grid.ring_edges, distance, side="right") - 1
    # Crowns overhead stay as they are: cells are about the ground and what stands on it.
    inside = (rings >= 0) & (rings < grid.n_rings) & (z < _TINT_HEIGHT)
    turns = ((np.arctan2(y, x) - pose.yaw) / (2 * np.pi) + 1.5) * grid.n_sectors
    sectors = turns.astype(int) % grid.n_sectors
    rings = np.where(inside, rings, 0)
    log_odds = frame.scan.log_odds_of(grid)[sectors, rings]
    aside = np.abs(turns - np.round(turns)) * 2 * np.pi / grid.n_sectors * distance
    edges = np.asarray(grid.ring_edges)
    along = np.minimum(distance - edges[rings], edges[rings + 1] - distance)
    share = np.where(np.minimum(aside, along) < _EDGE, _RIM, _TINT)
    found = colours.copy()
    for chosen, tint in ((log_odds < 0, FREE), (log_odds >= 0, BLOCKED)):
        where = chosen & inside
        found[where] += share[where, None] * (np.array(tint) - found[where])
    return found


def under_robot(
    colours: NDArray[np.float64], hits: NDArray[np.float64], frame: DriveFrame, robot: RobotModel
) -> NDArray[np.float64]:
    """Return colours with the robot's shadow on them.

    Args:
        colours: Colour of each hit, shape (n, 3).
        hits: Places in the map [m], shape (n, 3).
        frame: Frame with the robot's pose.
        robot: Body.
    """
    # A hit is in the shadow if the way from it to the sun leads through the deck.
    local = (hits - frame.pose.position) @ frame.pose.matrix[:3, :3]
    sun = SUN @ frame.pose.matrix[:3, :3]
    deck = 2 * robot.wheel_radius + 0.1
    at_deck = local + np.maximum(deck - local[:, 2:], 0.0) / max(sun[2], 0.1) * sun
    inside = (np.abs(at_deck[:, :2]) < [robot.length / 2, robot.width / 2]).all(axis=1)
    found = colours.copy()
    found[inside & (local[:, 2] < deck)] *= _SHADOW
    return found


def _draw_laser(canvas: Canvas, frame: DriveFrame, robot: RobotModel) -> None:
    """Draw laser points, and the beams that lead to those of the moment."""
    points, ages = frame.points()
    # Points of a crown that is left out would hang in the air before the robot.
    camera = canvas.camera
    focus = np.linalg.norm(frame.pose.position - camera.place)
    far = np.linalg.norm(points - camera.place, axis=1) > _BEHIND * focus
    points, ages = points[far], ages[far]
    canvas.discs(points[ages >= _NEW], 0.018, np.array(POINT), 0.15)
    new = points[ages < _NEW]
    canvas.discs(new, 0.035, np.array(BEAM), 0.15)
    beams = new[:: max(len(new) // _BEAMS, 1)]
    top = frame.pose.matrix[:3] @ np.array([0.0, 0.0, robot.lidar_height, 1.0])
    if frame.head is not None:
        canvas.lines(np.broadcast_to(top, beams.shape), beams, (0.004, 0.004), np.array(BEAM))


def _draw_goal(canvas: Canvas, foot: NDArray[np.float64]) -> None:
    """Draw a ring on the ground and a flag on a pole, which is higher the farther it is away."""
    distance = float(np.linalg.norm(foot - canvas.camera.place))
    height = max(_POLE, _LEAST_POLE * distance)
    up = np.array([0.0, 0.0, height])
    angles = np.linspace(0, 2 * np.pi, 33)
    circle = np.stack([np.cos(angles), np.sin(angles), np.zeros(33)], axis=1)
    canvas.strip(foot + 0.4 * circle + [0.0, 0.0, _LIFT], 0.04, np.array(PLAN), 0.3)
    canvas.lines(foot[None], (foot + up)[None], (0.02 * height, 0.02 * height), np.array(PLAN))
    right = canvas.camera.axes[0]
    flag = np.array([foot + up, foot + 0.6 * up, foot + 0.8 * up + 0.5 * height * right])
    canvas.triangles(flag[None], np.array([PLAN], dtype=np.float64))


def _spins(path: NDArray[np.float64], robot: RobotModel) -> tuple[float, float]:
    """Return the angles by which the wheels have turned on the way [rad]."""
    driven = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    return driven / robot.wheel_radius, driven / robot.wheel_radius
