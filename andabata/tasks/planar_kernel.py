"""The compiled pass of stage 1: plant, beams, errors, judge and reward of all robots for one step.

Plant and rays are the compiled functions that a single robot is driven with.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.clock import TICK_HZ, TICKS_PER_STEP
from andabata.machine.kinematic_vehicle import drive_ticks
from andabata.tasks.episode_monitor import Outcome
from terrain.kernel import kernel
from worlds.ray_walk import cast_rays
from worlds.rays import Layout
from worlds.world import Geofence, Task

AHEAD = 16
"""Steps whose draws are made at once."""

GOING, GOAL, COLLISION, TIPOVER, STUCK, TIMEOUT = range(6)
OUTCOMES = (None, Outcome.GOAL, Outcome.COLLISION, Outcome.TIPOVER, Outcome.STUCK, Outcome.TIMEOUT)
"""What the compiled pass's numbers mean."""


class FlatRobots(NamedTuple):
    """The robots, one row each.

    Attributes:
        worlds: Which of the laid-out worlds each is in.
        motions: Of the plant: x, y, yaw, speed, yaw rate, slip of both, sideways speed.
        flags: Whether each touches something, and whether it has rolled over.
        errors: Of the pose that it believes: x, y, yaw, roll, pitch.
        commands: The last two executed yaw rates, newest first [rad/s].
        goals: x and y [m].
        distances: To the goal [m].
        anchors: Where it was last seen to move, x, y [m] and when [s].
        steps: Control steps of its drive.
        slip: Standard normal draws of the plant, for ``AHEAD`` steps.
        wander: Of the errors.
    """

    worlds: NDArray[np.int64]
    motions: NDArray[np.float64]
    flags: NDArray[np.bool_]
    errors: NDArray[np.float64]
    commands: NDArray[np.float64]
    goals: NDArray[np.float64]
    distances: NDArray[np.float64]
    anchors: NDArray[np.float64]
    steps: NDArray[np.int64]
    slip: NDArray[np.float64]
    wander: NDArray[np.float64]

    @classmethod
    def make(cls, count: int) -> "FlatRobots":
        """Return room for some robots."""
        return cls(
            np.zeros(count, dtype=np.int64),
            np.zeros((count, 8)),
            np.zeros((count, 2), dtype=np.bool_),
            np.zeros((count, 5)),
            np.zeros((count, 2)),
            np.zeros((count, 2)),
            np.zeros(count),
            np.zeros((count, 3)),
            np.zeros(count, dtype=np.int64),
            np.zeros((count, AHEAD, TICKS_PER_STEP, 2)),
            np.zeros((count, AHEAD, 5)),
        )


class FlatWorlds(NamedTuple):
    """Mazes of one size, laid out behind each other."""

    heights: NDArray[np.float32]
    surface: NDArray[np.uint8]
    contact: NDArray[np.uint8]
    tops: NDArray[np.float64]
    things: NDArray[np.int64]
    kinds: NDArray[np.uint8]
    boxes: NDArray[np.float64]
    starts: NDArray[np.int64]
    faces: NDArray[np.int64]
    planes: NDArray[np.float64]
    firsts: NDArray[np.int64]
    lists: NDArray[np.int64]
    members: NDArray[np.int64]
    frame: NDArray[np.float64]
    lattice: NDArray[np.float64]
    squares: NDArray[np.int64]
    raster: NDArray[np.float64]


class Maze(NamedTuple):
    """A world: what rays meet, tasks, ``contact_map``, x, y and cell of that [m], and geofence."""

    layout: Layout
    tasks: tuple[Task, ...]
    contact: NDArray[np.uint8]
    raster: tuple[float, float, float]
    geofence: Geofence


class Rules(NamedTuple):
    """Numbers of robot, plant, errors, beams, judge and reward; see ``_make_rules``."""

    body: NDArray[np.float64]
    limits: NDArray[np.float64]
    sliding: NDArray[np.float64]
    wheels: NDArray[np.float64]
    outline: NDArray[np.float64]
    keep: NDArray[np.float64]
    spread: NDArray[np.float64]
    beams: NDArray[np.float64]
    judge: NDArray[np.float64]
    reward: NDArray[np.float64]
    weights: NDArray[np.float64]


