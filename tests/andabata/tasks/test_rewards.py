"""The reward: its sign, its sectors, its terms, for one robot as among many."""

from itertools import pairwise

import numpy as np
import pytest

from andabata.tasks.rewards import (
    TERMS,
    GdaeRewardConfig,
    GoalOffsets,
    ImprovedRewardConfig,
    RewardConfig,
    RoomRewardConfig,
    gdae_reward,
    improved_reward,
    paper_reward,
    repulsion_weights,
    room_reward,
)
from andabata.tasks.terminations import Ending

FREE = np.full((1, 32), 10.0, dtype=np.float32)
CONFIG = RewardConfig()


def reward(ranges=FREE, before=1.0, after=1.0, ending=Ending.NONE):
    """Return the terms of one robot's reward as numbers."""
    terms = paper_reward(CONFIG, ranges, np.array([before]), np.array([after]), np.array([ending]))
    assert tuple(terms) == TERMS
    return {name: float(term[0]) for name, term in terms.items()}


def test_driving_at_the_goal_pays_six_a_step():
    """3 cm nearer to the goal pay 6, and nothing else is paid in the open."""
    terms = reward(before=20.0, after=19.97)
    assert terms["attraction"] == pytest.approx(6.0)
    assert sum(terms.values()) == pytest.approx(6.0)


def test_driving_away_costs():
    """3 cm further from the goal cost 6."""
    assert reward(before=20.0, after=20.03)["attraction"] == pytest.approx(-6.0)


@pytest.mark.parametrize(
    ("sector", "weight"),
    [
        *[(16, 0.1), (12, 0.1), (11, 0.03), (8, 0.03), (7, 0.009), (0, 0.009)],
        *[(15, 0.1), (19, 0.1), (20, 0.03), (23, 0.03), (24, 0.009), (31, 0.009)],
    ],
)
def test_sectors_repel_by_their_bearing(sector, weight):
    """An obstacle at 4 m repels by 6 m times the weight of its sector, sector 0 behind."""
    ranges = FREE.copy()
    ranges[0, sector] = 4.0
    assert reward(ranges)["repulsion"] == pytest.approx(-6 * weight)


@pytest.mark.parametrize("sectors", [32, 64, 7])
def test_left_and_right_repel_alike(sectors):
    """The weight of a sector is that of its mirror image, for any number of sectors."""
    weights = repulsion_weights(RewardConfig(front=1.0, side=0.5, rear=0.25), sectors)
    np.testing.assert_array_equal(weights, weights[::-1])
    assert weights[sectors // 2] == 1.0
    assert weights[0] == 0.25


def test_sectors_add_up():
    """The repulsion is the sum over all sectors of weight times missing range."""
    ranges = np.random.default_rng(0).uniform(0, 10, (1, 32)).astype(np.float32)
    expected = -float(repulsion_weights(CONFIG, 32) @ (10.0 - ranges[0].astype(np.float64)))
    assert reward(ranges)["repulsion"] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("ending", "term", "value"),
    [
        (Ending.COLLISION, "collision", -1000.0),
        (Ending.STUCK, "collision", -1000.0),
        (Ending.TIPOVER, "tipover", -500.0),
        (Ending.GOAL, None, 0.0),
        (Ending.TIMEOUT, None, 0.0),
        (Ending.NONE, None, 0.0),
    ],
)
def test_the_end_of_a_drive(ending, term, value):
    """Collision and stuck pay one penalty, rolling over another, all other ends none."""
    config = RewardConfig(collision=-1000.0, tipover=-500.0)
    one = np.ones(1)
    terms = paper_reward(config, FREE, one, one, np.array([ending]))
    paid = {name: float(value[0]) for name, value in terms.items() if value[0] != 0}
    assert paid == ({term: value} if term else {})


def test_a_robot_among_many_is_paid_as_alone():
    """Each row of the terms is that robot's own, to the last bit."""
    rng = np.random.default_rng(1)
    ranges = rng.uniform(0, 10, (9, 32)).astype(np.float32)
    before, after = rng.uniform(0, 20, (2, 9))
    endings = rng.integers(0, 6, 9)
    many = paper_reward(CONFIG, ranges, before, after, endings)
    for k in range(9):
        row = slice(k, k + 1)
        alone = paper_reward(CONFIG, ranges[row], before[row], after[row], endings[row])
        for name in TERMS:
            assert many[name][k] == alone[name][0]


def test_goal_and_collision_stand_alone_in_their_step():
    """Equation 3 of SPN: success, crash, or progress and the cost of a step; never two of them.

    A robot that is stuck pays as for a crash.
    """
    endings = np.array([Ending.GOAL, Ending.COLLISION, Ending.NONE, Ending.TIMEOUT, Ending.STUCK])
    before, after = np.array([0.4, 2.0, 3.0, 3.0, 3.0]), np.array([0.2, 1.9, 2.9, 3.1, 3.1])
    terms = room_reward(RoomRewardConfig(), before, after, endings)
    np.testing.assert_allclose(sum(terms.values()), [5.0, -5.0, 0.1 - 0.02, -0.1 - 0.02, -5.0])
    np.testing.assert_allclose(terms["progress"], [0.0, 0.0, 0.1, -0.1, 0.0])


