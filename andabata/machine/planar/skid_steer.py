"""What a skid-steered base shows beyond delay, limited acceleration and a lag of first order.

Wheels' commands are whole steps of the motor driver and have a deadband, each command has a delay
of its own, brakes are weaker than the drive, wheels swing past the speed that is asked for, and the
turn rate falls with speed. All of it is data of a vehicle (``PlanarVehicleConfig.skid_steer``), so
that what identifies a robot's dynamics can be tried on one of another structure than its model's.
"""

import math
from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from terrain.kernel import kernel


class SkidSteerConfig(BaseModel):
    """Numbers of a skid-steered base; all defaults are assumptions.

    Attributes:
        delay_jitter: Largest additional delay of a command [s], drawn for each of them, uniformly;
            a command that comes after a newer one counts no more. Twice a control period: drivers
            poll, and buses and networks wait.
        damping: Damping ratio of the body's second-order response, below 1. Its mean delay is the
            vehicle's lag, so that its natural frequency is 2 ``damping`` / lag. At 0.5 it swings
            16 % past a step, as wheels do under an integral controller.
        braking: Largest decelerations as a share of the accelerations. Below 1, the dangerous side:
            drivers limit the current that they feed back.
        deadband: Largest command of a side's wheels that does not move them [m/s]: friction of
            gears, and of tyres that skid in each turn.
        resolution: Step of the commands of a side's wheels [m/s]: a hundredth of the largest speed,
            for drivers that take whole per cent.
        understeer: How the turn rate falls with speed [s2/m2]: it is divided by
            1 + ``understeer`` v2, which leaves 71 % at 2 m/s.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    delay_jitter: float = Field(default=0.10, ge=0, le=2)
    damping: float = Field(default=0.5, gt=0, lt=1)
    braking: float = Field(default=0.7, gt=0, le=10)
    deadband: float = Field(default=0.05, ge=0, le=1)
    resolution: float = Field(default=0.02, ge=0, le=1)
    understeer: float = Field(default=0.10, ge=0, le=10)

    def followed(self, command: Twist, half_track: float) -> Twist:
        """Return what the wheels make of a command.

        Args:
            command: Command within the limits.
            half_track: Half of the effective track [m].
        """
        turn = half_track * command.angular
        left, right = (self._wheels(command.linear + side * turn) for side in (-1.0, 1.0))
        return Twist((left + right) / 2, (right - left) / (2 * half_track))

    def _wheels(self, speed: float) -> float:
        """Return the speed that one side's wheels are driven with [m/s]."""
        if abs(speed) <= self.deadband:
            return 0.0
        return round(speed / self.resolution) * self.resolution if self.resolution else speed


class Swing(NamedTuple):
    """One step of a second-order response to a speed that is held, in closed form.

    The difference from that speed and its rate of change become linear functions of both.

    Attributes:
        keep: Share of the difference that is left.
        carry: Difference that a rate of change leaves [s].
        pull: Rate of change that a difference leaves [1/s].
        coast: Share of the rate of change that is left.
    """

    keep: float
    carry: float
    pull: float
    coast: float


def swing_of(damping: float, lag: float, dt: float) -> Swing:
    """Return the step of a response with a damping ratio below 1.

    Args:
        damping: Damping ratio.
        lag: Mean delay of the response, 2 ``damping`` over its natural frequency [s].
        dt: Step of integration [s].
    """
    frequency = 2.0 * damping / lag
    decay, swinging = damping * frequency, frequency * math.sqrt(1.0 - damping**2)
    left = math.exp(-decay * dt)
    cosine, sine = math.cos(swinging * dt), math.sin(swinging * dt) / swinging
    return Swing(
        keep=left * (cosine + decay * sine),
        carry=left * sine,
        pull=-left * frequency**2 * sine,
        coast=left * (cosine - decay * sine),
    )


@kernel
def swung(speed: float, rate: float, target: float, swing: Swing) -> tuple[float, float]:
    """Return speed and its rate of change after a step."""
    off = speed - target
    return target + swing.keep * off + swing.carry * rate, swing.pull * off + swing.coast * rate
