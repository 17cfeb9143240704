"""Units of the quantities that sensors report, as factors to SI."""

from dataclasses import dataclass, replace

import numpy as np

from andabata.machine.proprioception import GRAVITY
from andabata.machine.robot import RobotModel
from andabata.records import topics
from andabata.records.topics import Topic

QUANTITIES = ("acceleration", "angular_velocity", "magnetic_field", "wheels")
"""Quantities whose unit the user can give."""

UNITS: dict[str, dict[str, float]] = {
    "acceleration": {"m/s2": 1.0, "g": GRAVITY, "mg": GRAVITY / 1000},
    "angular_velocity": {"rad/s": 1.0, "deg/s": np.pi / 180},
    "magnetic_field": {
        "T": 1.0, "mT": 1e-3, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7,
    },
    "wheels": {"rad/s": 1.0, "rpm": 2 * np.pi / 60, "deg/s": np.pi / 180},
}  # fmt: skip
"""Factors to SI by quantity and unit; wheels in m/s need the wheel's radius, too."""

_QUANTITIES_OF = {
    topics.IMU: ("acceleration", "angular_velocity"),
    topics.MAG: ("magnetic_field",),
    topics.ENCODERS: ("wheels", "left_sign", "right_sign"),
}


class UnitError(ValueError):
    """Readings whose unit cannot be inferred.

    Attributes:
        topic: Topic of the readings.
        reason: Text with what was expected and what came.
    """

    def __init__(self, topic: Topic, reason: str) -> None:
        super().__init__(f"{topic.ros1}: {reason}")
        self.topic, self.reason = topic, reason


@dataclass(frozen=True)
class UnitFactors:
    """Factors from the numbers of a session to SI.

    Attributes:
        acceleration: Factor to m/s2; negative for gravity instead of specific force.
        angular_velocity: Factor to rad/s.
        magnetic_field: Factor to T.
        wheels: Factor to rad/s; negative where the wheels count backwards.
        left_sign: Sign of the left wheels beside that factor.
        right_sign: Sign of the right wheels beside that factor.
    """

    acceleration: float = 1.0
    angular_velocity: float = 1.0
    magnetic_field: float = 1.0
    wheels: float = 1.0
    left_sign: float = 1.0
    right_sign: float = 1.0

    def merged_into(self, old: "UnitFactors", topic: Topic | None) -> "UnitFactors":
        """Return the old factors with those of a topic's quantities replaced by these.

        Args:
            old: Factors so far.
            topic: Topic of the readings; None for all of them.
        """
        if topic is None:
            return self
        return replace(old, **{name: getattr(self, name) for name in _QUANTITIES_OF[topic]})


def units_of(quantity: str, robot: RobotModel) -> dict[str, float]:
    """Return the factors to SI of a quantity's units by name.

    Args:
        quantity: One of ``QUANTITIES``.
        robot: Robot whose wheel radius turns m/s into rad/s.
    """
    known = dict(UNITS[quantity])
    if quantity == "wheels":
        known["m/s"] = 1 / robot.wheel_radius
    return known


def si_factor(quantity: str, unit: str, robot: RobotModel) -> float:
    """Return the factor to SI that a user gives.

    Args:
        quantity: One of ``QUANTITIES``.
        unit: Name of a unit, or the factor itself as text; a minus sign before either turns the
            readings round.
        robot: Robot whose wheel radius turns m/s into rad/s.

    Raises:
        ValueError: If there is no such quantity or unit.
    """
    if quantity not in QUANTITIES:
        raise ValueError(f"--unit: expected one of {', '.join(QUANTITIES)}, got {quantity}")
    known = units_of(quantity, robot)
    if unit.removeprefix("-") in known:
        return -known[unit[1:]] if unit.startswith("-") else known[unit]
    try:
        factor = float(unit)
    except ValueError:
        factor = np.nan
    if not np.isfinite(factor) or factor == 0:
        raise ValueError(
            f"--unit {quantity}: expected one of {', '.join(known)} or a factor to SI, got {unit}"
        )
    return factor
