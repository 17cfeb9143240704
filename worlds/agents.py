"""People, animals and vehicles of a world as compiled code takes them: traits and intentions.

The law of motion is in ``worlds.agent_motion``; a mover without a behaviour has none of this.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel
from worlds.rooms.movers import Mover

STRAIGHT, PERSON, ANIMAL, VEHICLE, COURSE = 0, 1, 2, 3, 4
"""Kinds of movers; the first goes straight and turns back, the last follows a course, as in rooms.
"""

MOST = 500
"""Largest number of movers of a world: the cost of a control period grows with its square."""

HURRY = 1.25
"""Factor by which a person is faster to catch up or to step aside (assumption)."""

DECISION = 0.1
"""Period of decisions, the robot's control period [s]."""

_KINDS = {"person": PERSON, "animal": ANIMAL, "vehicle": VEHICLE}

_DRAWS = 256
"""Number of random numbers of a mover's decisions; after the last comes the first again."""


class Agents(NamedTuple):
    """Traits of m movers, and what they are about to do; the latter changes in a drive.

    Those of many robots have one axis more, the first; see ``none``.

    Attributes:
        kinds: Kind of each, shape (m,).
        yields: True for those who give way to the robot, shape (m,).
        leaders: Index of the person that each keeps with; its own for all others, shape (m,).
        slots: Place beside the leader, ahead and to the left [m], shape (m, 2).
        speeds: Usual speed [m/s], shape (m,).
        draws: Uniform random numbers of the decisions, 0 to 1, shape (m, 256).
        tracks: Corners of the tracks [m], shape (m, t, 2).
        corners: Number of corners of each track, shape (m,).
        aims: Place that a person heads for [m], shape (m, 2).
        headings: Direction of an animal's run [rad], shape (m,).
        paces: Speed that an animal has now [m/s], shape (m,).
        until: Time at which an aim is given up or a run ends [s], shape (m,).
        nearest: Distance from the aim at the last progress [m], shape (m,).
        detours: Time at which a detour ends [s], shape (m,).
        drawn: Number of random numbers that were taken, shape (m,).
        legs: Corner that a vehicle drives to, and its step to the next, shape (m, 2).
        wanted: Velocity that each wants for this period [m/s], shape (m, 2).
        sides: Side on which each goes round a solid, 1 left, -1 right, 0 none, shape (m,).
    """

    kinds: NDArray[np.int64]
    yields: NDArray[np.bool_]
    leaders: NDArray[np.int64]
    slots: NDArray[np.float64]
    speeds: NDArray[np.float64]
    draws: NDArray[np.float64]
    tracks: NDArray[np.float64]
    corners: NDArray[np.int64]
    aims: NDArray[np.float64]
    headings: NDArray[np.float64]
    paces: NDArray[np.float64]
    until: NDArray[np.float64]
    nearest: NDArray[np.float64]
    detours: NDArray[np.float64]
    drawn: NDArray[np.int64]
    legs: NDArray[np.int64]
    wanted: NDArray[np.float64]
    sides: NDArray[np.float64]

    @classmethod
    def of(cls, movers: Sequence[Mover]) -> "Agents":
        """Return the agents of a world's movers, at the begin of a drive."""
        count = len(movers)
        most = max([len(each.behaviour.track) for each in movers if each.behaviour] + [0])
        velocities = np.array([each.velocity for each in movers]).reshape(count, 2)
        agents = cls(
            kinds=np.zeros(count, dtype=np.int64),
            yields=np.zeros(count, dtype=np.bool_),
            leaders=np.arange(count),
            slots=np.zeros((count, 2)),
            speeds=np.array([each.plan.speed for each in movers], dtype=np.float64),
            draws=np.zeros((count, _DRAWS)),
            tracks=np.zeros((count, most, 2)),
            corners=np.zeros(count, dtype=np.int64),
            aims=np.array([each.place for each in movers]).reshape(count, 2),
            headings=np.arctan2(velocities[:, 1], velocities[:, 0]),
            paces=np.array([each.plan.speed for each in movers], dtype=np.float64),
            until=np.zeros(count),
            nearest=np.full(count, np.inf),
            detours=np.zeros(count),
            drawn=np.zeros(count, dtype=np.int64),
            legs=np.ones((count, 2), dtype=np.int64),
            wanted=velocities,
            sides=np.zeros(count),
        )
        for m, mover in enumerate(movers):
            agents._set(m, mover)
        return agents

    @classmethod
    def none(cls, count: int, each: int) -> "Agents":
        """Return no agents for some robots.

        Args:
            count: Number of robots.
            each: Number of movers of each that may come.
        """
        rows = cls.of([])
        return cls(*(np.zeros((count, each, *array.shape[1:]), array.dtype) for array in rows))

    def put_down(self, k: int, movers: Sequence[Mover]) -> None:
        """Put the agents of robot ``k`` down, in place.

        Args:
            k: Index of the robot.
            movers: Its movers, none with a track.
        """
        for array, rows in zip(self, Agents.of(movers), strict=True):
            array[k] = 0
            array[k, : len(movers)] = rows

    def _set(self, m: int, mover: Mover) -> None:
        """Write the behaviour of a mover into its rows, in place."""
        behaviour = mover.behaviour
        if mover.plan.course:
            self.kinds[m] = COURSE
        if behaviour is None:
            return
        self.kinds[m], self.yields[m] = _KINDS[behaviour.kind], behaviour.yields
        self.leaders[m] = m if behaviour.leader is None else behaviour.leader
        self.slots[m] = behaviour.slot
        self.draws[m] = np.random.default_rng(behaviour.seed).random(_DRAWS)
        self.corners[m] = len(behaviour.track)
        if behaviour.track:
            self.tracks[m, : len(behaviour.track)] = behaviour.track


