"""Response of a trial: which arms are watched, from when on, and where it stands."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.faulty_trial import watch_arm, with_response
from andabata.evaluation.perturbation import arms
from andabata.localization.localizer import Health
from andabata.machine.faults import Fault
from andabata.machine.kinematics import Twist
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.navigation.navigator import StepResult
from tests.support.offroad_attempts import attempt

FAULTS = (Fault.parse("imu:off@3"), Fault.parse("gnss:off@2"))
BASE, LATE, IMU, GNSS = arms(("planner",), SimulatedRobotConfig(), {"lag": 0.2}, FAULTS)


def robot():
    """Return what the watch needs of a robot whose health is always ok."""
    return SimpleNamespace(
        config=SimulatedRobotConfig(),
        localizer=SimpleNamespace(health=Health.OK),
        navigator=SimpleNamespace(spectators=[]),
    )


@pytest.mark.parametrize(("arm", "seconds"), [(BASE, 3.0), (IMU, 2.0), (GNSS, 3.0)])
def test_an_arm_is_watched_from_its_onset_on(arm, seconds):
    """Its own; that of the first fault without one. The watch observes the robot."""
    one = robot()
    watch = watch_arm(arm, one, FAULTS)
    assert one.navigator.spectators == [watch]
    still = Twist(0.0, 0.0), WheelSpeeds(0.0, 0.0)
    watch(StepResult(SensorReadings(5.0), None, None, np.zeros(2), *still))
    assert watch.response().faulty_s == seconds


def test_arms_that_are_not_compared_are_not_watched():
    """Disturbances are none of the table of faults; without faults there is no table."""
    one = robot()
    assert watch_arm(LATE, one, FAULTS) is None
    assert watch_arm(BASE, one, ()) is None
    assert one.navigator.spectators == []


@pytest.mark.parametrize(
    ("outcome", "contact"),
    [("collision", 4.5), ("tipover", 4.5), ("timeout", None), ("goal", None), ("stuck", None)],
)
def test_the_last_attempt_has_the_response(outcome, contact):
    """A collision or a tip-over at its end counts, at the end of the trial."""
    first, last = attempt(0, 1, "goal"), attempt(0, 2, outcome)
    watch = watch_arm(GNSS, robot(), FAULTS)
    found = with_response([first, last], watch, 6.5)
    assert found[0] is first
    assert found[1].outcome is last.outcome
    assert (found[1].detail.response.faulty_s, found[1].detail.response.contact_after_s) == (
        *(4.5, contact),
    )
