"""The reward: its sign, its sectors, its terms."""

import numpy as np
import pytest

from andabata.tasks.rewards import RewardConfig, paper_reward

FREE = np.full(32, 10.0)
CONFIG = RewardConfig()


def test_driving_at_the_goal_pays_six_a_step():
    terms = paper_reward(CONFIG, FREE, 20.0, 19.97, None)
    assert terms["attraction"] == pytest.approx(6.0)
    assert sum(terms.values()) == pytest.approx(6.0)


def test_driving_away_costs():
    assert paper_reward(CONFIG, FREE, 20.0, 20.03, None)["attraction"] == pytest.approx(-6.0)


@pytest.mark.parametrize(
    ("sector", "weight"), [(16, 0.1), (12, 0.1), (11, 0.03), (8, 0.03), (7, 0.009), (0, 0.009)]
)
def test_sectors_repel_by_their_bearing(sector, weight):
    ranges = FREE.copy()
    ranges[sector] = 4.0
    assert paper_reward(CONFIG, ranges, 1.0, 1.0, None)["repulsion"] == pytest.approx(-6 * weight)


@pytest.mark.parametrize(
    ("outcome", "term", "value"),
    [
        ("collision", "collision", CONFIG.collision),
        ("stuck", "collision", CONFIG.collision),
        ("tipover", "tipover", CONFIG.tipover),
        ("goal", "collision", 0.0),
        ("timeout", "collision", 0.0),
    ],
)
def test_the_end_of_a_drive(outcome, term, value):
    assert paper_reward(CONFIG, FREE, 1.0, 1.0, outcome)[term] == value
