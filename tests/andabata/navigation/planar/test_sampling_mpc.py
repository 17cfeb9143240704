"""Sampling MPC: what it commands in plain situations, and that it is the same for the same rng."""

import numpy as np
import pytest

from andabata.machine.planar.footprint import box_footprint
from andabata.navigation.planar.dynamics import MotionState, PlanarDynamics, WheelLimits
from andabata.navigation.planar.sampling_mpc import SamplingMpc, SamplingMpcConfig
from andabata.navigation.planar.time_to_go import (
    MarginConfig,
    TimeToGo,
    TimeToGoConfig,
    limits_of,
)
from tests.support.hit_squares import hits_at

LIMITS = WheelLimits(-0.5, 2.0, 2.0, 0.28, 4.0)
FOOTPRINT = box_footprint(0.508, 0.430)
DYNAMICS = PlanarDynamics(0.05, 0.1, 3.0, 8.0)
REST = MotionState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def controller(**options):
    """Return a controller."""
    return SamplingMpc(SamplingMpcConfig(**options), LIMITS, FOOTPRINT, 0.05)


def commanded(
    places=(), state=REST, goal=(2.9, 0.0), past=None, dynamics=DYNAMICS, ticks=3, **options
):
    """Return the command after some ticks in the same situation, and the controller."""
    hits, mpc, target = hits_at(places), controller(**options), np.array(goal)
    limits = limits_of(0.215, 2.0, MarginConfig(), TimeToGoConfig())
    field = TimeToGo(128, 0.05, limits, TimeToGoConfig())
    field.update(hits, np.array(state[:2]), target)
    rng, before = np.random.default_rng(0), np.zeros((20, 2)) if past is None else past
    for _ in range(ticks):
        twist = mpc.command(state, before, dynamics, hits, field.field, target, rng)
    return twist, mpc


def test_in_the_open_it_drives_straight_at_full_speed():
    """The goal is ahead, and nothing stands in the way."""
    twist, _ = commanded(goal=(30.0, 0.0))
    assert twist.linear > 1.8
    assert abs(twist.angular) < 0.3


@pytest.mark.parametrize("side", [-1, 1])
def test_it_turns_to_the_side_of_the_goal(side):
    """Left is positive."""
    twist, _ = commanded(goal=(0.0, 2.5 * side))
    assert twist.angular * side > 0.8


def test_before_a_wall_it_brakes_as_early_as_the_dynamics_need():
    """At 2 m/s, 1.3 m before a wall, quick brakes have time, slow ones brake now."""
    wall = [(1.55, y) for y in np.arange(-3.1, 3.1, 0.04)]
    state = MotionState(0.0, 0.0, 0.0, 2.0, 0.0, 2.0, 0.0)
    past = np.tile([2.0, 0.0], (20, 1))
    quick = PlanarDynamics(0.0, 0.05, 6.0, 8.0)
    slow = PlanarDynamics(0.15, 0.2, 2.5, 8.0)
    fast, _ = commanded(wall, state, (2.9, 0.0), past, quick)
    careful, _ = commanded(wall, state, (2.9, 0.0), past, slow)
    assert careful.linear < fast.linear - 0.5


def test_a_way_past_a_post_is_found():
    """The best sequence has no contact, and passes the post on one side."""
    post = [(1.2 + 0.07 * np.cos(a), 0.07 * np.sin(a)) for a in np.arange(0, 6.28, 0.5)]
    _, mpc = commanded(post, goal=(30.0, 0.0), ticks=10)
    assert mpc.costs.min() < 30.0
    heading = np.cumsum(mpc.plan[:, 1]) * 0.05
    assert np.abs(heading).max() > 0.1


def test_in_a_pocket_it_turns_on_the_spot_and_drives_out():
    """Walls leave no room for arcs: the fixed sequences cost less than what the noise finds."""
    sides = [(x, y) for x in np.arange(-1.5, 0.6, 0.04) for y in (-0.45, 0.45)]
    pocket = sides + [(0.55, y) for y in np.arange(-0.45, 0.46, 0.04)]
    with_, without = (
        commanded(pocket, goal=(-2.9, 0.0), ticks=1, turn_times=times)[1].costs.min()
        for times in (SamplingMpcConfig().turn_times, ())
    )
    assert with_ < without - 0.2


def test_the_same_rng_gives_the_same_commands():
    """Nothing else is random, and a reset forgets the plan."""
    one, other = commanded()[0], commanded()[0]
    assert one == other
    _, mpc = commanded()
    assert (mpc.plan != 0.0).any()
    mpc.reset()
    assert (mpc.plan == 0.0).all()


def test_commands_keep_to_the_limits():
    """The mean of limited sequences is limited, too."""
    for goal in ((0.0, 2.5), (-2.5, 0.3), (2.9, 0.5)):
        _, mpc = commanded(goal=goal)
        assert (np.abs(mpc.plan[:, 0]) + 0.28 * np.abs(mpc.plan[:, 1]) <= 2.0 + 1e-9).all()
        assert mpc.plan[:, 0].min() >= -0.5


def test_too_few_samples_for_the_arcs_are_refused():
    """The message says what to change."""
    with pytest.raises(ValueError, match="raise samples or take fewer arcs"):
        controller(samples=100, arc_speeds=(0.2, 0.4, 0.6, 0.8, 1.0) * 2)
