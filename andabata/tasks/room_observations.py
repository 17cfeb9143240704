"""Observations in rooms: points of a planar laser, goal and velocity, in the robot's frame.

An observation is a function of a situation (room, pose, speeds, goal, moving obstacles) and of a
laser, so that a replay buffer keeps situations, a few numbers each, and renders them anew.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar_lidar import PlanarLidarConfig
from andabata.tasks.movers import Movers
from andabata.tasks.room_batch import laser_arrays
from andabata.tasks.room_kernel import (
    MIN_RANGE,
    YAW,
    Lasers,
    Rooms,
    V,
    X,
    cast,
)
from andabata.tasks.room_points import SECTORS, take_points
from rl.spaces import ObservationSpec, ObservationTerm

GoalEncoding = Literal["cosine", "polar"]
"""Goal as distance, cosine and sine of the bearing, or as distance and bearing (paper)."""

GOAL_DISTANCE = 5.0
"""Distance that a goal's distance is divided by with ``cosine`` [m]."""

_FAR = 100.0
"""Bound of a goal's distance [m]."""

_HEAD = 8
"""Number of columns of a situation before its movers: room, motion, target."""


class LidarRandomization(BaseModel):
    """Ranges that the lasers of rendered observations are drawn from, uniformly.

    Attributes:
        share: Share of the observations with a drawn laser; the others have the task's own.
        fov_deg: Field of view [deg].
        beams: Number of beams, drawn evenly on a logarithmic scale.
        max_range: Largest range [m].
        x: Position before the robot's centre [m].
        noise: Standard deviation of a beam's range [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    share: float = Field(default=0.5, ge=0, le=1)
    fov_deg: tuple[float, float] = (180.0, 360.0)
    beams: tuple[int, int] = (10, 1080)
    max_range: tuple[float, float] = (4.0, 10.0)
    x: tuple[float, float] = (-0.1, 0.1)
    noise: tuple[float, float] = (0.0, 0.02)

    def draw(self, rng: np.random.Generator, count: int) -> list[PlanarLidarConfig]:
        """Return random lasers.

        Args:
            rng: Source of randomness.
            count: Number of lasers.
        """
        found = []
        for _ in range(count):
            fov, beams = rng.uniform(*self.fov_deg), np.exp(rng.uniform(*np.log(self.beams)))
            found.append(
                PlanarLidarConfig(
                    fov_deg=fov,
                    resolution_deg=min(fov / max(round(beams) - 1, 1), 360.0),
                    max_range=rng.uniform(*self.max_range),
                    x=rng.uniform(*self.x),
                )
            )
        return found


def room_observations(points: int, encoding: GoalEncoding, max_speed: float) -> ObservationSpec:
    """Return the space of the observations.

    Args:
        points: Number of points, masked where a laser has fewer.
        encoding: Form of the goal.
        max_speed: Largest speed [m/s] and yaw rate [rad/s].
    """
    near = 1.0 / MIN_RANGE
    goal = ("goal", (3,), -1.0, _FAR / GOAL_DISTANCE, "5 m, 1, 1")
    if encoding == "polar":
        goal = ("goal", (2,), -np.pi, _FAR, "m, rad")
    return ObservationSpec(
        terms=(
            _term("points", (points, 2), -near, near, "1/m"),
            _term("mask", (points,), 0.0, 1.0, "1"),
            _term("windows", (SECTORS,), 0.0, near, "1/m"),
            _term(*goal),
            _term("velocity", (2,), -max_speed, max_speed, "m/s, rad/s"),
        )
    )


def _term(name: str, shape: tuple[int, ...], low: float, high: float, unit: str) -> ObservationTerm:
    """Return a term that networks take as it is."""
    return ObservationTerm(name=name, shape=shape, low=low, high=high, unit=unit, scaling="none")


def encoded_goals(
    poses: NDArray[np.float64], goals: NDArray[np.float64], encoding: GoalEncoding
) -> NDArray[np.float64]:
    """Return goals as networks take them, shape (n, 3) or (n, 2).

    Args:
        poses: x, y [m] and yaw [rad] of the robots, shape (n, 3).
        goals: Goals in the room [m], shape (n, 2).
        encoding: Form of the goal.
    """
    away = goals - poses[:, :2]
    distances = np.hypot(*away.T)
    bearings = np.arctan2(away[:, 1], away[:, 0]) - poses[:, 2]
    if encoding == "polar":
        return np.stack([distances, np.pi - (np.pi - bearings) % (2 * np.pi)], axis=1)
    return np.stack([distances / GOAL_DISTANCE, np.cos(bearings), np.sin(bearings)], axis=1)


class RoomRenderer:
    """Renders observations of situations, with the task's laser or with lasers drawn at random.

    A situation is a float32 row: index of the room; x, y, yaw, speed and yaw rate of the robot;
    x and y of the goal; and x, y and radius of each moving obstacle.

    Attributes:
        size: Length of a situation.
        points: Number of points of an observation.
        movers: Number of moving obstacles of a situation.
    """

    def __init__(
        self,
        rooms: Rooms,
        lidars: Sequence[PlanarLidarConfig],
        points: int,
        encoding: GoalEncoding,
        movers: int = 0,
        randomization: LidarRandomization | None = None,
    ) -> None:
        """Prepare for rooms and lasers.

        Args:
            rooms: Rooms by their index.
            lidars: Lasers: the task's own, and those that are drawn from.
            points: Number of points of an observation.
            encoding: Form of the goal.
            movers: Number of moving obstacles of a situation.
            randomization: How lasers are drawn when situations are rendered; None draws none.
        """
        self.size = _HEAD + 3 * movers
        self.points, self.movers = points, movers
        self._rooms, self._encoding = rooms, encoding
        self._lasers = laser_arrays(lidars)
        self._randomization = randomization

    def situations(
        self,
        places: NDArray[np.int64],
        motions: NDArray[np.float64],
        targets: NDArray[np.float64],
        movers: Movers,
    ) -> NDArray[np.float32]:
        """Return the situations of robots, float32, shape (n, size).

        Args:
            places: Index of each robot's room, shape (n,).
            motions: Motion of each robot, shape (n, 5).
            targets: Goal, or sub-goal, that each robot is given [m], shape (n, 2).
            movers: Moving obstacles; of those that are not there nothing is told.
        """
        around = np.concatenate([movers.places, movers.radii[..., None]], axis=2)
        around *= movers.radii[..., None] > 0.0
        columns = [places[:, None], motions, targets, around.reshape(len(places), -1)]
        return np.concatenate(columns, axis=1).astype(np.float32)

    def __call__(
        self, situations: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """Return the observations of situations, float32, shape (n, n_observations).

        Args:
            situations: Situations, shape (n, size).
            rng: Draws of lasers and of noise.
        """
        count = len(situations)
        mounted, sigma = np.zeros(count, dtype=np.int64), np.zeros(count)
        if self._randomization is not None:
            # The second half are the situations after those of the first: of the same robot.
            others, half = len(self._lasers.counts) - 1, -(-count // 2)
            drawn = rng.random(half) < self._randomization.share
            mounted = np.where(drawn, 1 + rng.integers(others, size=half), 0)
            sigma = np.where(drawn, rng.uniform(*self._randomization.noise, half), 0.0)
            mounted, sigma = np.tile(mounted, 2)[:count], np.tile(sigma, 2)[:count]
        rows = situations.astype(np.float64)
        places, motions = rows[:, 0].astype(np.int64), np.ascontiguousarray(rows[:, 1:6])
        around = rows[:, _HEAD:].reshape(count, self.movers, 3)
        movers = Movers(
            around[..., :2].copy(), np.zeros_like(around[..., :2]), around[..., 2].copy()
        )
        chosen = np.ones(count, dtype=np.bool_)
        found = np.zeros((count, self._lasers.directions.shape[2]), dtype=np.float32)
        cast(motions, chosen, places, self._rooms, movers, self._lasers, mounted, found)
        if sigma.any():
            found = noisy(found, self._lasers, mounted, sigma, rng)
        return self.observe(found, self._lasers, mounted, motions, rows[:, 6:_HEAD])

    def observe(
        self,
        found: NDArray[np.float32],
        lasers: Lasers,
        mounted: NDArray[np.int64],
        motions: NDArray[np.float64],
        targets: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """Return observations of beams that were cast, float32, shape (n, n_observations).

        Args:
            found: Reciprocals as ``cast`` writes them, shape (n, b).
            lasers: Lasers.
            mounted: Index of each robot's laser, shape (n,).
            motions: Motion of each robot, shape (n, 5).
            targets: Goal, or sub-goal, of each robot [m], shape (n, 2).
        """
        goals = encoded_goals(motions[:, X : YAW + 1], targets, self._encoding)
        head = 3 * self.points + SECTORS
        rows = np.empty((len(found), head + goals.shape[1] + 2), dtype=np.float32)
        chosen = np.ones(len(found), dtype=np.bool_)
        take_points(found, chosen, lasers, mounted, self.points, rows)
        rows[:, head:-2], rows[:, -2:] = goals, motions[:, V:]
        return rows


def noisy(
    found: NDArray[np.float32],
    lasers: Lasers,
    mounted: NDArray[np.int64],
    sigma: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return beams with noise on the ranges of those that returned.

    Args:
        found: Reciprocals as ``cast`` writes them, shape (n, b).
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        sigma: Standard deviation of the ranges of each robot [m], shape (n,).
        rng: Source of randomness.
    """
    silent = np.float32(1.0) / lasers.max_ranges[mounted].astype(np.float32)[:, None]
    with np.errstate(divide="ignore"):
        ranges = 1.0 / found + sigma[:, None] * rng.standard_normal(found.shape, dtype=np.float32)
    reciprocals = np.float32(1.0) / np.maximum(ranges, MIN_RANGE).astype(np.float32)
    return np.where(found > silent, np.maximum(reciprocals, silent), found)
