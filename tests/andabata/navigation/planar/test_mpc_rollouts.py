"""Rollouts of the sampling MPC: sequences, exact distances, and costs of known value."""

import numpy as np
import pytest

from andabata.machine.planar.footprint import box_footprint, outline_distance
from andabata.navigation.mover_forecast import NO_MOVERS
from andabata.navigation.planar.dynamics import MotionState, PlanarDynamics, WheelLimits
from andabata.navigation.planar.mpc_rollouts import (
    Delayed,
    KnownSurroundings,
    Prices,
    before_effect,
    body_of,
    draw_commands,
    mean_commands,
    price_all,
)
from andabata.navigation.planar.nearest_hits import NearestHits
from andabata.navigation.planar.time_to_go import TimeField
from tests.support.hit_squares import hits_at

PERIOD, STEPS, CELLS = 0.05, 40, 64
LIMITS = WheelLimits(-0.5, 2.0, 2.0, 0.28, 4.0)
CORNERS = np.array(box_footprint(0.508, 0.430))
BODY = body_of(box_footprint(0.508, 0.430))
AT_ONCE = PlanarDynamics(0.0, 1e-3, 1e3, 1e3)
PRICES = Prices(0.05, 0.10, 6.0, 0.02, 100.0, 0.0, 0.0, 0.3)


def late(dynamics=AT_ONCE, past=((0.0, 0.0),)):
    """Return dynamics with the commands before."""
    return Delayed(np.array(past, dtype=float), dynamics, PERIOD)


def straight_field():
    """Return a field whose times are the distances along x from x = 3 m at 2 m/s."""
    x = -3.2 + (np.arange(CELLS) + 0.5) * 0.1
    times = np.repeat((3.0 - x)[:, None], CELLS, axis=1).astype(np.float32) / 0.1
    return TimeField(times, np.full(2, -3.2), 0.1, 0.05, np.full(1, 9.0))


def mover(place, velocity):
    """Return the forecast of one mover of 0.3 m whose doubt does not grow."""
    one = NO_MOVERS._replace(
        places=np.array([place], dtype=float),
        velocities=np.array([velocity], dtype=float),
        radii=np.array([0.3]),
        doubts=np.array([0.1]),
    )
    return one._replace(growth=0.0)


def priced(
    command, hits=(), state=None, goal=(50.0, 0.0), movers=NO_MOVERS, dynamics=AT_ONCE, **options
):
    """Return the cost of a constant command."""
    commands = np.tile(np.array(command, dtype=float), (1, STEPS, 1))
    costs = np.zeros(1)
    found = hits if isinstance(hits, NearestHits) else hits_at(hits)
    around = KnownSurroundings(found, straight_field(), *goal, movers)
    start = state or MotionState(-2.0, 0.0, 0.0, command[0], command[1], *command)
    behind = late(dynamics, (command,))
    price_all(commands, start, behind, around, BODY, PRICES._replace(**options), costs)
    return float(costs[0])


def test_in_the_open_a_rollout_costs_the_time_from_its_end():
    """2 s at 1 m/s from x = -2 m end at x = 0, 3 m before the goal of the field."""
    assert priced((1.0, 0.0)) == pytest.approx(1.5, abs=1e-3)


def test_an_arc_ends_where_geometry_says():
    """A quarter of a circle of 1 m: only what it leads ahead counts."""
    rate = np.pi / 4
    assert priced((rate, rate)) == pytest.approx((3.0 + 2.0 - 1.0) / 2.0, abs=2e-3)


def test_contact_costs_more_than_any_way_round_and_more_the_earlier():
    """A post on the way ends the rollout."""
    far, near = priced((1.0, 0.0), [(-0.5, 0.0)]), priced((1.0, 0.0), [(-1.5, 0.1)])
    assert near > far > 100.0
    assert priced((1.0, 0.0), [(-0.5, 0.24)]) < 100.0
    assert priced((1.0, 0.0), [(-0.5, 0.23)]) > 100.0


