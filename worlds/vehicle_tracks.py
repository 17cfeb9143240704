"""Tracks of vehicles in a natural world: wide enough, and away from the robot's starts."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from worlds.rooms.room import Room
from worlds.traversability_map import TraversabilityMap
from worlds.world import Task

_MARGIN = 0.2
"""Gap of a vehicle on its track from what stands [m] (assumption)."""

START_GAP = 2.0
"""Gap of a vehicle on its track from a start of the robot [m] (assumption)."""

_TRIES = 200
"""Number of tracks that are drawn before a vehicle stays away."""

_SPACING = 0.25
"""Distance of the places of a track that are looked at [m]."""

_LONGEST = 3.0
"""Longest straight distance of a track's ends, in units of the shortest (assumption)."""


def draw_track(
    radius: float,
    least: float,
    room: Room,
    truth: TraversabilityMap,
    tasks: Sequence[Task],
    rng: np.random.Generator,
) -> tuple[tuple[float, float], ...]:
    """Return the corners of a track [m]; none where no place for one was found.

    It is the shortest safe path of the true map between two random places, for a body as wide as
    the vehicle: straight in the open, winding between trees.

    Args:
        radius: Radius of the vehicle [m].
        least: Least distance between the ends [m].
        room: Solids; see ``solids_room``.
        truth: True map of where a body may drive.
        tasks: Tasks of the world, whose starts it keeps away from.
        rng: Source of randomness.
    """
    wide = radius + _MARGIN / 2
    half = np.array(room.half) - radius - _MARGIN
    starts = np.array([(task.start.x, task.start.y) for task in tasks]).reshape(-1, 2)
    for _ in range(_TRIES):
        begin = rng.uniform(-half, half)
        bearing = rng.uniform(-np.pi, np.pi)
        away = rng.uniform(least, _LONGEST * least)
        end = begin + away * np.array([np.cos(bearing), np.sin(bearing)])
        if (np.abs(end) > half).any():
            continue
        corners = truth.shortest_path(begin, end, radius + _MARGIN)
        if corners is None or len(corners) < 2:
            continue
        places = _along(corners)
        gaps = np.hypot(*(places[:, None] - starts).transpose(2, 0, 1))
        if (gaps > radius + START_GAP).all() and (room.clearance(places) > wide).all():
            return tuple((float(x), float(y)) for x, y in corners)
    return ()


def _along(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places along a path of corners [m], shape (k, 2)."""
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    steps = np.append(np.arange(0.0, at[-1], _SPACING), at[-1])
    return np.column_stack([np.interp(steps, at, corners[:, k]) for k in range(2)])
