"""Speed of rollouts: more of it over known ground with clearance, as far as the arc leads."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from tests.support.rollout_plans import SPEED, chosen, driven_up_to, nowhere, planner_of, selected
from tests.support.situations import GRID, between


def test_it_drives_faster_over_known_ground_with_clearance_on_both_sides():
    """Twice the speed in the open, half of the extra speed beside a wall, none near one."""
    free = driven_up_to(np.full(GRID.n_sectors, np.inf))
    assert selected(free, 0.1) == Twist(2.0 * SPEED, 0.1)
    assert selected(free, 0.1, max_speed_scale=1.0) == Twist(SPEED, 0.1)
    assert selected(planner_of(np.inf), 0.1) == Twist(SPEED, 0.1)  # The ground is unknown.
    # A wall beside its way.
    speeds = [selected(driven_up_to(between(60, 120, far)), 0.0).linear for far in (2.4, 1.2, 0.8)]
    assert speeds == [2.0 * SPEED, 1.5 * SPEED, SPEED]


def test_a_fast_arc_is_checked_as_far_as_it_leads():
    """The wall ahead is in the way of the fast arc alone."""
    ahead = driven_up_to(between(-20, 20, 3.0))
    assert selected(ahead, 0.0, max_speed_scale=1.0, arc_time=1.0).linear == SPEED
    speeds = [
        selected(ahead, 0.0, max_speed_scale=scale, arc_time=2.2).linear for scale in (1.2, 3.0)
    ]
    assert speeds == [1.2 * SPEED, SPEED]


@pytest.mark.parametrize(
    ("clearance", "scale"), [(1.31, 2.0), (1.29, 1.5), (0.91, 1.5), (0.89, 1.0)]
)
def test_the_speed_scale_depends_on_the_clearance(clearance, scale):
    """All of the extra speed from the inflation radius on, half of it from its own clearance on."""
    inflation = 2.0 * np.clip((1.3 - clearance) / 0.8, 0.0, 1.0)
    plan = nowhere(clearance=clearance, cost=1.0 + inflation + 1e-4)
    assert chosen(plan, 0.0).linear == pytest.approx(scale * SPEED)


@pytest.mark.parametrize(("clearance", "scale"), [(0.71, 2.0), (0.69, 1.5), (0.49, 1.0)])
def test_both_clearances_of_the_extra_speed_are_settings(clearance, scale):
    """All of it from one clearance on, half of it from the other, nearer than the inflation."""
    inflation = 2.0 * np.clip((1.3 - clearance) / 0.8, 0.0, 1.0)
    plan = nowhere(clearance=clearance, cost=1.0 + inflation + 1e-4)
    bold = {"max_speed_clearance": 0.7, "full_speed_clearance": 0.5}
    assert chosen(plan, 0.0, **bold).linear == pytest.approx(scale * SPEED)


def test_other_costs_than_inflation_forbid_extra_speed():
    """Uncertain ground of a wide clearance is driven at the plain speed."""
    plan = nowhere(clearance=1.0, cost=1.0 + 2.0 * 0.3 / 0.8 + 0.01)
    assert chosen(plan, 0.0).linear == SPEED


@pytest.mark.parametrize("yaw", [0.0, 1.9])
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_the_extra_speed_is_checked_along_the_arc_that_is_driven(yaw, rate):
    """Unknown ground on the arc forbids it, on the other side it does not matter."""
    end = 11 * 0.2 * rate / 2
    place = 1.1 * np.array([np.cos(yaw + end), np.sin(yaw + end)])
    for sign, scale in ((1.0, 1.0), (-1.0, 2.0)):
        turned = np.array([[np.cos(2 * yaw), np.sin(2 * yaw)], [np.sin(2 * yaw), -np.cos(2 * yaw)]])
        x0, y0 = place if sign > 0 else turned @ place
        plan = nowhere(
            cost=lambda x, y, a=x0, b=y0: np.where(np.hypot(x - a, y - b) < 0.3, 1.5, 1.0)
        )
        command = chosen(plan, rate, yaw=yaw, override_margin=50.0)
        assert command == Twist(scale * SPEED, rate)


@pytest.mark.parametrize(
    ("begin", "field", "scale"),
    [
        (0.10, lambda x, y: x > 1.2, 2.0),
        (0.15, lambda x, y: x > 1.2, 1.5),
        (0.45, lambda x, y: x > 1.2, 1.0),
        (0.00, lambda x, y: np.abs(y) > 0.8, 2.0),
        (0.00, lambda x, y: np.abs(y) > 0.6, 1.5),
        (0.00, lambda x, y: np.abs(y) > 0.4, 1.0),
    ],
)
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_the_extra_speed_is_checked_up_to_the_end_of_a_true_arc(begin, field, scale, rate):
    """Twice the speed ends 1.07 m ahead and 0.66 m aside, half the extra speed at three quarters.

    A field of unknown ground begins at the edge of a cell just before or just behind these ends.
    """
    plan = nowhere(cost=lambda x, y: np.where(field(x, y), 1.5, 1.0))
    command = chosen(plan, rate, (begin, 0.0), override_margin=50.0)
    assert command == Twist(pytest.approx(scale * SPEED), rate)
