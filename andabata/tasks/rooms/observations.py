"""Observations in rooms: points of a planar laser, goal and velocity, in the robot's frame.

An observation is a function of a situation (room, pose, speeds, goal, moving obstacles) and of a
laser, so that a replay buffer keeps situations, a few numbers each, and renders them anew.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import as_kept, laser_arrays
from andabata.tasks.rooms.kernel import (
    MIN_RANGE,
    YAW,
    Lasers,
    Rooms,
    V,
    X,
    cast,
)
from andabata.tasks.rooms.mover_terms import MOVER_COLUMNS
from andabata.tasks.rooms.points import bearing_windows, take_earlier_windows, take_points
from andabata.tasks.rooms.terms import RoomTerms, encoded_goals
from worlds.rooms.mover_motion import Movers

_HEAD = 8
"""Number of columns of a situation before its movers: room, motion, target."""

_MOVER = 5
"""Number of columns of a mover: place, velocity, radius."""

_EARLIER = 3
"""Number of columns of an earlier pose, and of each mover then: place and radius."""


class EarlierScans(NamedTuple):
    """What was seen some control steps ago, and from where.

    Attributes:
        reciprocals: Reciprocals of the beams as ``cast`` writes them, float32, shape (n, b).
        poses: x, y [m] and yaw [rad] of each robot then, shape (n, 3).
        places: Centres of its moving obstacles then [m], shape (n, m, 2).
        radii: Radii of them, 0 where there was none [m], shape (n, m).
    """

    reciprocals: NDArray[np.float32]
    poses: NDArray[np.float64]
    places: NDArray[np.float64]
    radii: NDArray[np.float64]

    def of(self, numbers: NDArray[np.intp]) -> "EarlierScans":
        """Return those of some robots, by their indices."""
        return EarlierScans(
            self.reciprocals[numbers],
            self.poses[numbers],
            self.places[numbers],
            self.radii[numbers],
        )


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
        lasers = []
        for _ in range(count):
            fov, beams = rng.uniform(*self.fov_deg), np.exp(rng.uniform(*np.log(self.beams)))
            lasers.append(
                PlanarLidarConfig(
                    fov_deg=fov,
                    resolution_deg=min(fov / max(round(beams) - 1, 1), 360.0),
                    max_range=rng.uniform(*self.max_range),
                    x=rng.uniform(*self.x),
                )
            )
        return lasers


class RoomRenderer:
    """Renders observations of situations, with the task's laser or with lasers drawn at random.

    A situation is a float32 row: index of the room; x, y, yaw, speed and yaw rate of the robot;
    x and y of the goal; x and y, velocity in x and y, and radius of each moving obstacle, 0 where
    there is none. With an earlier scan its pose follows, and x, y and radius of each obstacle then,
    with tracked movers these as they were observed, for which no other laser is drawn.
    Without noise the same laser gives the same bits as when the robot was there.

    Attributes:
        size: Length of a situation.
        terms: Parts of an observation.
        movers: Number of moving obstacles of a situation.
    """

    def __init__(
        self,
        rooms: Rooms,
        lidars: Sequence[PlanarLidarConfig],
        terms: RoomTerms,
        movers: int = 0,
        randomization: LidarRandomization | None = None,
    ) -> None:
        """Prepare for rooms and lasers.

        Args:
            rooms: Rooms by their index.
            lidars: Lasers: the task's own, and those that are drawn from.
            terms: Parts of an observation.
            movers: Number of moving obstacles of a situation.
            randomization: How lasers are drawn when situations are rendered; None draws none.
        """
        self.size = _HEAD + _MOVER * movers
        if terms.earlier_scan:
            self.size += _EARLIER * (1 + movers)
        self._tracked = self.size
        self.size += MOVER_COLUMNS * terms.tracked_movers
        self.terms, self.movers = terms, movers
        self._rooms = rooms
        self._lasers = laser_arrays(lidars)
        self._windows = bearing_windows(self._lasers, terms.windows, terms.window_fov)
        self._randomization = randomization

    def situations(
        self,
        places: NDArray[np.int64],
        motions: NDArray[np.float64],
        targets: NDArray[np.float64],
        movers: Movers,
        earlier: EarlierScans | None = None,
        tracked: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float32]:
        """Return the situations of robots, float32, shape (n, size).

        Args:
            places: Index of each robot's room, shape (n,).
            motions: Motion of each robot, shape (n, 5).
            targets: Goal, or sub-goal, that each robot is given [m], shape (n, 2).
            movers: Moving obstacles; those that are not there have radius 0.
            earlier: Earlier scans, where the terms have one.
            tracked: Movers by their tracks, where the terms have some; see ``SeenMovers``.
        """
        columns = [places[:, None], motions, targets]
        around = [movers.places, movers.velocities, movers.radii[..., None]]
        columns.append(_present(around, movers.radii))
        if earlier is not None:
            columns.append(earlier.poses)
            columns.append(_present([earlier.places, earlier.radii[..., None]], earlier.radii))
        if tracked is not None:
            columns.append(tracked.reshape(len(places), -1).astype(np.float64))
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
        rooms, poses, targets = rows[:, 0].astype(np.int64), rows[:, 1:4], rows[:, 6:_HEAD]
        end = _HEAD + _MOVER * self.movers
        around = rows[:, _HEAD:end].reshape(count, self.movers, _MOVER)

        def scanned(
            poses: NDArray[np.float64], places: NDArray[np.float64], radii: NDArray[np.float64]
        ) -> NDArray[np.float32]:
            """Return the reciprocals of the beams from poses, among movers."""
            beams = np.zeros((count, self._lasers.directions.shape[2]), dtype=np.float32)
            chosen = np.ones(count, dtype=np.bool_)
            movers = Movers(places.copy(), np.zeros_like(places), radii.copy())
            motions = np.concatenate([poses, np.zeros((count, 2))], axis=1)
            cast(motions, chosen, rooms, self._rooms, movers, self._lasers, mounted, beams)
            return noisy(beams, self._lasers, mounted, sigma, rng) if sigma.any() else beams

        beams, earlier = scanned(poses, around[..., :2], around[..., 4]), None
        if self.terms.earlier_scan:
            then = rows[:, end : end + _EARLIER].copy()
            around = rows[:, end + _EARLIER : self._tracked].reshape(count, self.movers, _EARLIER)
            places, radii = around[..., :2], around[..., 2]
            earlier = EarlierScans(scanned(then, places, radii), then, places, radii)
        tracked = situations[:, self._tracked :]
        return self.observe(beams, mounted, rows[:, 1:6], targets, earlier, tracked)

    def observe(
        self,
        beams: NDArray[np.float32],
        mounted: NDArray[np.int64],
        motions: NDArray[np.float64],
        targets: NDArray[np.float64],
        earlier: EarlierScans | None = None,
        tracked: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float32]:
        """Return observations of beams that were cast, float32, shape (n, n_observations).

        Args:
            beams: Reciprocals as ``cast`` writes them, shape (n, b).
            mounted: Index of each robot's laser, the task's own first, shape (n,).
            motions: Motion of each robot, shape (n, 5).
            targets: Goal, or sub-goal, of each robot [m], shape (n, 2).
            earlier: Earlier scans, where the terms have one.
            tracked: Movers by their tracks, where the terms have some; see ``SeenMovers``.
        """
        terms, motions = self.terms, as_kept(motions)
        poses = motions[:, X : YAW + 1].copy()
        goals = encoded_goals(poses, as_kept(targets), terms.goal_encoding)
        first = 3 * terms.points
        head = first + terms.windows * (1 if earlier is None else 2)
        end = head + goals.shape[1] + 2
        behind = MOVER_COLUMNS * terms.tracked_movers
        rows = np.empty((len(beams), end + behind), dtype=np.float32)
        chosen = np.ones(len(beams), dtype=np.bool_)
        take_points(beams, chosen, self._lasers, mounted, terms.points, self._windows, rows)
        if earlier is not None:
            seen, then = rows[:, head - terms.windows : head], as_kept(earlier.poses)
            scans = earlier.reciprocals, then, poses
            take_earlier_windows(*scans, self._lasers, mounted, self._windows, seen)
        if terms.as_ranges:
            # The reciprocal of that of the largest range may be larger by rounding.
            most = self._lasers.max_ranges[mounted].astype(np.float32)[:, None]
            rows[:, first:head] = np.minimum(np.float32(1.0) / rows[:, first:head], most)
        rows[:, head : end - 2], rows[:, end - 2 : end] = goals, motions[:, V:]
        if tracked is not None:
            rows[:, end:] = tracked.reshape(len(beams), behind)
        return rows


def _present(
    columns: Sequence[NDArray[np.float64]], radii: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return columns of movers side by side, 0 for those that are not there, shape (n, k m)."""
    columns_present = np.concatenate(columns, axis=2) * (radii[..., None] > 0.0)
    return columns_present.reshape(len(radii), -1)


def noisy(
    beams: NDArray[np.float32],
    lasers: Lasers,
    mounted: NDArray[np.int64],
    sigma: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return beams with noise on the ranges of those that returned.

    Args:
        beams: Reciprocals as ``cast`` writes them, shape (n, b).
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        sigma: Standard deviation of the ranges of each robot [m], shape (n,).
        rng: Source of randomness.
    """
    silent = np.float32(1.0) / lasers.max_ranges[mounted].astype(np.float32)[:, None]
    with np.errstate(divide="ignore"):
        ranges = 1.0 / beams + sigma[:, None] * rng.standard_normal(beams.shape, dtype=np.float32)
    reciprocals = np.float32(1.0) / np.maximum(ranges, MIN_RANGE).astype(np.float32)
    return np.where(beams > silent, np.maximum(reciprocals, silent), beams)