def test_arriving_pays_more_than_creeping():
    """Steps cost: of two ways to the goal the quicker earns more, and waiting earns nothing."""
    config = RoomRewardConfig()
    going = np.array([Ending.NONE])

    def total(steps):
        path = np.linspace(4.0, 0.2, steps + 1)
        terms = [
            room_reward(config, path[k : k + 1], path[k + 1 : k + 2], going) for k in range(steps)
        ]
        return sum(float(sum(each.values())[0]) for each in terms)

    assert total(40) > total(80) > total(400)
    still = room_reward(config, np.ones(1), np.ones(1), going)
    assert sum(still.values())[0] < 0


ENDINGS = (Ending.NONE, Ending.GOAL, Ending.COLLISION, Ending.TIMEOUT)


def test_gdaes_reward():
    """+100, -100, else v/2 - |w|/2 - (1 - r)/2 for obstacles nearer than a metre."""
    endings = np.array([*ENDINGS, Ending.NONE, Ending.NONE])
    twists = np.array([[1.0, 0.4], [1.0, 0.4], [1.0, 0.4], [0.6, 0.0], [0.0, -0.8], [0.2, 0.0]])
    nearest = np.array([3.0, 3.0, 0.3, 1.0, 1.5, 0.6])
    terms = gdae_reward(GdaeRewardConfig(), twists, nearest, endings)
    assert tuple(terms) == ("goal", "collision", "speed", "turn", "nearness")
    np.testing.assert_allclose(sum(terms.values()), [0.3, 100.0, -100.0, 0.3, -0.4, -0.1])
    np.testing.assert_allclose(terms["speed"], [0.5, 0.0, 0.0, 0.3, 0.0, 0.1])
    np.testing.assert_allclose(terms["turn"], [-0.2, 0.0, 0.0, 0.0, -0.4, 0.0])
    np.testing.assert_allclose(terms["nearness"], [0.0, 0.0, 0.0, 0.0, 0.0, -0.2])


def improved(before, after, ending=Ending.NONE, **changes):
    """Return the terms of one robot's reward, with goals as distance and bearing."""
    offsets = [GoalOffsets(*(np.array([value]) for value in one)) for one in (before, after)]
    terms = improved_reward(ImprovedRewardConfig(**changes), *offsets, np.array([ending]))
    return {name: float(term[0]) for name, term in terms.items()}


@pytest.mark.parametrize(
    ("before", "after", "heading"),
    [
        (0.5, 0.4, 1.5),
        (-0.5, -0.4, 1.5),
        (0.5, 0.0, 1.5),
        (0.5, 0.5, -2.0),
        (0.0, 0.0, -2.0),
        (0.5, 0.6, -2.0),
        (0.5, -0.4, -2.0),
        (-0.5, 0.1, -2.0),
    ],
)
def test_equation_6(before, after, heading):
    """The heading pays 1.5 where it shrinks and keeps its side, and costs 2 elsewhere."""
    assert improved((3.0, before), (3.0, after))["heading"] == heading


@pytest.mark.parametrize(("after", "distance"), [(2.99, 1.5), (3.0, 1.5), (3.01, -2.0)])
def test_equation_7(after, distance):
    """The distance pays 1.5 where it does not grow, and costs 2 where it does."""
    assert improved((3.0, 0.0), (after, 0.0))["distance"] == distance


@pytest.mark.parametrize(
    ("ending", "sparse"), list(zip(ENDINGS, (0.0, 100.0, -100.0, -100.0), strict=True))
)
@pytest.mark.parametrize("proportional", [False, True])
def test_equations_5_and_9(ending, sparse, proportional):
    """The end pays +100 or -100, a time-out too, and the dense terms are added to it."""
    terms = improved((3.0, 0.4), (2.95, 0.3), ending, proportional=proportional)
    assert tuple(terms) == ("goal", "collision", "timeout", "heading", "distance")
    assert sum(terms.values()) == pytest.approx(sparse + (2.25 if proportional else 3.0))


def test_the_same_terms_in_proportion():
    """A step at the most pays 1.5, half of it 0.75, standing nothing, and the way back costs 2."""
    step = {"proportional": True, "max_progress": 0.2, "max_turn": 0.5}
    gains = [improved((3.0, 0.0), (after, 0.0), **step)["distance"] for after in (2.8, 2.9, 3, 3.1)]
    assert gains == pytest.approx([1.5, 0.75, 0.0, -1.0])
    turns = [improved((3.0, -1.0), (3.0, after), **step)["heading"] for after in (-0.5, -1, 1.25)]
    assert turns == pytest.approx([1.5, 0.0, -1.0])
    leaps = improved((3.0, 0.1), (9.0, 3.0), **step)
    assert (leaps["distance"], leaps["heading"]) == (-2.0, -2.0)


