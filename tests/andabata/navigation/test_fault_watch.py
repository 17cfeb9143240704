"""Response to faults: when the health said so, commands beyond the limits, contacts at the end."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.localization.localizer import Health
from andabata.machine.faults import Fault
from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.navigation.fault_watch import FaultResponse, FaultWatch, response_as_dict
from andabata.navigation.navigator import StepResult

ROBOT = RobotModel()
STILL = Twist(0.0, 0.0), WheelSpeeds(0.0, 0.0)


def watched(healths, onset=2.0, commands=None):
    """Return the watch of a drive with a step a second, its healths and commands by second."""
    localizer = SimpleNamespace(health=Health.OK)
    watch = FaultWatch(localizer, ROBOT, onset)
    for second, word in enumerate(healths.split()):
        localizer.health = Health(word)
        command = (commands or {}).get(second, STILL)
        watch(StepResult(SensorReadings(float(second)), None, None, np.zeros(2), *command))
    return watch


def test_the_flag_is_the_first_worse_health_from_the_onset_on():
    """The time counts from the onset; what comes later changes the end alone."""
    response = watched("ok ok ok degraded lost ok").response()
    assert response == FaultResponse(3.0, 1.0, 0, "ok")
    assert watched("ok ok degraded").response().flagged_after_s == 0.0
    assert watched("ok ok ok ok").response() == FaultResponse(1.0, None, 0, "ok")


def test_health_that_was_as_bad_before_is_no_flag():
    """A robot that is degraded already has to get worse; better and back is no flag either."""
    assert watched("degraded degraded degraded ok degraded").response().flagged_after_s is None
    assert watched("ok degraded degraded disoriented").response().flagged_after_s == 1.0
    assert watched("degraded ok degraded").response().flagged_after_s == 0.0


def test_a_drive_that_ends_before_the_onset_was_not_faulty():
    """Nothing of it counts."""
    fast = Twist(0.0, 9.0), STILL[1]
    response = watched("ok lost", commands={0: fast}).response(has_contact=True, end=2.0)
    assert response == FaultResponse(0.0, None, 0, "lost")
    assert not response.was_faulty
    assert watched("ok ok ok").response(end=2.5).was_faulty
    assert watched("ok ok").response().faulty_s == 0.0


LIMIT = ROBOT.max_wheel_speed


@pytest.mark.parametrize(
    ("twist", "wheels", "is_bad"),
    [
        (Twist(0.3, ROBOT.max_steering), WheelSpeeds(-LIMIT, LIMIT), False),
        (Twist(0.3, -1.001 * ROBOT.max_steering), WheelSpeeds(0, 0), True),
        (Twist(0.3, 0.0), WheelSpeeds(-1.001 * LIMIT, 0.0), True),
        (Twist(0.3, 0.0), WheelSpeeds(0.0, 1.001 * LIMIT), True),
        (Twist(np.nan, 0.0), WheelSpeeds(0.0, 0.0), True),
        (Twist(np.inf, 0.0), WheelSpeeds(0.0, 0.0), True),
        (Twist(0.0, np.nan), WheelSpeeds(0.0, 0.0), True),
        (Twist(0.0, 0.0), WheelSpeeds(np.nan, 0.0), True),
        (Twist(0.0, 0.0), WheelSpeeds(0.0, np.nan), True),
    ],
)
def test_commands_beyond_the_limits_count_from_the_onset_on(twist, wheels, is_bad):
    """Yaw rate and both sides of wheels have limits; a number that is none is beyond any."""
    commands = dict.fromkeys((0, 2, 4), (twist, wheels))
    assert watched("ok ok ok ok ok", commands=commands).response().bad_commands == 2 * is_bad


def test_a_contact_counts_from_the_onset_and_after_the_flag():
    """The end of the drive is that of the plant, later than the last step."""
    response = watched("ok ok ok degraded").response(has_contact=True, end=3.5)
    assert (response.faulty_s, response.contact_after_s) == (1.5, 1.5)
    assert response.has_contact_after_flag
    assert not replace(response, flagged_after_s=None).has_contact_after_flag
    assert not replace(response, flagged_after_s=1.5).has_contact_after_flag
    assert not replace(response, contact_after_s=None).has_contact_after_flag


def test_flags_are_counted_within_a_time():
    """Its end belongs to it, also where sums are not exact."""
    response = FaultResponse(9.0, 0.1 + 0.2, 0, "ok")
    assert response.is_flagged_within(0.3)
    assert not response.is_flagged_within(0.2)
    assert not replace(response, flagged_after_s=None).is_flagged_within(1e9)


def test_a_response_survives_json_and_stands_with_its_faults():
    """None stays none."""
    response = FaultResponse(3.0, 1.0, 2, "lost", 2.5)
    assert FaultResponse.of(response.as_dict()) == response
    assert FaultResponse.of(None) is None
    data = response_as_dict((Fault.parse("gnss:off@2"),), response)
    assert data == {"injected": ["gnss:off@2"], **response.as_dict()}


def test_several_faults_are_watched_from_the_first_onset():
    """Without any the whole drive is."""
    localizer = SimpleNamespace(health=Health.OK)
    faults = tuple(map(Fault.parse, ("gnss:off@3", "imu:off@2")))
    step = StepResult(SensorReadings(5.0), None, None, np.zeros(2), *STILL)
    for some, seconds in ((faults, 3.0), ((), 5.0)):
        watch = FaultWatch.of(some, localizer, ROBOT)
        watch(step)
        assert watch.response().faulty_s == seconds
