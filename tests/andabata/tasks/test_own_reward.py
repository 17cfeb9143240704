"""The off-road reward: the paper's by default, a user's own function where one is named."""

import numpy as np
import pytest

from andabata.own_code import OwnCodeError
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.tasks.maze import MazeVectorEnv
from andabata.tasks.offroad import OffroadEnv, stage_config
from andabata.tasks.own_reward import RewardInput, offroad_reward
from andabata.tasks.rewards import RewardConfig, paper_reward
from andabata.tasks.terminations import Ending

OWN = """
import numpy as np

def parts(step):
    return {
        "nearer": step.distance_before - step.distance,
        "newest": step.yaw_rates[:, 0],
        "before": step.yaw_rates[:, 1],
        "ahead": step.ranges[:, 16],
        "ending": step.endings,
    }

def number(step):
    return 1.0

def empty(step):
    return {}

def one(step):
    return {"sum": np.zeros(1)}

def nan(step):
    return {"fine": 0 * step.distance, "bad": np.full(len(step.distance), np.nan)}
"""

STEP = RewardInput(
    ranges=np.linspace(1, 9, 64, dtype=np.float32).reshape(2, 32),
    distance_before=np.array([20.0, 9.0]),
    distance=np.array([19.97, 9.02]),
    yaw_rates=np.array([[0.5, 0.2], [-0.3, 0.0]]),
    endings=np.array([Ending.NONE, Ending.COLLISION]),
)


@pytest.fixture
def own(tmp_path):
    """Return a function that gives the settings of a reward of a file."""
    file = tmp_path / "own.py"
    file.write_text(OWN)
    return lambda name: RewardConfig(function=f"{file}:{name}")


def test_without_a_function_it_is_the_papers():
    """The same terms to the bit."""
    config = RewardConfig(collision=-7.0)
    ours = offroad_reward(config)(STEP)
    paper = paper_reward(config, STEP.ranges, STEP.distance_before, STEP.distance, STEP.endings)
    assert list(ours) == list(paper)
    assert all(np.array_equal(ours[name], paper[name]) for name in paper)


def test_a_function_of_ones_own_gives_all_of_the_terms(own):
    """It is given the step, and its terms are float64."""
    terms = offroad_reward(own("parts"))(STEP)
    assert list(terms) == ["nearer", "newest", "before", "ahead", "ending"]
    assert all(term.dtype == np.float64 for term in terms.values())
    np.testing.assert_allclose(terms["nearer"], [0.03, -0.02])
    np.testing.assert_array_equal(terms["newest"], [0.5, -0.3])
    np.testing.assert_array_equal(terms["ending"], STEP.endings)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("number", "own.py:number: expected a dict of the reward's terms by name, got float"),
        ("empty", "expected a dict of the reward's terms by name, got dict, empty"),
        ("one", r"expected 2 finite numbers of the term 'sum', .*, got an array of shape \(1,\)"),
        ("nan", "expected 2 finite numbers of the term 'bad', one of each robot, got others"),
    ],
)
def test_terms_that_are_none_are_refused(own, name, words):
    """With the term, and what came."""
    with pytest.raises(OwnCodeError, match=words):
        offroad_reward(own(name))(STEP)


def test_names_that_are_none_are_refused(own):
    """A word is refused as a setting, a name that the file lacks when a task is made."""
    with pytest.raises(ValueError, match=r"expected FILE\.py:NAME, got 'progress'"):
        RewardConfig(function="progress")
    with pytest.raises(OwnCodeError, match="which has empty, nan, number, one, parts, got 'none'"):
        offroad_reward(own("none"))


def test_it_is_given_the_step_alone_and_among_many(own, scenes):
    """One robot and many see the same ranges, distances, yaw rates and endings."""
    config = stage_config("Maze2D").model_copy(
        update={
            "seeds": (0,),
            "reward": own("parts"),
            "terminations": TerminationConfig(time_limit=0.4),
        }
    )
    alone, many = OffroadEnv(config, scenes=scenes), MazeVectorEnv(config, 2, scenes)
    alone.reset(seed=3)
    many.reset(seed=[3, 3])
    rates = [0.0]
    for share in (0.8, 0.2, -1.0, 0.6):
        rates.append(0.5 * share if abs(0.5 * share) > 0.15 else 0.0)
        _, reward, _, truncated, info = alone.step(np.array([share], dtype=np.float32))
        terms = many.step(np.full((2, 1), share, dtype=np.float32))[4]["reward_terms"]
        for name, value in info["reward_terms"].items():
            assert terms[name] == pytest.approx([value, value], abs=1e-5), name
        assert info["reward_terms"]["newest"] == pytest.approx(rates[-1])
        assert info["reward_terms"]["before"] == pytest.approx(rates[-2])
        assert 0.0 < info["reward_terms"]["nearer"] < 0.04 or share != 0.8
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert truncated
    assert info["reward_terms"]["ending"] == Ending.TIMEOUT
    alone.reset(seed=3)
    info = alone.step(np.ones(1, dtype=np.float32))[4]
    assert info["reward_terms"]["before"] == 0.0