def test_from_a_place_in_contact_the_way_out_is_no_contact():
    """A hit 1 cm before the front: backwards costs a margin, forwards is contact."""
    hit, ahead = [(-2.0 + 0.254 + 0.01, 0.0)], 2.0
    start = MotionState(-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert priced((-0.3, 0.0), hit, start) < 10.0
    assert priced((ahead, 0.0), hit, start) > 100.0


def test_contact_counts_without_any_margin():
    """A robot that gives up its margin still does not touch."""
    assert priced((1.0, 0.0), [(-0.5, 0.23)], margin=0.0, margin_per_speed=0.0) > 100.0
    assert priced((1.0, 0.0), [(-0.5, 0.24)], margin=0.0, margin_per_speed=0.0) < 2.0


def test_the_margin_grows_with_speed_and_costs_by_its_missing_share():
    """Beside a wall the cost of a second is that of the share that is missing, squared."""
    wall = [(x, -0.315) for x in np.arange(-3.1, 3.1, 0.02)]
    for speed, share in ((0.4, 0.0), (1.0, 1.0 / 3.0), (2.0, 0.6)):
        end = -2.0 + 2.0 * speed
        expected = (3.0 - end) / 2.0 + 2.0 * 6.0 * share**2
        assert priced((speed, 0.0), wall) == pytest.approx(expected, abs=0.03)


def test_a_mover_costs_where_it_is_at_that_time():
    """One that crosses the way in the right second costs seconds, one that has left it nothing."""
    free = priced((1.0, 0.0))
    meets = priced((1.0, 0.0), movers=mover((-1.0, -1.0), (0.0, 1.0)))
    stands = priced((1.0, 0.0), movers=mover((-1.0, 0.0), (0.0, 0.0)))
    gone = priced((1.0, 0.0), movers=mover((-1.0, 0.0), (0.0, 3.0)))
    away = priced((1.0, 0.0), movers=mover((-1.0, -1.0), (0.0, -1.0)))
    assert meets > free + 5.0
    assert stands > free + 5.0
    assert gone == pytest.approx(free)
    assert away == pytest.approx(free)


def test_movers_go_on_while_commands_wait():
    """After half a second of delay they are half a second farther on their way."""
    velocity, slow = np.array([0.0, 1.0]), AT_ONCE._replace(delay=0.5)
    place = np.array([-0.7, -1.2])
    delayed = priced((1.0, 0.0), movers=mover(place, velocity), dynamics=slow)
    at_once = priced((1.0, 0.0), movers=mover(place + 0.5 * velocity, velocity))
    assert delayed == pytest.approx(at_once, abs=1e-6)
    assert at_once > priced((1.0, 0.0)) + 1.0


def test_distances_are_those_of_the_outline_from_the_hits():
    """At random poses among posts, the margin that is missing is the one that brute force finds."""
    rng = np.random.default_rng(1)
    hits = rng.uniform(-2.0, 2.0, (40, 2))
    nearest, margin, errors = hits_at(hits), 0.2, []
    for x, y, yaw in rng.uniform((-1.5, -1.5, -3.0), (1.5, 1.5, 3.0), (300, 3)):
        c, s = np.cos(yaw), np.sin(yaw)
        dx, dy = (hits - (x, y)).T
        true = min(
            outline_distance(a, b, CORNERS)
            for a, b in zip(c * dx + s * dy, c * dy - s * dx, strict=True)
        )
        at_rest = MotionState(x, y, yaw, 0.0, 0.0, 0.0, 0.0)
        with_, without = (
            priced((0.0, 0.0), nearest, at_rest, margin=margin, margin_cost=cost)
            for cost in (1.0, 0.0)
        )
        # 2 s cost the missing share of the margin, squared.
        found = margin * (1.0 - np.sqrt((with_ - without) / 2.0))
        errors.append(found - min(true, margin))
    assert 0.1 < np.mean(np.array(errors) == 0.0) < 1.0
    assert min(errors) > -1e-4
    assert np.mean(np.array(errors) > 1e-3) < 0.02
    assert max(errors) < 0.05


def test_arrival_ends_a_rollout_and_earlier_is_cheaper():
    """What comes behind the goal costs nothing."""
    wall = [(0.5, y) for y in np.arange(-0.5, 0.5, 0.05)]
    slow, fast = (priced((v, 0.0), wall, goal=(-0.8, 0.0)) for v in (1.0, 2.0))
    assert fast < slow < 0.0
    assert fast == pytest.approx(-(39 - 9) * PERIOD, abs=2 * PERIOD)


def test_the_goal_counts_before_a_later_contact_but_not_before_one_in_the_same_period():
    """A post behind the goal is not met: the rollout ends before it. One at the goal is."""
    goal = (-0.975, 0.0)
    # The robot arrives at x = -1.25 m with its front at -0.996 m.
    assert priced((1.0, 0.0), [(-0.8, 0.0)], goal=goal) == priced((1.0, 0.0), goal=goal)
    assert priced((1.0, 0.0), [(-0.8, 0.0)]) > 100.0
    assert priced((1.0, 0.0), [(-0.99, 0.0)], goal=goal) > 100.0


def test_a_way_backwards_costs_by_its_length():
    """2 s at 0.5 m/s backwards lead 1 m away from the goal, and cost a metre."""
    for cost in (0.0, 3.0):
        assert priced((-0.5, 0.0), reverse_cost=cost) == pytest.approx(3.0 + cost, abs=2e-3)


def test_changes_of_the_yaw_rate_cost():
    """A step of 1 rad/s in a period of 0.05 s costs 20 times the cost of turns."""
    start = MotionState(-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    commands = np.zeros((1, STEPS, 2))
    commands[0, 20:, 1] = 1.0
    costs = np.zeros(1)
    around = KnownSurroundings(hits_at([]), straight_field(), 50.0, 0.0)
    price_all(commands, start, late(), around, BODY, PRICES._replace(turn_cost=0.01), costs)
    assert costs[0] == pytest.approx(2.5 + 0.01 * 20.0, abs=1e-3)


def test_commands_without_effect_yet_are_driven_first():
    """With three periods of delay the last three commands, not those before, are driven."""
    dynamics = AT_ONCE._replace(delay=3 * PERIOD)
    start = MotionState(0.0, 0.0, 0.0, 9.0, 0.0, 9.0, 0.0)
    begin = before_effect(start, late(dynamics, [(7.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)]))
    # The speeds at the ends of the periods are the commands.
    assert begin.v == pytest.approx(3.0, abs=0.2)
    assert begin.x == pytest.approx(
        PERIOD * (0.5 * (9 + 1) + 0.5 * (1 + 2) + 0.5 * (2 + 3)), abs=0.02
    )
    assert before_effect(start, late()) == start


def test_with_a_part_of_a_period_of_delay_each_command_acts_that_much_later():
    """Half a period of delay costs half a period of the way at a step of the speed."""
    ends = []
    for delay in (0.0, 0.5 * PERIOD):
        commands, costs = np.zeros((1, STEPS, 2)), np.zeros(1)
        commands[0, :, 0] = 1.0
        around = KnownSurroundings(hits_at([]), straight_field(), 50.0, 0.0)
        start = MotionState(-2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        behind = late(AT_ONCE._replace(delay=delay))
        price_all(commands, start, behind, around, BODY, PRICES, costs)
        ends.append(costs[0])
    assert ends[1] - ends[0] == pytest.approx(0.5 * PERIOD / 2.0, abs=1e-3)


def test_sequences_are_the_plan_fixed_ones_and_noise_within_the_limits():
    """They stand in this order; at a knot the noise is added as it is."""
    plan, fixed = np.tile([1.0, 0.5], (STEPS, 1)), np.zeros((2, STEPS, 2))
    fixed[0, :, 0], fixed[1, 20:, 1] = 0.5, 1.0
    noise = np.zeros((3, 5, 2))
    noise[1] = (0.25, -1.0)
    noise[2] = (5.0, 0.0)
    commands = np.zeros((6, STEPS, 2))
    draw_commands(plan, fixed, noise, LIMITS, commands)
    np.testing.assert_array_equal(commands[0], plan)
    np.testing.assert_array_equal(commands[1:3], fixed)
    np.testing.assert_allclose(commands[3], plan)
    np.testing.assert_allclose(commands[4], np.tile([1.25, -0.5], (STEPS, 1)))
    wheels = np.abs(commands[..., 0]) + 0.28 * np.abs(commands[..., 1])
    assert wheels.max() == pytest.approx(2.0)


def test_the_mean_weighs_sequences_by_their_costs():
    """One temperature more costs all but 37 % of the weight; far worse ones weigh nothing."""
    commands = np.arange(3.0)[:, None, None] * np.ones((3, STEPS, 2))
    mean = mean_commands(commands, np.array([1.0, 1.1, 50.0]), 0.1)
    np.testing.assert_allclose(mean, np.exp(-1.0) / (1.0 + np.exp(-1.0)))
