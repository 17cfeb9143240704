"""Trials of a robot whose senses have faults: its response goes with the last attempt."""

from collections.abc import Sequence
from dataclasses import replace

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.evaluation.perturbation import Arm
from andabata.evaluation.trial import HARMS, OffroadAttempt
from andabata.machine.faults import Fault
from andabata.navigation.fault_watch import FaultWatch


def watch_arm(
    arm: Arm, simulated_robot: SimulatedRobot, faults: Sequence[Fault]
) -> FaultWatch | None:
    """Return the watch of a robot, which observes it already; None of an arm that is not compared.

    Args:
        arm: Arm that drives. One without a fault is watched from the first onset of all faults on.
        simulated_robot: Robot of the arm.
        faults: Faults of all arms.
    """
    if not faults or not (arm.is_base or arm.fault is not None):
        return None
    mine = faults if arm.fault is None else (arm.fault,)
    watch = FaultWatch.of(mine, simulated_robot.localizer, simulated_robot.config.robot)
    simulated_robot.navigator.spectators.append(watch)
    return watch


def with_response(
    attempts: Sequence[OffroadAttempt], watch: FaultWatch, end: float
) -> tuple[OffroadAttempt, ...]:
    """Return the attempts of a trial, the last one with the response over the whole trial.

    Args:
        attempts: Attempts, at least one.
        watch: Watch of the robot.
        end: Time of the end of the trial [s].
    """
    *others, last = attempts
    response = watch.response(last.outcome in HARMS, end)
    return (*others, replace(last, detail=replace(last.detail, response=response)))
