"""Compiled pass of many skid-steer robots: plant, errors of the believed pose, beams.

Plant and rays are the compiled functions that a single robot is driven with. What a drive is about
(terminations, rewards, observations) is not here: functions over arrays state it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.clock import TICKS_PER_STEP
from andabata.machine.kinematic_vehicle import drive_ticks
from terrain.kernel import kernel
from worlds.drag import NO_DRAG
from worlds.rays.layout import Blocks, ConvexObjects, GridFrame, Ground, Lattice, Layout
from worlds.rays.walk import NO_TIMES, cast_rays
from worlds.rays.wind import STILL_AIR
from worlds.rooms.mover_motion import Movers

AHEAD = 16
"""Number of steps whose draws are made at once."""

_X, _Y, _YAW = range(3)
"""First columns of a motion."""

_ROLL, _PITCH = 3, 4
"""Columns of the errors after those of x, y and yaw."""


class Robots(NamedTuple):
    """State of n robots, one row each.

    Attributes:
        worlds: Index of the robot's world, shape (n,).
        motions: State of the plant: x, y, yaw, speed, yaw rate, slip of both, sideways speed,
            shape (n, 8).
        flags: True if it touches something, if it has rolled over, shape (n, 2).
        errors: Errors of the believed pose: x, y [m], yaw, roll, pitch [rad], shape (n, 5).
        steps: Number of control steps of the drive, shape (n,).
        slip: Standard normal draws of the plant, shape (n, AHEAD, TICKS_PER_STEP, 2).
        wander: Standard normal draws of the errors, shape (n, AHEAD, 5).
    """

    worlds: NDArray[np.int64]
    motions: NDArray[np.float64]
    flags: NDArray[np.bool_]
    errors: NDArray[np.float64]
    steps: NDArray[np.int64]
    slip: NDArray[np.float64]
    wander: NDArray[np.float64]

    @classmethod
    def make(cls, count: int) -> "Robots":
        """Return the state of some robots at rest."""
        return cls(
            worlds=np.zeros(count, dtype=np.int64),
            motions=np.zeros((count, 8)),
            flags=np.zeros((count, 2), dtype=np.bool_),
            errors=np.zeros((count, 5)),
            steps=np.zeros(count, dtype=np.int64),
            slip=np.zeros((count, AHEAD, TICKS_PER_STEP, 2)),
            wander=np.zeros((count, AHEAD, 5)),
        )


class Worlds(NamedTuple):
    """Static worlds of one size, laid out behind each other; see ``worlds.rays.layout.Layout``."""

    heights: NDArray[np.float32]
    surface: NDArray[np.uint8]
    cover: NDArray[np.uint8]
    contact: NDArray[np.uint8]
    tops: NDArray[np.float64]
    lids: NDArray[np.float64]
    objects: NDArray[np.int64]
    kinds: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    starts: NDArray[np.int64]
    faces: NDArray[np.int64]
    planes: NDArray[np.float64]
    firsts: NDArray[np.int64]
    lists: NDArray[np.int64]
    members: NDArray[np.int64]
    frame: GridFrame
    lattice: Lattice
    raster: NDArray[np.float64]


class TerrainObstacles(NamedTuple):
    """One world for the batch: what beams and bodies meet in it.

    Attributes:
        layout: Ground and objects as rays meet them.
        contact: Cells that a body can touch; see ``contact_map``.
        raster: x and y of the first cell's corner, and edge of a cell [m].
    """

    layout: Layout
    contact: NDArray[np.uint8]
    raster: tuple[float, float, float]


class BatchBody(NamedTuple):
    """Numbers of the plant and of the believed pose.

    Attributes:
        slip: Standard deviation of what a tick adds to the slip.
        limits: Limits of the drive (``PlantParameters``), shape (6,).
        sliding: Slip of the wheels (``PlantParameters``), shape (3,).
        wheels: Places of the wheels (``PlantParameters``).
        outline: Outline of the body (``PlantParameters``).
        radius: Radius of the body for moving obstacles [m].
        keep: Share of each error that stays from step to step, shape (5,).
        spread: Standard deviation of each error, and of what a step adds, shape (2, 5).
    """

    slip: float
    limits: NDArray[np.float64]
    sliding: NDArray[np.float64]
    wheels: NDArray[np.float64]
    outline: NDArray[np.float64]
    radius: float
    keep: NDArray[np.float64]
    spread: NDArray[np.float64]


class Beams(NamedTuple):
    """A planar laser.

    Attributes:
        directions: Cosine and sine of each beam's bearing, shape (b, 2).
        x: Position of the laser on the robot [m].
        y: Position of the laser on the robot [m].
        z: Height of the laser [m].
        max_range: Largest range [m].
    """

    directions: NDArray[np.float64]
    x: float
    y: float
    z: float
    max_range: float


def lay_out(worlds: list[TerrainObstacles]) -> Worlds:
    """Return worlds behind each other.

    Raises:
        ValueError: If they are not of one size.
    """
    grounds = [world.layout.ground for world in worlds]
    objects = [world.layout.objects for world in worlds]
    indices = [world.layout.blocks for world in worlds]
    shapes = {(g.heights.shape, b.tops.shape) for g, b in zip(grounds, indices, strict=True)}
    if len(shapes) > 1:
        raise ValueError(f"worlds: expected mazes of one size, got {sorted(shapes)}")
    return Worlds(
        heights=np.stack([ground.heights for ground in grounds]),
        surface=np.stack([ground.surface for ground in grounds]),
        cover=np.stack([ground.cover for ground in grounds]),
        contact=np.stack([world.contact for world in worlds]),
        tops=np.stack([blocks.tops for blocks in indices]),
        lids=np.stack([blocks.lids for blocks in indices]),
        objects=_ends([len(each.kinds) for each in objects]),
        kinds=np.concatenate([each.kinds for each in objects]),
        boxes=np.concatenate([each.boxes for each in objects]),
        starts=np.concatenate([each.starts for each in objects]),
        faces=_ends([len(each.planes) for each in objects]),
        planes=np.concatenate([each.planes for each in objects]),
        firsts=np.stack([blocks.firsts for blocks in indices]),
        lists=_ends([len(blocks.members) for blocks in indices]),
        members=np.concatenate([blocks.members for blocks in indices]),
        frame=grounds[0].frame,
        lattice=indices[0].lattice._replace(
            z_min=min(blocks.lattice.z_min for blocks in indices),
            z_max=max(blocks.lattice.z_max for blocks in indices),
        ),
        raster=np.array(worlds[0].raster),
    )


def _ends(counts: list[int]) -> NDArray[np.int64]:
    """Return the begin of each part, and the end of the last."""
    return np.cumsum([0, *counts])


@kernel
def move(
    twists: NDArray[np.float64],
    chosen: NDArray[np.bool_],
    robots: Robots,
    movers: Movers,
    worlds: Worlds,
    body: BatchBody,
    period: float,
) -> None:
    """Move the chosen robots, their moving obstacles and the errors for one control period.

    Args:
        twists: Speed [m/s] and yaw rate [rad/s] that the wheels are commanded, shape (n, 2).
        chosen: True for robots that move, shape (n,).
        robots: State, changed in place.
        movers: Moving obstacles, changed in place.
        worlds: Static worlds.
        body: Numbers of plant and errors.
        period: Control period [s].
    """
    rows = np.empty((TICKS_PER_STEP, 9))
    noise = np.empty((TICKS_PER_STEP, 2))
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        w, step = robots.worlds[k], robots.steps[k] % AHEAD
        for t in range(TICKS_PER_STEP):
            for c in range(2):
                noise[t, c] = body.slip * robots.slip[k, step, t, c]
        robots.flags[k, 0] = False
        drive_ticks(
            robots.motions[k],
            twists[k],
            noise,
            body.limits,
            body.sliding,
            (worlds.heights[w], worlds.frame.cell, body.wheels),
            (
                worlds.contact[w],
                worlds.raster[0],
                worlds.raster[1],
                worlds.raster[2],
                body.outline,
            ),
            (NO_DRAG.force, NO_DRAG.x_min, NO_DRAG.y_min, NO_DRAG.cell),
            rows,
            robots.flags[k],
        )
        for m in range(movers.radii.shape[1]):
            for c in range(2):
                movers.places[k, m, c] += movers.velocities[k, m, c] * period
            away = np.hypot(
                movers.places[k, m, 0] - robots.motions[k, _X],
                movers.places[k, m, 1] - robots.motions[k, _Y],
            )
            if away < movers.radii[k, m] + body.radius:
                robots.flags[k, 0] = True
        # Each error is a first-order Gauss-Markov process.
        for e in range(5):
            robots.errors[k, e] *= body.keep[e]
            robots.errors[k, e] += body.spread[1, e] * robots.wander[k, step, e]
        robots.steps[k] += 1


@kernel
def measure(
    chosen: NDArray[np.bool_],
    robots: Robots,
    movers: Movers,
    worlds: Worlds,
    beams: Beams,
    ranges: NDArray[np.float32],
) -> None:
    """Write the ranges of the chosen robots' beams [m], float32, shape (n, b)."""
    count = len(beams.directions)
    rays = np.zeros((count, 6), dtype=np.float32)
    budgets = np.full(count, np.inf, dtype=np.float32)
    measured = np.empty(count, dtype=np.float32)
    classes = np.empty(count, dtype=np.uint8)
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        w, motion = robots.worlds[k], robots.motions[k]
        c, s = np.cos(motion[_YAW]), np.sin(motion[_YAW])
        for b in range(count):
            u, v = beams.directions[b]
            rays[b, 0] = motion[_X] + c * beams.x - s * beams.y
            rays[b, 1] = motion[_Y] + s * beams.x + c * beams.y
            rays[b, 2] = beams.z
            rays[b, 3], rays[b, 4] = u * c - v * s, v * c + u * s
        _cast(rays, budgets, beams.max_range, worlds, w, measured, classes)
        for b in range(count):
            # What returns nothing is free as far as the laser sees.
            distance = measured[b] if np.isfinite(measured[b]) else np.float32(beams.max_range)
            for m in range(movers.radii.shape[1]):
                place, radius = movers.places[k, m], movers.radii[k, m]
                distance = min(distance, np.float32(_to_circle(rays[b], place, radius)))
            ranges[k, b] = distance


