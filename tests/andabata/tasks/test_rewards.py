"""The reward: its sign, its sectors, its terms, for one robot as among many."""

import numpy as np
import pytest

from andabata.tasks.rewards import (
    TERMS,
    RewardConfig,
    RoomRewardConfig,
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
    """Equation 3 of SPN: success, crash, or progress and the cost of a step; never two of them."""
    endings = np.array([Ending.GOAL, Ending.COLLISION, Ending.NONE, Ending.TIMEOUT])
    before, after = np.array([0.4, 2.0, 3.0, 3.0]), np.array([0.2, 1.9, 2.9, 3.1])
    terms = room_reward(RoomRewardConfig(), before, after, endings)
    np.testing.assert_allclose(sum(terms.values()), [5.0, -5.0, 0.1 - 0.02, -0.1 - 0.02])
    np.testing.assert_allclose(terms["progress"], [0.0, 0.0, 0.1, -0.1])


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
