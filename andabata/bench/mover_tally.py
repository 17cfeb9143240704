"""Compares the tracks of movers with the truth, step by step, whatever laser and world.

A moment is a control step at which a mover has been in sight for a second within 5 m. It is found
if a track is near its place. A track that is never near a mover is false.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

MAX_RANGE = 5.0
"""Range within which movers count [m]."""

_IN_SIGHT = 1.0
"""Time for which a mover has to be in sight before it counts [s]."""

_REACH = 6.0
"""Range up to which looks at a mover count [m]."""

_NEAR = 0.8
"""Distance of a track from a mover up to which it is that mover's [m]."""

_FALSE = 1.2
"""Distance from all movers from which on a track is nobody's [m]."""

_JUMP = 1.0
"""Distance in a step beyond which a mover has appeared elsewhere: it is another sighting [m]."""

Case = tuple[str, str, int]
"""Laser, kind of world and seed of a drive."""

Test = Callable[[int], bool]
"""Condition of the mover of an index."""


@dataclass(frozen=True)
class Moment:
    """A mover in sight at one control step.

    Attributes:
        distance: Distance from the robot [m].
        speed: Its true speed [m/s].
        looks: Number of times that the laser has looked at it since it came into sight.
        found: True if a track is near.
        place_error: Distance of the track from the mover [m]; NaN if not found.
        velocity_error: Difference of their velocities [m/s]; NaN if not found.
    """

    distance: float
    speed: float
    looks: int
    found: bool
    place_error: float = np.nan
    velocity_error: float = np.nan


@dataclass
class MoverDrive:
    """Measures of a drive.

    Attributes:
        case: Laser, kind of world and seed.
        moments: Movers in sight.
        duration: Duration of the drive [s].
        false_tracks: Number of tracks that were never near a mover.
        tracks: Number of tracks.
        encounters: Number of times that a mover came into sight for long enough.
        met: Number of them in which it was found at some moment.
        cost: Median processor time of following the movers a control step [s].
        jumps: Number of times that everything moved.
    """

    case: Case
    moments: list[Moment] = field(default_factory=list)
    duration: float = 0.0
    false_tracks: int = 0
    tracks: int = 0
    encounters: int = 0
    met: int = 0
    cost: float = 0.0
    jumps: int = 0


class Tracks(NamedTuple):
    """Tracks in the map at one step.

    Attributes:
        places: Places [m], shape (k, 2).
        velocities: Velocities [m/s], shape (k, 2).
        numbers: Numbers that tell them apart, shape (k,).
    """

    places: NDArray[np.float64]
    velocities: NDArray[np.float64]
    numbers: NDArray[np.float64]

    @classmethod
    def seen_from(
        cls,
        true: tuple[float, float, float],
        believed: tuple[float, float, float],
        places: NDArray[np.float64],
        velocities: NDArray[np.float64],
        numbers: NDArray[np.float64],
    ) -> "Tracks":
        """Return tracks of the believed frame as they are seen from the true pose.

        Args:
            true: True x, y [m] and yaw [rad] of the robot in the map.
            believed: Those that it believes in.
            places: Places in the believed frame [m], shape (k, 2).
            velocities: Velocities there [m/s], shape (k, 2).
            numbers: Numbers of the tracks, shape (k,).
        """
        turn = true[2] - believed[2]
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, s], [-s, c]])
        moved = (places - np.array(believed[:2])) @ rotation + np.array(true[:2])
        return cls(moved, velocities @ rotation, numbers)


class TrueMovers(NamedTuple):
    """Movers of a world at one step.

    Attributes:
        places: Places in the map [m], shape (m, 2).
        there: True for those that are there, shape (m,).
        is_seen: Condition of one that nothing hides from the laser.
        is_looked_at: Condition of one that the laser has looked at in this step.
    """

    places: NDArray[np.float64]
    there: NDArray[np.bool_]
    is_seen: Test
    is_looked_at: Test