@kernel
def _cast(
    rays: NDArray[np.float32],
    budgets: NDArray[np.float32],
    max_range: float,
    worlds: Worlds,
    w: int,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Cast rays in one of the worlds that are laid out behind each other."""
    objects, faces, lists = worlds.objects, worlds.faces, worlds.lists
    layout = Layout(
        Ground(worlds.heights[w], worlds.surface[w], worlds.cover[w], worlds.frame),
        ConvexObjects(
            worlds.kinds[objects[w] : objects[w + 1]],
            worlds.boxes[objects[w] : objects[w + 1]],
            worlds.starts[objects[w] + w : objects[w + 1] + w + 1],
            worlds.planes[faces[w] : faces[w + 1]],
        ),
        Blocks(
            worlds.lattice,
            worlds.tops[w],
            worlds.lids[w],
            worlds.firsts[w],
            worlds.members[lists[w] : lists[w + 1]],
        ),
        STILL_AIR,
    )
    cast_rays(rays, budgets, NO_TIMES, max_range, layout, ranges, classes)


@kernel
def _to_circle(ray: NDArray[np.float32], centre: NDArray[np.float64], radius: float) -> float:
    """Return the distance along a level ray to a circle [m], infinity past it, 0 inside."""
    x, y = centre[0] - ray[0], centre[1] - ray[1]
    along = x * ray[3] + y * ray[4]
    inside = radius * radius - (x * x + y * y - along * along)
    if x * x + y * y <= radius * radius:
        return 0.0
    if along < 0.0 or inside < 0.0:
        return np.inf
    return float(along - np.sqrt(inside))


@kernel
def heading_errors(
    motions: NDArray[np.float64], errors: NDArray[np.float64], goals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the bearings of goals from the believed poses, relative to the headings, (n,) [rad].

    A believed roll and pitch turn the heading of a level robot, too.
    """
    bearings = np.empty(len(motions))
    for k in range(len(motions)):
        motion, error = motions[k], errors[k]
        c, s = np.cos(motion[_YAW]), np.sin(motion[_YAW])
        cr, sr = np.cos(error[_ROLL]), np.sin(error[_ROLL])
        cp, sp = np.cos(error[_PITCH]), np.sin(error[_PITCH])
        yaw = error[_YAW] + np.arctan2(s * cr, c * cp + s * sr * sp)
        x, y = motion[_X] + error[_X], motion[_Y] + error[_Y]
        angle = np.arctan2(goals[k, 1] - y, goals[k, 0] - x) - yaw
        bearings[k] = np.pi - (np.pi - angle) % (2 * np.pi)
    return bearings