def lay_out(mazes: list[Maze]) -> FlatWorlds:
    """Return worlds behind each other.

    Raises:
        ValueError: If they are not of one size.
    """
    layouts = [maze.layout for maze in mazes]
    shapes = {(ground.heights.shape, blocks.tops.shape) for ground, _, blocks in layouts}
    if len(shapes) > 1:
        raise ValueError(f"worlds: expected mazes of one size, got {sorted(shapes)}")
    ground, _, blocks = layouts[0]
    things = [things for _, things, _ in layouts]
    return FlatWorlds(
        heights=np.stack([ground.heights for ground, _, _ in layouts]),
        surface=np.stack([ground.surface for ground, _, _ in layouts]),
        contact=np.stack([maze.contact for maze in mazes]),
        tops=np.stack([blocks.tops for _, _, blocks in layouts]),
        things=_ends([len(each.kinds) for each in things]),
        kinds=np.concatenate([each.kinds for each in things]),
        boxes=np.concatenate([each.boxes for each in things]),
        starts=np.concatenate([each.starts for each in things]),
        faces=_ends([len(each.planes) for each in things]),
        planes=np.concatenate([each.planes for each in things]),
        firsts=np.stack([blocks.firsts for _, _, blocks in layouts]),
        lists=_ends([len(blocks.members) for _, _, blocks in layouts]),
        members=np.concatenate([blocks.members for _, _, blocks in layouts]),
        frame=ground.frame,
        lattice=np.array([*blocks.lattice[:3], *_heights_of(layouts)]),
        squares=blocks.squares,
        raster=np.array(mazes[0].raster),
    )


def _heights_of(layouts: list[Any]) -> tuple[float, float]:
    """Return less and more than any z of the worlds [m]."""
    floors = [blocks.lattice[3] for _, _, blocks in layouts]
    return min(floors), max(blocks.lattice[4] for _, _, blocks in layouts)


def _ends(counts: list[int]) -> NDArray[np.int64]:
    """Return where each part begins, and the end of the last."""
    return np.cumsum([0, *counts])


