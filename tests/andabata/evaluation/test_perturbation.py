"""Disturbances alone: their arms, and what they cost in pairs."""

import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.perturbation import arms, perturbation_rows, with_disturbance
from andabata.machine.faults import Fault
from andabata.machine.reality import LEVELS, Reality
from tests.support.offroad_attempts import ARMS, PERTURBED, trial

ROBOT = SimulatedRobotConfig()


def test_each_disturbance_is_alone_in_its_arm():
    """A controller drives the robot as it is first, then with one strength changed at a time."""
    base = ROBOT.model_copy(update={"reality": LEVELS["field"]})
    found = arms(("planner", "reactive"), base, {"latency": 0.2, "lag": 0.0})
    assert [arm.name for arm in found] == [
        *("planner", "planner@latency=0.2", "planner@lag=0"),
        *("reactive", "reactive@latency=0.2", "reactive@lag=0"),
    ]
    assert found[0].robot is base
    late = LEVELS["field"].model_copy(update={"latency": 0.2})
    assert found[1].robot == base.model_copy(update={"reality": late})
    assert found[2].robot.reality.latency == LEVELS["field"].latency
    assert (found[4].controller, found[4].disturbance, found[4].strength) == (
        *("reactive", "latency", 0.2),
    )


def test_each_fault_is_alone_in_its_arm():
    """It stands beside the robot's own faults; disturbances come before."""
    own, other = Fault("imu", "off"), Fault.parse("gnss:stuck@20")
    base = ROBOT.model_copy(update={"faults": (own,)})
    found = arms(("planner",), base, {"lag": 0.2}, (other,))
    assert [arm.name for arm in found] == ["planner", "planner@lag=0.2", "planner@gnss:stuck@20"]
    assert [arm.robot.faults for arm in found] == [(own,), (own,), (own, other)]
    assert [arm.is_base for arm in found] == [True, False, False]
    assert found[2].robot.reality == base.reality
    assert [arm.fault for arm in found] == [None, None, other]


def test_trials_that_reach_all_goals_are_compared_in_pairs():
    """A disturbance that loses two of four trials and gains none costs half, in its interval."""
    late, bent = perturbation_rows(PERTURBED, ARMS)
    assert (late["controller"], late["disturbance"], late["strength"]) == (
        "planner",
        "latency",
        0.2,
    )
    assert (late["undisturbed"], late["successes"], late["trials"]) == (3, 3, 4)
    assert (late["difference"], late["mcnemar_lost"], late["mcnemar_gained"]) == (0.0, 1, 1)
    assert (bent["undisturbed"], bent["successes"]) == (3, 1)
    assert (bent["difference"], bent["mcnemar_lost"], bent["mcnemar_gained"]) == (-0.5, 2, 0)
    assert bent["mcnemar_p"] == pytest.approx(0.5)
    assert -1.0 <= bent["difference_low"] < -0.5 < bent["difference_high"] < 0.5


def test_faults_are_no_disturbances():
    """Their arms have a table of their own."""
    both = arms(("planner",), ROBOT, {"lag": 0.2}, (Fault("imu", "off"),))
    driven = [each for arm in both for each in trial(0, arm.name, 3)]
    assert [row["disturbance"] for row in perturbation_rows(driven, both)] == ["lag"]


def test_each_controller_is_compared_with_itself():
    """The undisturbed arm of a row is that of its own controller."""
    both = arms(("planner", "oracle"), ROBOT, {"lag": 0.2})
    driven = [
        each
        for arm, goals in zip(both, (3, 1, 0, 3), strict=True)
        for each in trial(0, arm.name, goals)
    ]
    found = perturbation_rows(driven, both)
    assert [(row["controller"], row["difference"]) for row in found] == [
        ("planner", -1.0),
        ("oracle", 1.0),
    ]


def test_unknown_disturbances_and_strengths_out_of_bounds_are_named():
    """The error is one line, with the name that is meant."""
    with pytest.raises(ValueError, match=r"^latenzy: .*did you mean latency\?$"):
        with_disturbance(Reality(), "latenzy", 0.2)
    with pytest.raises(ValueError, match=r"^lag: input should be less than or equal to 2, got 3"):
        with_disturbance(Reality(), "lag", 3.0)
