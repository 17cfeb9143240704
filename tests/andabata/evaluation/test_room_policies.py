"""Policies drive the robot, and see in the form, that they were trained with."""

import numpy as np
import pytest

from andabata.evaluation.room_policies import fitted, law_policy, trained_in, trained_lidar
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.models import shipped_policy
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import GDAE_RADIUS, Td3TaskConfig
from rl.goal_laws import HeadingPolicy
from rl.laws import LAWS
from rl.policy import with_info
from tests.support.room_policies import point_policy, window_policy

TASK = Td3TaskConfig()
TEN_BEAMS = TASK.model_copy(update={"lidar": PlanarLidarConfig.parse("ten-beams")})


@pytest.mark.parametrize(
    ("name", "values", "radius", "beams"),
    [("td3", 45, 0.2, 360), ("td3-improved", 44, 0.2, 360), ("gdae", 24, GDAE_RADIUS, 181)],
)
def test_states_and_robots_are_those_of_the_training(name, values, radius, beams):
    """Whatever the laser and the task, a policy gets its own terms, and its own body."""
    policy = window_policy(name)
    for task in (TASK, TEN_BEAMS, SpnConfig(lidar=TEN_BEAMS.lidar)):
        actor, own = fitted(policy, task)
        assert actor.observations.size == own.observations.size == values
        assert (own.robot.radius, own.robot.max_speed, own.robot.period) == (radius, 1.0, 0.1)
        assert own.lidar.count == task.lidar.count
        assert (own.task, own.terminations) == (task.task, task.terminations)
    assert trained_lidar(policy, TEN_BEAMS).count == beams


def test_an_earlier_scan_comes_with_the_policy():
    """The number of steps since the earlier scan is read back, with its window."""
    policy = window_policy()
    info = policy.info
    info["config"]["stages"]["Rooms"]["environment"]["earlier_scan"] = 3
    assert trained_in(with_info(policy, info)).earlier_scan == 3


def test_tracked_movers_come_with_the_policy():
    """A policy that reads them drives a robot that tracks them; one that does not, one without."""
    own = TASK.model_copy(update={"tracked_movers": 3})
    assert fitted(window_policy(), own)[1].tracked_movers == 0
    policy = window_policy(tracked_movers=3)
    actor, task = fitted(policy, TASK)
    assert task.tracked_movers == 3
    assert actor.observations.term("movers").shape == (3, 6)
    # A file that names the term, and does not say how it was trained, fits no robot without it.
    with pytest.raises(ValueError, match=r"expected one that drives in rooms.*movers \(3, 6\)"):
        fitted(with_info(policy, {}), TASK)


def test_open_space_looks_as_in_training():
    """Ranges count up to those of the training; reciprocals of a longer laser stay."""
    far = TASK.model_copy(update={"lidar": PlanarLidarConfig.parse("hokuyo-270")})
    assert fitted(window_policy("gdae"), far)[1].lidar.max_range == 10.0
    assert fitted(window_policy("td3"), far)[1].lidar.max_range == 30.0


def test_a_policy_on_points_gets_them_in_a_task_without():
    """SPN's policy reads all beams in TD3's task, and keeps its 0.5 m/s."""
    actor, own = fitted(shipped_policy("spn"), TEN_BEAMS)
    assert actor.observations.term("points").shape == (10, 2)
    assert (own.robot.max_speed, own.robot.period, own.windows) == (0.5, 0.2, 36)


def test_who_says_nothing_takes_the_task():
    """Laws and policies without a training have the task's robot, terms and laser."""
    law = HeadingPolicy({}, TASK.observations, TASK.actions)
    assert trained_in(law) is None
    assert fitted(law, TASK)[1] == TASK
    assert trained_lidar(law, TEN_BEAMS) == TEN_BEAMS.lidar
    assert trained_in(point_policy()) is None


def test_the_law_that_sees_knows_its_windows_and_its_body():
    """It gets the bearings and the radius of the task; those that see nothing get none."""
    for task in (TASK, Td3TaskConfig(windows=20, window_fov_deg=180.0), SpnConfig()):
        law = law_policy("sees", task)
        np.testing.assert_allclose(law.weights["bearings"], task.terms.window_bearings, rtol=1e-6)
        np.testing.assert_allclose(law.weights["radius"], [task.robot.radius], rtol=1e-6)
        assert fitted(law, task)[1].windows == task.windows
    for name in set(LAWS) - {"sees"}:
        assert law_policy(name, TASK).tensors() == {}


def test_a_policy_of_other_ground_is_refused():
    """The off-road policy and one of an unknown task are errors with the command to train one."""
    for policy in (shipped_policy(), _of_task(window_policy(), "barn")):
        with pytest.raises(ValueError, match=r"expected one that drives in rooms.*--task td3"):
            fitted(policy, TASK)


def _of_task(policy, task):
    """Return a policy that says it was trained in a task."""
    info = policy.info
    info["config"]["stages"]["Rooms"]["environment"]["task"] = task
    return with_info(policy, info)