def test_many_goals_are_paid_as_each_alone():
    """Each row of the terms is that robot's own."""
    rng = np.random.default_rng(1)
    before, after = (GoalOffsets(rng.uniform(0, 9, 8), rng.uniform(-3, 3, 8)) for _ in range(2))
    endings = np.array(ENDINGS * 2)
    for proportional in (False, True):
        config = ImprovedRewardConfig(proportional=proportional)
        many = improved_reward(config, before, after, endings)
        for k in range(8):
            goals = [(float(one.distances[k]), float(one.bearings[k])) for one in (before, after)]
            alone = improved(*goals, endings[k], proportional=proportional)
            assert {name: term[k] for name, term in many.items()} == alone


def discounted(rewards, gamma):
    """Return the return of an episode that ends for good."""
    return sum(reward * gamma**k for k, reward in enumerate(rewards))


def drive(steps, distance, bearing, ending, **changes):
    """Return the rewards of a drive over which distance and bearing shrink evenly."""
    goals = list(
        zip(np.linspace(*distance, steps + 1), np.linspace(*bearing, steps + 1), strict=True)
    )
    ends = [Ending.NONE] * (steps - 1) + [ending]
    pairs = zip(goals[:-1], goals[1:], ends, strict=True)
    return [sum(improved(a, b, end, **changes).values()) for a, b, end in pairs]


@pytest.mark.parametrize("gamma", [0.99, 0.99999])
def test_the_printed_reward_pays_creeping_more_than_arriving(gamma):
    """500 steps of almost nothing earn more than the goal; in proportion they do not.

    One robot drives 4 m to its goal in 40 steps. The other nears it by a tenth of a millimetre a
    step until its time is over, and pays for that.
    """
    rates = {"max_turn": 0.2}
    for proportional, creeping_pays in ((False, True), (True, False)):
        kind = {"proportional": proportional, **rates}
        arriving = drive(40, (4.2, 0.2), (0.4, 0.0), Ending.GOAL, **kind)
        creeping = drive(500, (4.2, 4.15), (0.4, 0.39), Ending.TIMEOUT, **kind)
        assert (discounted(creeping, gamma) > discounted(arriving, gamma)) == creeping_pays


def test_the_printed_reward_makes_the_straight_way_a_loss():
    """A robot that heads for its goal exactly cannot turn nearer to it, and pays 0.5 a step."""
    assert sum(improved((3.0, 0.0), (2.9, 0.0)).values()) == -0.5


@pytest.mark.parametrize(("gamma", "circling_pays"), [(0.99999, True), (0.99, False)])
def test_gdaes_reward_pays_circling_at_its_discount(gamma, circling_pays):
    """In circles at full speed, cut short by time alone, a robot earns more than at the goal.

    One robot drives 4 m to its goal in 40 steps of 0.1 s, the other circles with a radius of 2 m.
    Even the 500 steps of one episode are worth more than the goal.
    """
    config, far = GdaeRewardConfig(), np.full(1, 5.0)

    def paid(speed, rate, ending=Ending.NONE):
        terms = gdae_reward(config, np.array([[speed, rate]]), far, np.array([ending]))
        return float(sum(terms.values())[0])

    arriving = discounted([paid(1.0, 0.0)] * 39 + [paid(1.0, 0.0, Ending.GOAL)], gamma)
    circle = paid(1.0, 0.5)
    assert (discounted([circle] * 500, gamma) > arriving) == circling_pays
    assert (circle / (1 - gamma) > arriving) == circling_pays


@pytest.mark.parametrize("gamma", [0.99, 0.99999])
def test_our_reward_pays_arriving_alone(gamma):
    """With 2 (d - d') - 0.02 neither creeping nor circling earns; the shorter way is worth more.

    A circle comes back to where it began, so that its progress adds up to nothing.
    """
    config, going = RoomRewardConfig(progress=2.0), np.array([Ending.NONE])
    assert (config.goal, config.collision, config.step) == (5.0, -5.0, -0.02)

    def paid(path):
        steps = pairwise(path)
        terms = [room_reward(config, np.array([a]), np.array([b]), going) for a, b in steps]
        return [float(sum(each.values())[0]) for each in terms]

    def arrived(steps):
        return discounted([*paid(np.linspace(4.0, 0.3, steps)), config.goal], gamma)

    assert paid([3.0, 2.9]) == pytest.approx([0.18])
    creeping = discounted(paid(np.linspace(4.0, 3.95, 501)), gamma)
    circling = discounted(paid(4 + np.sin(np.linspace(0, 40 * np.pi, 501))), gamma)
    assert arrived(40) > arrived(80) > 0 > max(creeping, circling)
