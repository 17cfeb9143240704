"""Movers on courses: places at given times, straight between them, over and over again.

A mover on a course minds nothing: what stands, other movers, the robot. At the end of its course it
is at the begin again, as the animations of a simulator that repeat.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from worlds.agent_motion import stride
from worlds.agent_surroundings import Nearby
from worlds.agents import Agents
from worlds.rooms.mover_motion import Movers, Solids, advance_one
from worlds.rooms.movers import Mover


class Courses(NamedTuple):
    """Courses of m movers, of t places at most; times of those that have fewer end with infinity.

    Attributes:
        times: Time of each place [s], shape (m, t).
        places: Places [m], shape (m, t, 2).
        lengths: Duration of each course [s], shape (m,).
        radii: Radius of each mover [m], shape (m,).
    """

    times: NDArray[np.float64]
    places: NDArray[np.float64]
    lengths: NDArray[np.float64]
    radii: NDArray[np.float64]

    @classmethod
    def of(cls, movers: Sequence[Mover]) -> "Courses":
        """Return the courses of movers that all have one."""
        rows = [np.array(each.plan.course, dtype=np.float64) for each in movers]
        most = max(map(len, rows), default=0)
        times, places = np.full((len(rows), most), np.inf), np.zeros((len(rows), most, 2))
        for m, row in enumerate(rows):
            times[m, : len(row)], places[m, : len(row)] = row[:, 0], row[:, 1:]
        lengths = np.array([row[-1, 0] for row in rows])
        return cls(times, places, lengths, np.array([each.plan.radius for each in movers]))


@kernel
def follow(courses: Courses, now: float, state: Movers, first: int) -> None:
    """Put movers where their courses have them.

    Args:
        courses: Courses.
        now: Time since the begin [s].
        state: Movers, of which those from ``first`` on have the courses, changed in place.
        first: Index of the first mover on a course.
    """
    for c in range(len(courses.lengths)):
        m, time = first + c, now % courses.lengths[c]
        leg = 0
        while courses.times[c, leg + 1] <= time:
            leg += 1
        begin, end = courses.times[c, leg], courses.times[c, leg + 1]
        for axis in range(2):
            here, there = courses.places[c, leg, axis], courses.places[c, leg + 1, axis]
            velocity = (there - here) / (end - begin)
            state.velocities[0, m, axis] = velocity
            state.places[0, m, axis] = here + velocity * (time - begin)
        state.radii[0, m] = courses.radii[c]


@kernel
def pass_period(
    state: Movers,
    straight: int,
    courses: Courses,
    solids: Solids,
    begin: float,
    dt: float,
    rows: Movers,
    people: tuple[Agents, Nearby] | None = None,
) -> None:
    """Move all movers for a control period, and write where they are after each sub-step.

    Args:
        state: Movers, those on courses last, changed in place.
        straight: Number of movers without a course.
        courses: Courses of the others.
        solids: Obstacles that those without a course do not pass.
        begin: Time of the begin of the period [s].
        dt: Length of a sub-step [s].
        rows: Movers after each sub-step, the first axis, filled.
        people: Agents, with what they want in this period, and the solids near each; None without
            people.
    """
    for row in range(len(rows.radii)):
        if people is not None:
            agents, nearby = people
            stride(state, agents, solids, nearby, dt)
        else:
            for m in range(straight):
                advance_one(0, m, state, solids.boxes, solids.circles, solids.edges, dt)
        follow(courses, begin + (row + 1) * dt, state, straight)
        rows.places[row], rows.velocities[row] = state.places[0], state.velocities[0]
        rows.radii[row] = state.radii[0]
