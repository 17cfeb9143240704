"""Identification of dynamics: the prior at rest, known dynamics from noisy speeds, forgetting."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicle, PlanarVehicleConfig
from andabata.navigation.planar.dynamics_identification import (
    DynamicsIdentification,
    DynamicsIdentificationConfig,
)

PERIOD = 0.05
CONFIG = DynamicsIdentificationConfig()
NOTHING = Obstacles(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))
QUICK = {"delay": 0.05, "lag": 0.1, "acceleration": 3.0, "yaw_acceleration": 8.0}
SLOW = {"delay": 0.15, "lag": 0.25, "acceleration": 1.5, "yaw_acceleration": 5.0}


def drive(identification, dynamics, seconds, seed=0, noise=0.02, gain_spread=0.03):
    """Drive a robot with changing commands, and let the identification see them."""
    rng = np.random.default_rng(seed)
    config = PlanarVehicleConfig(gain_spread=gain_spread, **dynamics)
    robot = PlanarVehicle(config, PlanarPose(0, 0, 0), NOTHING, rng)
    command = Twist(0.0, 0.0)
    for k in range(round(seconds / PERIOD)):
        if k % 10 == 0:
            command = config.limited(Twist(rng.uniform(0.0, 1.6), rng.uniform(-2.5, 2.5)))
        robot.step(command)
        v, w = robot.velocity.linear, robot.velocity.angular
        seen = Twist(v + noise * rng.standard_normal(), w + 2.0 * noise * rng.standard_normal())
        identification.update(command, seen)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("dynamics", [QUICK, SLOW], ids=["quick", "slow"])
def test_known_dynamics_are_found_within_three_seconds(dynamics, seed):
    """From speeds with noise and unknown gains, delay and lag are found to a fraction of each."""
    identification = DynamicsIdentification(CONFIG, PERIOD)
    drive(identification, dynamics, 3.0, seed)
    found = identification.estimate().mean
    # What counts for braking is the sum of delay and lag; the two can stand in for each other.
    assert found.delay + found.lag == pytest.approx(dynamics["delay"] + dynamics["lag"], abs=0.03)
    assert found.delay == pytest.approx(dynamics["delay"], abs=0.03)
    assert found.acceleration == pytest.approx(dynamics["acceleration"], rel=0.15)
    assert found.yaw_acceleration == pytest.approx(dynamics["yaw_acceleration"], rel=0.2)


def test_a_robot_at_rest_tells_nothing():
    """The estimate stays the prior, an even one, however long nothing moves."""
    identification = DynamicsIdentification(CONFIG, PERIOD)
    before = identification.estimate()
    for _ in range(100):
        identification.update(Twist(0.0, 0.0), Twist(0.0, 0.0))
    assert identification.estimate() == before
    assert before.mean.delay == pytest.approx(np.mean(CONFIG.delays))
    assert before.deviation.lag == pytest.approx(np.std(CONFIG.lags))
    assert before.mean.yaw_acceleration == pytest.approx(np.mean(CONFIG.yaw_accelerations))


def test_uncertainty_falls_while_the_robot_drives_and_covers_the_error():
    """Deviations shrink to a part of the prior's."""
    identification = DynamicsIdentification(CONFIG, PERIOD)
    prior = identification.estimate().deviation
    drive(identification, SLOW, 3.0)
    assert all(np.array(identification.estimate().deviation) < 0.4 * np.array(prior))


def test_straight_driving_says_nothing_about_yaw_accelerations():
    """Delay and lag are known from the speed; the prior of what did not happen stays."""
    identification = DynamicsIdentification(CONFIG, PERIOD)
    prior = identification.estimate()
    robot = PlanarVehicle(
        PlanarVehicleConfig(**SLOW), PlanarPose(0, 0, 0), NOTHING, np.random.default_rng(0)
    )
    for _ in range(40):
        robot.step(Twist(2.0, 0.0))
        identification.update(Twist(2.0, 0.0), robot.velocity)
    found = identification.estimate()
    assert found.mean.acceleration == pytest.approx(1.5, abs=0.1)
    assert found.mean.yaw_acceleration == pytest.approx(prior.mean.yaw_acceleration)


def test_gains_are_not_taken_for_accelerations():
    """Speeds that are all 5 % too high do not move the estimate of anything else by much."""
    found = []
    for gain in (1.0, 1.05):
        identification = DynamicsIdentification(CONFIG, PERIOD)
        robot = PlanarVehicle(
            PlanarVehicleConfig(gain_spread=0.0, slip=0.0, **QUICK),
            PlanarPose(0, 0, 0),
            NOTHING,
            np.random.default_rng(0),
        )
        for k in range(80):
            command = Twist(0.5 + 0.5 * (k // 20 % 2), 0.0)
            robot.step(command)
            identification.update(command, Twist(gain * robot.velocity.linear, 0.0))
        found.append(identification.estimate().mean)
    assert found[0].delay == pytest.approx(found[1].delay, abs=0.02)
    assert found[0].lag == pytest.approx(found[1].lag, abs=0.02)


def test_dynamics_that_change_are_followed():
    """Old measurements are forgotten."""
    config = CONFIG.model_copy(update={"memory": 2.0})
    identification = DynamicsIdentification(config, PERIOD)
    drive(identification, QUICK, 4.0)
    drive(identification, SLOW, 8.0, seed=1)
    assert identification.estimate().mean.acceleration == pytest.approx(1.5, rel=0.2)


def test_a_reset_returns_to_the_prior():
    """Nothing of a drive is left."""
    identification = DynamicsIdentification(CONFIG, PERIOD)
    before = identification.estimate()
    drive(identification, SLOW, 1.0)
    assert identification.estimate() != before
    identification.reset()
    assert identification.estimate() == before


@pytest.mark.parametrize("values", [(0.1,), (0.2, 0.1), (-0.1, 0.1)])
def test_candidates_have_to_ascend_from_zero(values):
    """The message shows what was given."""
    with pytest.raises(ValueError, match="expected two or more ascending values"):
        DynamicsIdentificationConfig(delays=values)
