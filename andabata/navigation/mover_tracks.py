"""Tracks of movers: where they are, how they move, and how sure that is.

Detections are discs in a frame that does not jump, such as ``odom``: circles in the scans of a
planar laser, or clusters in clouds. They are followed from scan to scan: each is expected to go on
at the mean of its last velocities, in which older ones count less and less. A scan need not see
all movers: what the head of a turning laser shows once in seconds is expected in an area that
grows meanwhile.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel


class TrackedMovers(NamedTuple):
    """Discs that move, in the frame of the poses.

    Attributes:
        places: Centres [m], shape (k, 2).
        velocities: Velocities [m/s], shape (k, 2).
        radii: Radii [m], shape (k,).
        ages: Times since they were first seen [s], shape (k,).
        doubts: Distances from the centres within which they are expected [m], shape (k,).
        numbers: Numbers that tell tracks apart, whole and in the order of their begin, shape (k,).
    """

    places: NDArray[np.float64]
    velocities: NDArray[np.float64]
    radii: NDArray[np.float64]
    ages: NDArray[np.float64]
    doubts: NDArray[np.float64]
    numbers: NDArray[np.float64]

    @classmethod
    def none(cls) -> "TrackedMovers":
        """Return no movers."""
        pairs, single = np.zeros((0, 2)), np.zeros(0)
        return cls(pairs, pairs, single, single, single, single)

    def select(self, chosen: NDArray[np.bool_]) -> "TrackedMovers":
        """Return some of the movers, of a mask of shape (k,)."""
        return TrackedMovers(*(column[chosen] for column in self))


class TrackLaw(NamedTuple):
    """Gains and gates of tracks.

    Attributes:
        gate: Largest distance of a detection from where its track expects it [m].
        radius_gate: Largest difference of their radii [m].
        velocity_gain: Share of the velocity between the last two looks in the mean; in the first
            looks all velocities count alike.
        coasting_scans: Number of scans that a track goes on without being seen.
        period: Time between two scans [s].
        first_speed: Speed by which the gate of a track that was seen once grows [m/s].
        drift_speed: Speed by which that of others grows: movers turn [m/s].
        least_interval: Least time between two looks at the same mover [s]: what a turning laser
            sees sooner is another one.
    """

    gate: float
    radius_gate: float
    velocity_gain: float
    coasting_scans: int
    period: float
    first_speed: float = 0.0
    drift_speed: float = 0.0
    least_interval: float = 0.0


_COLUMNS = 12
_X, _Y, _VX, _VY, _RADIUS, _SEEN, _MISSED, _AGE, _NUMBER, _X0, _Y0, _TRAVEL = range(_COLUMNS)
"""Columns of a track: centre [m], velocity [m/s], radius [m], number of scans that saw it, of
scans since the last of these and since the first, number of the track, first centre [m], and the
largest distance from it at which the track was seen [m]."""


class MoverTracks:
    """Follows detections from scan to scan.

    Attributes:
        law: Gains and gates.
    """

    def __init__(
        self, law: TrackLaw, confirmation_scans: int, min_speed: float, min_travel: float = 0.0
    ) -> None:
        """Begin without tracks.

        Args:
            law: Gains and gates.
            confirmation_scans: Number of scans that have to see a track before it counts.
            min_speed: Speed from which on it moves [m/s].
            min_travel: Distance from where it was first seen that a track has to have been at [m]:
                one that comes back there moves on.
        """
        self.law = law
        self._confirmation = confirmation_scans
        self._min_speed, self._min_travel = min_speed, min_travel
        self.reset()

    def reset(self) -> None:
        """Forget all tracks."""
        self._tracks, self._begun = np.zeros((0, _COLUMNS)), 0

    def update(self, discs: NDArray[np.float64], scans: float = 1.0) -> TrackedMovers:
        """Take the detections of a scan, and return what moves.

        Args:
            discs: x, y, radius of the detections [m], shape (c, 3); those that are not finite are
                left out.
            scans: Time since the last call, in periods of a scan.
        """
        law = self.law
        discs = discs[np.isfinite(discs).all(axis=1)]
        self._tracks, self._begun = _followed(self._tracks, discs, law, scans, self._begun)
        tracks = self._tracks
        is_moving = np.hypot(tracks[:, _VX], tracks[:, _VY]) >= self._min_speed
        is_moving &= tracks[:, _TRAVEL] >= self._min_travel
        moving = tracks[is_moving & (tracks[:, _SEEN] >= self._confirmation)]
        growth = np.where(moving[:, _SEEN] > 1, law.drift_speed, law.first_speed)
        return TrackedMovers(
            moving[:, : _Y + 1],
            moving[:, _VX : _VY + 1],
            moving[:, _RADIUS],
            moving[:, _AGE] * law.period,
            law.gate + growth * moving[:, _MISSED] * law.period,
            moving[:, _NUMBER],
        )


@kernel
def _followed(
    tracks: NDArray[np.float64],
    discs: NDArray[np.float64],
    law: TrackLaw,
    scans: float,
    begun: int,
) -> tuple[NDArray[np.float64], int]:
    """Return tracks after a scan, the longest followed first, shape (k, 12), and how many began.

    Args:
        tracks: Tracks before it, shape (j, 12).
        discs: Detections of the scan, shape (c, 3).
        law: Gains and gates.
        scans: Time since the scan before it, in periods.
        begun: Number of tracks that began before.
    """
    followed = np.zeros((len(tracks) + len(discs), _COLUMNS))
    is_taken = np.zeros(len(discs), dtype=np.bool_)
    size, dt = 0, scans * law.period
    for track in tracks:
        x, y = track[_X] + track[_VX] * dt, track[_Y] + track[_VY] * dt
        unseen = (track[_MISSED] + scans) * law.period
        growth = law.drift_speed if track[_SEEN] > 1.0 else law.first_speed
        nearest, which = law.gate + growth * unseen, -1
        for c in range(len(discs)):
            away = np.hypot(discs[c, 0] - x, discs[c, 1] - y)
            alike = abs(discs[c, 2] - track[_RADIUS]) < law.radius_gate
            alike = alike and unseen >= law.least_interval
            if not is_taken[c] and alike and away < nearest:
                nearest, which = away, c
        if which < 0 and track[_MISSED] >= law.coasting_scans:
            continue
        new = followed[size]
        size += 1
        new[:] = track
        new[_X], new[_Y], new[_MISSED] = x, y, track[_MISSED] + scans
        new[_AGE] += scans
        if which >= 0:
            is_taken[which] = True
            seen = track[_SEEN]
            share = max(1.0 / seen, law.velocity_gain) / unseen
            new[_VX] += share * (discs[which, 0] - x)
            new[_VY] += share * (discs[which, 1] - y)
            new[_X], new[_Y] = discs[which, 0], discs[which, 1]
            new[_RADIUS] += (discs[which, 2] - track[_RADIUS]) / (seen + 1.0)
            new[_SEEN], new[_MISSED] = seen + 1.0, 0.0
            away = np.hypot(new[_X] - new[_X0], new[_Y] - new[_Y0])
            new[_TRAVEL] = max(new[_TRAVEL], away)
    for c in range(len(discs)):
        if not is_taken[c]:
            followed[size, _X], followed[size, _Y] = discs[c, 0], discs[c, 1]
            followed[size, _RADIUS], followed[size, _SEEN] = discs[c, 2], 1.0
            followed[size, _NUMBER] = begun
            followed[size, _X0], followed[size, _Y0] = discs[c, 0], discs[c, 1]
            size, begun = size + 1, begun + 1
    return followed[:size].copy(), begun