@kernel
def advance(steering, chosen, move, robots, worlds, rules, states, terms, outcomes):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Let each chosen robot move for a control step, where ``move``, and look around."""
    sectors = len(rules.beams)
    rays = np.zeros((sectors, 6), dtype=np.float32)
    budgets = np.full(sectors, np.inf, dtype=np.float32)
    ranges = np.empty(sectors, dtype=np.float32)
    classes = np.empty(sectors, dtype=np.uint8)
    rows = np.empty((TICKS_PER_STEP, 9))
    twist = np.empty(2)
    noise = np.empty((TICKS_PER_STEP, 2))
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        w, motion = robots.worlds[k], robots.motions[k]
        if move:
            _command(steering[k], robots.commands[k], rules.body, twist)
            here = robots.steps[k] % AHEAD
            for t in range(TICKS_PER_STEP):
                for c in range(2):
                    noise[t, c] = rules.body[7] * robots.slip[k, here, t, c]
            robots.flags[k, 0] = False
            drive_ticks(
                motion,
                twist,
                noise,
                rules.limits,
                rules.sliding,
                (worlds.heights[w], worlds.frame[2], rules.wheels),
                (
                    worlds.contact[w],
                    worlds.raster[0],
                    worlds.raster[1],
                    worlds.raster[2],
                    rules.outline,
                ),
                rows,
                robots.flags[k],
            )
            for e in range(5):
                robots.errors[k, e] *= rules.keep[e]
                robots.errors[k, e] += rules.spread[1, e] * robots.wander[k, here, e]
            robots.steps[k] += 1
        c, s = np.cos(motion[2]), np.sin(motion[2])
        for sector in range(sectors):
            rays[sector, 0], rays[sector, 1] = motion[0], motion[1]
            rays[sector, 2] = rules.body[6]
            rays[sector, 3] = rules.beams[sector, 0] * c - rules.beams[sector, 1] * s
            rays[sector, 4] = rules.beams[sector, 1] * c + rules.beams[sector, 0] * s
        things, faces, lists = worlds.things, worlds.faces, worlds.lists
        cast_rays(
            rays,
            budgets,
            rules.reward[4],
            worlds.heights[w],
            worlds.surface[w],
            worlds.frame,
            worlds.kinds[things[w] : things[w + 1]],
            worlds.boxes[things[w] : things[w + 1]],
            worlds.starts[things[w] + w : things[w + 1] + w + 1],
            worlds.planes[faces[w] : faces[w + 1]],
            worlds.lattice,
            worlds.squares,
            worlds.tops[w],
            worlds.firsts[w],
            worlds.members[lists[w] : lists[w + 1]],
            ranges,
            classes,
        )
        repulsion = 0.0
        for sector in range(sectors):
            if not np.isfinite(ranges[sector]):
                ranges[sector] = rules.reward[4]
            states[k, sector] = ranges[sector]
            repulsion += rules.weights[sector] * (rules.reward[1] - ranges[sector])
        states[k, sectors], states[k, sectors + 1] = robots.commands[k]
        states[k, sectors + 2] = heading_error(motion, robots.errors[k], robots.goals[k])
        before = robots.distances[k]
        distance = np.hypot(robots.goals[k, 0] - motion[0], robots.goals[k, 1] - motion[1])
        robots.distances[k] = distance
        if move:
            outcome = _verdict(
                robots.flags[k], motion, distance, robots.anchors[k], robots.steps[k], rules.judge
            )
            outcomes[k] = outcome
            terms[k, 0] = rules.reward[0] * (before - distance)
            terms[k, 1] = -repulsion
            terms[k, 2] = rules.reward[2] if outcome in (COLLISION, STUCK) else 0.0
            terms[k, 3] = rules.reward[3] if outcome == TIPOVER else 0.0


@kernel
def _command(steering, commands, body, twist):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the twist of a wanted yaw rate as ``Navigator.command`` and ``SkidSteer`` do."""
    speed, limit, dead_zone, half_track, radius, fastest = body[:6]
    executed = min(max(steering, -limit), limit)
    if abs(executed) < dead_zone:
        executed = 0.0
    commands[1] = commands[0]
    commands[0] = executed
    left = (speed - executed * half_track) / radius
    right = (speed + executed * half_track) / radius
    scale = min(1.0, fastest / max(abs(left), abs(right), 1e-12))
    left, right = left * scale * radius, right * scale * radius
    twist[0], twist[1] = (left + right) / 2, (right - left) / (2 * half_track)


@kernel
def heading_error(motion, errors, goal):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the bearing of the goal from where the robot believes to be and to head [rad]."""
    c, s = np.cos(motion[2]), np.sin(motion[2])
    cr, sr, cp, sp = np.cos(errors[3]), np.sin(errors[3]), np.cos(errors[4]), np.sin(errors[4])
    yaw = errors[2] + np.arctan2(s * cr, c * cp + s * sr * sp)
    x, y = motion[0] + errors[0], motion[1] + errors[1]
    angle = np.arctan2(goal[1] - y, goal[0] - x) - yaw
    return np.pi - (np.pi - angle) % (2 * np.pi)


@kernel
def _verdict(flags, motion, distance, anchor, steps, judge):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return how the drive ended, if it did, as ``EpisodeMonitor`` does."""
    stamp = steps * TICKS_PER_STEP / TICK_HZ
    if flags[1]:
        return TIPOVER
    if flags[0]:
        return COLLISION
    if distance < judge[0]:
        return GOAL
    if np.hypot(motion[0] - anchor[0], motion[1] - anchor[1]) > judge[3]:
        anchor[0], anchor[1], anchor[2] = motion[0], motion[1], stamp
    if stamp - anchor[2] > judge[2]:
        return STUCK
    return TIMEOUT if stamp >= judge[1] else GOING
