"""What a disturbance costs: controllers drive the same with it alone and without it, in pairs.

Faults of senses are driven likewise; ``andabata.evaluation.fault_table`` has their table.
"""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass

from pydantic import ValidationError

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import explain
from andabata.evaluation.offroad_pairs import has_all
from andabata.evaluation.offroad_table import TRIALS
from andabata.evaluation.table import (
    Row,
    Sample,
    Table,
    by_contender,
    mcnemar_test,
    share_difference,
)
from andabata.evaluation.trial import OffroadAttempt
from andabata.machine.faults import Fault
from andabata.machine.reality import Reality


@dataclass(frozen=True)
class Arm:
    """A controller in a robot that has one disturbance or fault, or none beside its own.

    Attributes:
        controller: Name of the controller.
        robot: Robot that it drives.
        disturbance: Name of the disturbance, a field of ``Reality``; empty for none.
        strength: Its strength; NaN for none.
        fault: Fault of a sense, or None.
    """

    controller: str
    robot: SimulatedRobotConfig
    disturbance: str = ""
    strength: float = float("nan")
    fault: Fault | None = None

    @property
    def is_base(self) -> bool:
        """True if the robot has neither a disturbance nor a fault beside its own."""
        return not self.disturbance and self.fault is None

    @property
    def name(self) -> str:
        """Name of the contender: that of the controller, and the disturbance or fault behind it."""
        if self.fault is not None:
            return f"{self.controller}@{self.fault}"
        if not self.disturbance:
            return self.controller
        return f"{self.controller}@{self.disturbance}={self.strength:g}"


def with_disturbance(reality: Reality, name: str, strength: float) -> Reality:
    """Return a reality with one strength changed.

    Raises:
        ValueError: If there is no such disturbance, or the strength is out of bounds.
    """
    try:
        return Reality.model_validate({**reality.model_dump(), name: strength})
    except ValidationError as error:
        raise ValueError(explain(error, Reality)) from error


def arms(
    controllers: Sequence[str],
    robot: SimulatedRobotConfig,
    disturbances: Mapping[str, float],
    faults: Sequence[Fault] = (),
) -> tuple[Arm, ...]:
    """Return what drives: each controller as it is, then with each disturbance or fault alone.

    Args:
        controllers: Names of the controllers.
        robot: Robot with its own reality and faults, which every arm has.
        disturbances: Strengths of the disturbances by their names.
        faults: Faults of senses.

    Raises:
        ValueError: If there is no such disturbance, or a strength is out of bounds.
    """
    robots = {
        name: robot.model_copy(
            update={"reality": with_disturbance(robot.reality, name, disturbances[name])}
        )
        for name in disturbances
    }
    return tuple(
        arm
        for controller in controllers
        for arm in (
            # Undisturbed first: pairs of a table begin at the first contender of a key.
            Arm(controller, robot),
            *(Arm(controller, robots[name], name, disturbances[name]) for name in disturbances),
            *(Arm(controller, with_fault(robot, fault), fault=fault) for fault in faults),
        )
    )


def with_fault(robot: SimulatedRobotConfig, fault: Fault) -> SimulatedRobotConfig:
    """Return a robot with one fault beside its own."""
    return robot.model_copy(update={"faults": (*robot.faults, fault)})


def perturbation_rows(attempts: Sequence[OffroadAttempt], driven: Sequence[Arm]) -> list[Row]:
    """Return what each disturbance costs each controller, over all worlds, ready for JSON.

    A trial counts as a success if it reached all of its goals in a row.

    Args:
        attempts: Attempts of all trials; those with faults are passed over.
        driven: Arms that drove them.

    Raises:
        ValueError: If two arms did not drive the same trials.
    """
    by_name = {arm.name: arm for arm in driven if arm.fault is None}
    attempts = [attempt for attempt in attempts if attempt.contender in by_name]

    def controller(attempt: OffroadAttempt) -> Hashable:
        return by_name[attempt.contender].controller

    # Trials are paired, not goals: after a goal that was missed the others of its trial are
    # not driven.
    comparators = (share_difference("difference", has_all), mcnemar_test("mcnemar", has_all))
    table = Table(by_contender, TRIALS, (), comparators, controller)
    heads = [
        _head(base, other, by_name[other.attempts[0].contender])
        for base, other in table.pairs(attempts)
    ]
    return [head | row for head, row in zip(heads, table.differences(attempts), strict=True)]


def _head(base: Sample, other: Sample, arm: Arm) -> Row:
    """Return the first columns of a row: what was compared, and both counts."""
    return {
        "controller": arm.controller,
        "disturbance": arm.disturbance,
        "strength": arm.strength,
        "trials": len(other.clusters),
        "undisturbed": base.count(has_all),
        "successes": other.count(has_all),
    }