@inlined_kernel
def agents_of(agents: Agents, k: int) -> Agents:
    """Return the agents of robot ``k`` among those of many, which change with it."""
    return Agents(
        agents.kinds[k],
        agents.yields[k],
        agents.leaders[k],
        agents.slots[k],
        agents.speeds[k],
        agents.draws[k],
        agents.tracks[k],
        agents.corners[k],
        agents.aims[k],
        agents.headings[k],
        agents.paces[k],
        agents.until[k],
        agents.nearest[k],
        agents.detours[k],
        agents.drawn[k],
        agents.legs[k],
        agents.wanted[k],
        agents.sides[k],
    )


def top_speed(kind: str, speed: float) -> float:
    """Return the highest speed of a kind of mover whose usual speed is given [m/s]."""
    return speed * HURRY if kind == "person" else speed


def check_movers(movers: Sequence[Mover]) -> None:
    """Refuse movers that a world cannot have.

    Raises:
        ValueError: If there are too many, one goes farther than its radius between two decisions,
            or one keeps with nobody who leads.
    """
    if len(movers) > MOST:
        raise ValueError(f"walkers: expected at most {MOST}, got {len(movers)}; take fewer")
    for number, mover in enumerate(movers):
        behaviour, plan = mover.behaviour, mover.plan
        if behaviour is None:
            continue
        most = plan.radius / DECISION
        if top_speed(behaviour.kind, plan.speed) > most + 1e-9:
            raise ValueError(
                f"walkers[{number}].speed: expected at most {most:.3g} m/s at its fastest of a "
                f"{behaviour.kind} of {plan.radius:.3g} m radius, which is its radius in a control "
                f"step of {DECISION} s, got {top_speed(behaviour.kind, plan.speed):.3g}; lower the "
                f"speed or enlarge the radius"
            )
        moved = math.hypot(*mover.velocity)
        if moved > plan.speed + 1e-6:
            raise ValueError(
                f"walkers[{number}].velocity: expected at most its speed {plan.speed:.3g} m/s, got "
                f"{moved:.3g}; lower it"
            )
        _check_leader(number, movers)


def _check_leader(number: int, movers: Sequence[Mover]) -> None:
    """Refuse one that keeps with nobody, with itself, or with one who follows.

    Raises:
        ValueError: If it does.
    """
    behaviour = movers[number].behaviour
    if behaviour is None or behaviour.leader is None:
        return
    leader = behaviour.leader
    chosen = movers[leader].behaviour if leader < len(movers) else None
    if leader == number or chosen is None or chosen.kind != "person" or chosen.leader is not None:
        raise ValueError(
            f"walkers[{number}].leader: expected the index of a person who leads, got {leader}; "
            f"name another or none"
        )
