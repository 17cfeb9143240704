"""Movers on courses: where they are at which time, whatever stands there, and over again."""

import numpy as np
import pytest

from worlds.rooms.courses import Courses, follow, pass_period
from worlds.rooms.mover_motion import Movers, Solids
from worlds.rooms.movers import Mover, MoverPlan

COURSE = ((0.0, 1.0, 2.0), (2.0, 1.0, 6.0), (3.0, 4.0, 6.0))
NOTHING = Solids(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))


def mover(course=COURSE, radius=0.5):
    """Return a mover on a course."""
    plan = MoverPlan(radius=radius, place=course[0][1:], course=course)
    return Mover(plan.place, (0.0, 0.0), plan)


@pytest.mark.parametrize(
    ("now", "place", "velocity"),
    [
        (0.0, (1, 2), (0, 2)),
        (0.5, (1, 3), (0, 2)),
        (2.0, (1, 6), (3, 0)),
        (2.5, (2.5, 6), (3, 0)),
        (3.0, (1, 2), (0, 2)),
        (6.5, (1, 3), (0, 2)),
    ],
)
def test_a_mover_is_where_its_course_has_it(now, place, velocity):
    """Straight between two places, at the velocity of that leg; at the end it begins anew."""
    state = Movers.none(1, 2)
    follow(Courses.of([mover(), mover(COURSE[:2], 0.3)]), now, state, 0)
    np.testing.assert_allclose(state.places[0, 0], place)
    np.testing.assert_allclose(state.velocities[0, 0], velocity)
    np.testing.assert_allclose(state.places[0, 1], (1, 2 + 2 * (now % 2)))
    np.testing.assert_allclose(state.radii[0], (0.5, 0.3))


def test_a_period_has_the_movers_after_each_sub_step():
    """Straight ones turn back at what stands; those on courses mind nothing."""
    boxes = np.array([[-1.0, 3.0, 9.0, 4.0]])
    solids = NOTHING._replace(boxes=boxes)
    state, rows = Movers.none(1, 2), Movers.none(4, 2)
    state.places[0, 0], state.velocities[0, 0], state.radii[0, 0] = (5.0, 2.25), (0.0, 2.0), 0.5
    pass_period(state, 1, Courses.of([mover()]), solids, 0.5, 0.1, rows)
    np.testing.assert_allclose(rows.places[:, 1, 1], 3 + 2 * 0.1 * np.arange(1, 5))
    np.testing.assert_allclose(rows.places[:, 0, 1], (2.45, 2.45, 2.25, 2.05))
    np.testing.assert_allclose(rows.velocities[:, 0, 1], (2, -2, -2, -2))
    np.testing.assert_allclose(rows.radii, 0.5)
    np.testing.assert_array_equal(rows.places[-1], state.places[0])
