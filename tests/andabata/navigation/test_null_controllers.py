"""Null controllers: noise over the whole steering range, and the opposite of what helps."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.null_controllers import AwayController, RandomController
from tests.support.situations import situation

ROBOT = RobotModel(speed=0.4, max_steering=0.6)


def test_random_yaw_rates_are_uniform_up_to_the_limit_on_both_sides():
    """Speed is the robot's; mean, spread and extremes are those of a uniform law."""
    controller = RandomController(ROBOT, np.random.default_rng(0))
    twists = [controller.act(situation()) for _ in range(4000)]
    rates = np.array([twist.angular for twist in twists])
    assert {twist.linear for twist in twists} == {0.4}
    assert np.abs(rates).max() <= 0.6
    assert rates.min() < -0.59
    assert rates.max() > 0.59
    assert rates.mean() == pytest.approx(0.0, abs=0.02)
    assert rates.std() == pytest.approx(1.2 / np.sqrt(12), rel=0.03)


def test_noise_comes_from_the_given_source_and_goes_on_after_a_reset():
    """The same seed gives the same rates; a reset does not begin the noise again."""
    first, second = (RandomController(ROBOT, np.random.default_rng(5)) for _ in range(2))
    rates = [first.act(situation()).angular for _ in range(4)]
    repeated = [second.act(situation()).angular for _ in range(2)]
    second.reset()
    repeated += [second.act(situation()).angular for _ in range(2)]
    assert rates == repeated
    assert len(set(rates)) == 4


@pytest.mark.parametrize(("error", "rate"), [(0.4, -0.6), (0.0, -0.6), (-0.4, 0.6), (-3.0, 0.6)])
def test_away_steers_hard_to_the_other_side(error, rate):
    """A goal to the left is answered by a full turn to the right, and the other way round."""
    controller = AwayController(ROBOT)
    controller.reset()
    assert controller.act(situation(heading_error=error)) == Twist(0.4, rate)
