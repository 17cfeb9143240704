"""The law that sees: the free direction nearest to the goal, as fast as the way ahead is free."""

import numpy as np
import pytest

from rl.seeing_law import SeeingPolicy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

BEARINGS = (2 * np.pi * ((np.arange(72) + 0.5) / 72 - 0.5)).astype(np.float32)
KNOWN = {"bearings": BEARINGS, "radius": np.array([0.2], dtype=np.float32)}
ACTIONS = ActionSpec(
    names=("linear", "angular"), low=(0.0, -1.0), high=(1.0, 1.0), units=("m/s", "rad/s")
)


def space(name="windows", goal=2):
    """Return a space of 72 windows and a goal."""
    return ObservationSpec(
        terms=(
            ObservationTerm(name=name, shape=(72,), low=0.0, high=50.0, unit=""),
            ObservationTerm(name="goal", shape=(goal,), low=-9.0, high=9.0, unit=""),
        )
    )


def turned(ranges, goal_bearing, distance=3.0, radius=0.2, actions=ACTIONS):
    """Return speed and yaw rate among ranges by bearing, the same as reciprocals and as ranges."""
    found = []
    for name in ("windows", "ranges"):
        known = KNOWN | {"radius": np.array([radius], dtype=np.float32)}
        policy = SeeingPolicy(known, space(name), actions)
        seen = 1 / ranges if name == "windows" else ranges
        found.append(policy.act(np.float32([*seen, distance, goal_bearing])))
    np.testing.assert_allclose(*found, atol=1e-4)
    return found[0]


def around(*obstacles):
    """Return ranges of 10 m but for obstacles: bearing, half width [rad] and distance [m]."""
    ranges = np.full(72, 10.0)
    for bearing, half, distance in obstacles:
        ranges[np.abs(BEARINGS - bearing) <= half] = distance
    return ranges


@pytest.mark.parametrize("bearing", [-0.3, 0.0, 0.2])
def test_in_the_open_it_turns_to_the_goal(bearing):
    """As ``heading`` does: 2.5 of the bearing, and slower the more there is to turn."""
    v, w = turned(around(), bearing)
    assert (v, w) == pytest.approx((np.cos(bearing) ** 4, 2.5 * bearing), abs=1e-6)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_it_turns_to_the_nearer_side_of_what_stands_in_the_way(side):
    """An obstacle ahead of which more lies on one side is passed on the other."""
    block = around((0.2 * side, 0.5, 0.8))
    _, w = turned(block, 0.0)
    assert w * side < -0.5


def test_what_stands_beside_the_way_or_behind_the_goal_does_not_count():
    """Beyond the goal, beyond a metre, behind the robot and beside its body it drives straight."""
    for ranges, distance in (
        (around((0.0, 0.3, 0.9)), 0.5),
        (around((0.0, 0.3, 1.4)), 3.0),
        (around((np.pi, 0.6, 0.4), (-np.pi, 0.6, 0.4)), 3.0),
        (around((1.5, 0.3, 0.4), (-1.5, 0.3, 0.4)), 3.0),
    ):
        assert turned(ranges, 0.0, distance)[1] == pytest.approx(0.0, abs=1e-6)


def test_of_two_sides_it_takes_the_one_that_it_faces():
    """A goal somewhat to the left is reached round the right where the left takes a larger turn."""
    block = around((0.2, 0.5, 0.8))
    assert turned(block, 0.3)[1] < -0.5
    assert turned(block, 0.9)[1] > 0.5


def test_directions_meet_behind_the_robot():
    """A goal behind on the left is near to an opening behind on the right."""
    ranges = np.full(72, 0.9)
    for opening in (-2.85, 0.0):
        ranges[np.abs(BEARINGS - opening) < 0.32] = 10.0
    assert turned(ranges, 3.1) == pytest.approx((0.0, -1.0))


def test_speed_is_limited_by_what_is_ahead_not_by_the_way_to_turn_to():
    """Turning off to a free direction it slows for what it faces: 0.263 m in half a second."""
    v, w = turned(around((-0.25, 0.1, 0.5)), 0.6)
    assert (v, w) == pytest.approx((0.263 / 0.5 * np.cos(0.6) ** 4, 1.0), abs=0.01)


def test_speed_falls_with_what_is_ahead():
    """The free way of the body's width straight ahead is driven in half a second."""
    narrow = ActionSpec(names=("linear",), low=(0.0,), high=(1.0,), units=("m/s",))
    speeds = [
        turned(around((0.0, 3.2, away)), 0.0, actions=narrow)[0] for away in (0.25, 0.45, 0.6, 0.9)
    ]
    assert speeds == pytest.approx([0.0, 0.4, 0.7, 1.0], abs=0.03)


@pytest.mark.parametrize(("radius", "passes"), [(0.2, True), (0.35, False)])
def test_a_gap_is_one_for_its_own_body_alone(radius, passes):
    """Between posts 0.8 m apart, 0.75 m ahead, goes a body of 0.4 m, not one of 0.7 m."""
    off, away = np.arctan2(0.4, 0.7), np.hypot(0.4, 0.7)
    ranges = around((off, 0.05, away), (-off, 0.05, away))
    assert (abs(turned(ranges, 0.0, radius=radius)[1]) < 1e-6) == passes


def test_where_nothing_is_free_it_turns_to_the_longest_way():
    """In a closed ring with a bay to the left it turns there, and stands as it does."""
    ranges = around((0.0, 3.2, 0.35))
    ranges[np.abs(BEARINGS - 1.5) < 0.7] = 0.9
    v, w = turned(ranges, -1.0)
    assert w == pytest.approx(1.0)
    assert v < 0.2


def test_it_remembers_nothing():
    """After other observations the same one gives the same action."""
    policy = SeeingPolicy(KNOWN, space(), ACTIONS)
    rows = np.random.default_rng(0).uniform(0.1, 2.0, (10, 74)).astype(np.float32)
    first = [policy.best(row) for row in rows]
    np.testing.assert_array_equal([policy.best(row) for row in rows[::-1]][::-1], first)


def test_windows_without_their_bearings_are_refused():
    """Another number of windows, none of them, and a robot without a radius are errors."""
    with pytest.raises(ValueError, match="expected a term 'windows' or 'ranges' of shape"):
        SeeingPolicy(KNOWN | {"bearings": BEARINGS[:9]}, space(), ACTIONS)
    with pytest.raises(ValueError, match=r"got shapes \[\]"):
        SeeingPolicy(KNOWN, space("beams"), ACTIONS)
    with pytest.raises(ValueError, match="weights: expected bearings, radius, got"):
        SeeingPolicy({}, space(), ACTIONS)