@dataclass
class _Sighting:
    """A mover that is in sight.

    Attributes:
        place: Place at the last step [m], shape (2,).
        looks: Number of times that the laser has looked at it.
        duration: Time for which it has been in sight within the range [s].
        is_counted: True if it counts as an encounter.
        is_met: True if it was found since.
    """

    place: NDArray[np.float64]
    looks: int = 0
    duration: float = 0.0
    is_counted: bool = False
    is_met: bool = False


class MoverTally:
    """Compares tracks with movers, step by step.

    Attributes:
        drive: Measures so far.
    """

    def __init__(self, case: Case) -> None:
        """Begin a drive.

        Args:
            case: Laser, kind of world and seed.
        """
        self.drive = MoverDrive(case)
        self._sightings: dict[int, _Sighting] = {}
        self._nearest: dict[int, float] = {}
        self._costs: list[float] = []

    def restart(self) -> None:
        """Forget who is in sight, and the numbers of the tracks: they count anew from here."""
        self._sightings = {}
        self.drive.tracks += len(self._nearest)
        self.drive.false_tracks += sum(gap > _FALSE for gap in self._nearest.values())
        self._nearest = {}

    def compare(
        self,
        tracks: Tracks,
        movers: TrueMovers,
        robot: NDArray[np.float64],
        period: float,
        cost: float,
    ) -> None:
        """Compare the tracks of a step with the truth.

        Args:
            tracks: Tracks in the map.
            movers: Truth.
            robot: True place of the robot [m], shape (2,).
            period: Time since the last step [s].
            cost: Processor time of following the movers in this step [s].
        """
        self._costs.append(cost)
        away = np.hypot(*(tracks.places[:, None] - movers.places[None]).transpose(2, 0, 1))
        nearest = np.where(movers.there, away, np.inf).min(axis=1, initial=np.inf)
        for number, gap in zip(tracks.numbers.astype(int).tolist(), nearest, strict=True):
            self._nearest[number] = min(self._nearest.get(number, np.inf), float(gap))
        before, self._sightings = self._sightings, {}
        for m in np.flatnonzero(movers.there).tolist():
            place = movers.places[m]
            distance = float(np.hypot(*(place - robot)))
            if distance > _REACH or not movers.is_seen(m):
                continue
            sighting = before.get(m)
            if sighting is None or np.hypot(*(place - sighting.place)) > _JUMP:
                sighting = _Sighting(np.full(2, np.nan))
            self._sightings[m] = sighting
            velocity = (place - sighting.place) / period
            sighting.place = place.copy()
            sighting.looks += movers.is_looked_at(m)
            sighting.duration += period
            if distance > MAX_RANGE:
                sighting.duration = 0.0
            elif sighting.duration >= _IN_SIGHT:
                moment = Moment(distance, float(np.hypot(*velocity)), sighting.looks, False)
                self._take(sighting, moment, away[:, m], tracks.velocities - velocity)

    def _take(
        self,
        sighting: _Sighting,
        moment: Moment,
        away: NDArray[np.float64],
        errors: NDArray[np.float64],
    ) -> None:
        """Note a mover in sight.

        Args:
            sighting: Sighting of the mover.
            moment: Moment as one that is not found.
            away: Distances of the tracks from the mover [m], shape (k,).
            errors: Differences of their velocities from the mover's [m/s], shape (k, 2).
        """
        found = bool(away.min(initial=np.inf) < _NEAR)
        self.drive.encounters += not sighting.is_counted
        self.drive.met += found and not sighting.is_met
        sighting.is_counted, sighting.is_met = True, sighting.is_met or found
        if found:
            best = int(away.argmin())
            error = float(np.hypot(*errors[best]))
            place_error = float(away[best])
            moment = replace(moment, found=True, place_error=place_error, velocity_error=error)
        self.drive.moments.append(moment)

    def finish(self, duration: float, jumps: int = 0) -> MoverDrive:
        """Return the measures of the whole drive.

        Args:
            duration: Duration [s].
            jumps: Number of times that everything moved.
        """
        self.restart()
        self.drive.duration, self.drive.jumps = duration, jumps
        # The first steps compile.
        self.drive.cost = float(np.median(self._costs)) if self._costs else 0.0
        return self.drive
