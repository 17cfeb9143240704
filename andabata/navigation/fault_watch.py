"""Response of a robot to faults of its senses: when its health said so, and what it commanded."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

from andabata.localization.localizer import Health, Localizer
from andabata.machine.faults import Fault
from andabata.machine.robot import RobotModel
from andabata.navigation.navigator import StepResult

_SEVERITY = tuple(Health)
"""Words of health, from good to bad."""

_ROUNDING = 1e-9
"""Part of a limit by which a command may be beyond it: rounding of its scaling."""


@dataclass(frozen=True)
class FaultResponse:
    """Response of a robot to faults over a drive.

    Attributes:
        faulty_s: Time that was driven from the onset on [s]; 0 if the drive ended before it.
        flagged_after_s: Time from the onset to the first health worse than before it [s]; None
            without any.
        bad_commands: Number of commands from the onset on that were not finite, or beyond the
            robot's limits.
        health_at_end: Health at the end of the drive.
        contact_after_s: Time from the onset to a contact or a tip-over that ended the drive [s];
            None for another end.
    """

    faulty_s: float
    flagged_after_s: float | None
    bad_commands: int
    health_at_end: str
    contact_after_s: float | None = None

    @property
    def was_faulty(self) -> bool:
        """True if the drive went on beyond the onset."""
        return self.faulty_s > 0.0

    def is_flagged_within(self, seconds: float) -> bool:
        """Return True if the health said so within a time from the onset [s]."""
        return self.flagged_after_s is not None and self.flagged_after_s <= seconds + _ROUNDING

    @property
    def has_contact_after_flag(self) -> bool:
        """True if the robot touched something, or tipped over, after its health had said so."""
        contact, flag = self.contact_after_s, self.flagged_after_s
        return contact is not None and flag is not None and contact > flag

    def as_dict(self) -> dict[str, Any]:
        """Return the response, ready for JSON."""
        return asdict(self)

    @classmethod
    def of(cls, data: Mapping[str, Any] | None) -> Self | None:
        """Return the response that ``as_dict`` wrote; None for none."""
        return None if data is None else cls(**data)


def response_as_dict(faults: Sequence[Fault], response: FaultResponse) -> dict[str, Any]:
    """Return faults under ``injected`` with the response to them, ready for JSON."""
    return {"injected": [str(fault) for fault in faults], **response.as_dict()}


class FaultWatch:
    """Observer of a navigator whose senses have faults."""

    def __init__(self, localizer: Localizer, robot: RobotModel, onset: float) -> None:
        """Begin before a drive.

        Args:
            localizer: Localizer of the navigator, for its health.
            robot: Limits of commands.
            onset: Time of the first fault [s].
        """
        self._localizer, self._robot, self._onset = localizer, robot, onset
        self._before = self._health = Health.OK
        self._elapsed = 0.0
        self._flagged: float | None = None
        self._bad = 0

    @classmethod
    def of(cls, faults: Sequence[Fault], localizer: Localizer, robot: RobotModel) -> Self:
        """Return the observer of a navigator from the first onset of some faults on.

        Args:
            faults: Faults; without any the whole drive is watched.
            localizer: Localizer of the navigator.
            robot: Limits of commands.
        """
        return cls(localizer, robot, min((fault.onset for fault in faults), default=0.0))

    def __call__(self, result: StepResult) -> None:
        """Take in a control step."""
        self._health = self._localizer.health
        elapsed = result.readings.stamp - self._onset
        if elapsed < -_ROUNDING:
            self._before = self._health
            return
        self._elapsed = max(elapsed, 0.0)
        if self._flagged is None and self._is_worse():
            self._flagged = self._elapsed
        self._bad += self._is_bad(result)

    def response(self, has_contact: bool = False, end: float | None = None) -> FaultResponse:
        """Return the response so far.

        Args:
            has_contact: True if the drive has ended with a contact or a tip-over.
            end: Time of the end of the drive [s]; None for that of the last step.
        """
        elapsed = self._elapsed if end is None else max(end - self._onset, 0.0)
        contact = elapsed if has_contact and elapsed > 0.0 else None
        flagged = None if self._flagged is None else round(self._flagged, 3)
        return FaultResponse(
            round(elapsed, 3),
            flagged,
            self._bad,
            str(self._health),
            None if contact is None else round(contact, 3),
        )

    def _is_worse(self) -> bool:
        """Return True if the health is worse than before the onset."""
        return _SEVERITY.index(self._health) > _SEVERITY.index(self._before)

    def _is_bad(self, result: StepResult) -> bool:
        """Return True for a command that is not finite or beyond the robot's limits."""
        twist, wheels, robot = result.twist, result.wheels, self._robot
        numbers = (twist.linear, twist.angular, wheels.left, wheels.right)
        if not all(map(math.isfinite, numbers)):
            return True
        fastest = max(abs(wheels.left), abs(wheels.right))
        is_fast = fastest > robot.max_wheel_speed * (1 + _ROUNDING)
        return is_fast or abs(twist.angular) > robot.max_steering * (1 + _ROUNDING)
