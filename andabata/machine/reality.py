"""How a real robot differs from the one that its navigator believes in: named levels, and draws.

The navigator believes the numbers of its robot file and of its filter. ``Reality`` says how far the
true ones lie from them, ``Reality.draw`` what they are in one drive, and ``LEVELS`` names three
such settings. ``ideal`` differs in nothing: sensors then have their configured noise alone.

A drive draws the same unit numbers at every level, and a level scales them: the wheels that are too
small at ``field`` are twice as much so at ``harsh``, and a disturbance alone has the direction that
it has among the others.
"""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.special import ndtr

Vector = tuple[float, float, float]
"""Three components in the base frame."""

_UNITS = {
    "gnss_sigma_ratio": 1,
    "antenna": 3,
    "soft_iron": 9,
    "motor_field": 3,
    "imu_tilt_deg": 3,
    "wheel_radius": 1,
    "effective_track": 1,
    "slope_slip": 1,
    "range_scale": 1,
    "laser_clock": 1,
    "laser_tilt_deg": 2,
    "laser_height": 1,
    "latency": 1,
    "lag": 1,
}
"""Number of unit normal numbers that each constant takes, in the order in which they are drawn. New
ones go to the end: the draws of the others stay as they are."""


@dataclass(frozen=True)
class TrueConstants:
    """True constants of a robot in one drive, beside those that its navigator believes.

    Attributes:
        seed: Seed of the errors that change during the drive.
        gnss_noise: White noise of each horizontal axis of a fix [m]; None for the believed one.
        gnss_drift: Standard deviation of each axis of the slow error of fixes [m].
        gnss_drift_time: Correlation time of the slow error [s].
        gnss_sigma_ratio: Ratio of the standard deviation that the receiver states to the true one.
        antenna: Place of the satellite antenna in the base frame [m]; it is believed at its origin.
        soft_iron: Rows of the matrix that is added to the identity before the Earth's field.
        motor_field: Field of the motors at cruising speed [uT].
        imu_tilt: Rotation vector from the base to the axes of the inertial unit [rad].
        wheel_radius: Ratio of true to believed wheel radius, less 1.
        effective_track: Ratio of true to believed effective track, less 1.
        slope_slip: Slip of the wheels per sine of the slope that they climb.
        range_noise: White noise of a range beyond the laser's own [m].
        range_bias: Standard deviation of an error that is common to a sweep [m].
        range_scale: Ratio of measured to true range, less 1.
        laser_clock: Time by which the laser's stamps are late [s].
        laser_tilt: Roll and pitch of the laser's mast [rad].
        laser_height: Height of the optical centre less the believed one [m].
        latency: Time from a command to its arrival at the motors [s].
        lag: Time constant with which the wheels follow [s].
    """

    seed: int = 0
    gnss_noise: float | None = None
    gnss_drift: float = 0.0
    gnss_drift_time: float = 300.0
    gnss_sigma_ratio: float = 1.0
    antenna: Vector = (0.0, 0.0, 0.0)
    soft_iron: tuple[Vector, Vector, Vector] = ((0.0,) * 3,) * 3
    motor_field: Vector = (0.0, 0.0, 0.0)
    imu_tilt: Vector = (0.0, 0.0, 0.0)
    wheel_radius: float = 0.0
    effective_track: float = 0.0
    slope_slip: float = 0.0
    range_noise: float = 0.0
    range_bias: float = 0.0
    range_scale: float = 0.0
    laser_clock: float = 0.0
    laser_tilt: tuple[float, float] = (0.0, 0.0)
    laser_height: float = 0.0
    latency: float = 0.0
    lag: float = 0.0

    @property
    def is_ideal(self) -> bool:
        """True if the navigator believes the truth."""
        ideal = replace(AS_BELIEVED, seed=self.seed, gnss_drift_time=self.gnss_drift_time)
        return self == ideal


AS_BELIEVED = TrueConstants()
"""Constants of a robot that is what its navigator believes."""


class Reality(BaseModel):
    """Differences between a real robot and the believed one, as distributions of a drive's draw.

    A spread is the standard deviation of a normal distribution around the believed value. A largest
    value is the end of a uniform distribution that begins at half of it. A level's name stands for
    all of its numbers, as in ``reality = "field"``. The horizontal scanner has no such errors: it
    only drives in mazes.

    Attributes:
        gnss_noise: White noise of each horizontal axis of a fix [m] (issue 87 of FusionCore: second
            differences of a u-blox outdoors); None for that of ``sensing.proprioception.gnss``.
        gnss_drift: Standard deviation of each axis of a slow error of fixes [m], beside the fast
            one of ``sensing.proprioception.gnss`` (D. L. Wilson's records of consumer receivers:
            two components of different times; the amplitude is an assumption).
        gnss_drift_time: Correlation time of the slow error [s] (assumption, after the same records:
            one to ten minutes).
        gnss_sigma_ratio: Largest ratio, and one over the smallest, of the stated to the true
            standard deviation of fixes, log-uniform (issue 87 of FusionCore, issue 17 of
            nmea_navsat_driver: wrong in both directions).
        antenna: Spread of each coordinate of the antenna's place [m] (assumption).
        soft_iron: Spread of each element of the compass's soft-iron matrix (the USFSMAX's
            description: two degrees, sinusoidal, remain after a proper calibration).
        motor_field: Root mean square of the motors' field at cruising speed [uT]; it grows with the
            speed of the wheels, which every plant gives, in place of a current (assumption: 2.3 uT
            are five degrees of heading).
        imu_tilt_deg: Spread of the inertial unit's orientation about each axis [deg] (assumption).
        wheel_radius: Spread of the ratio of true to believed wheel radius (assumption: pressure and
            wear of tyres).
        effective_track: Spread of the ratio of true to believed effective track (makers' own
            multipliers of robots alike, 1.5 to 1.9; Galati and Reina 2019: it changes with ground).
        slope_slip: Largest slip of the wheels per sine of the slope (assumption: 0.5 is 13 % at
            15 degrees; loose soil slips more, Ishigami et al. 2007).
        range_noise: White noise of a range beyond the laser's own [m]; no level has more.
        range_bias: Standard deviation of an error that is common to a sweep [m] (assumption: a
            part of the 3 cm of accuracy that a UTM-30LX states).
        range_scale: Spread of the ratio of measured to true range; on flat ground incidence grows
            with range, too (assumption: some centimetres over the largest range).
        laser_clock: Largest delay of the laser's stamps [s] (pull request 88 of the velodyne
            driver: "in the range of 20 ms").
        laser_tilt_deg: Spread of roll and of pitch of the laser's mast [deg] (assumption).
        laser_height: Spread of the optical centre's height [m] (assumption).
        latency: Largest delay of commands [s] (assumption: a bus and a controller at 10 Hz). Both
            this and the next act at control steps.
        lag: Largest time constant with which the wheels follow commands [s] (assumption).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    gnss_noise: float | None = Field(default=None, ge=0, le=20)
    gnss_drift: float = Field(default=0.0, ge=0, le=20)
    gnss_drift_time: float = Field(default=300.0, gt=0)
    gnss_sigma_ratio: float = Field(default=1.0, ge=1, le=100)
    antenna: float = Field(default=0.0, ge=0, le=2)
    soft_iron: float = Field(default=0.0, ge=0, le=0.3)
    motor_field: float = Field(default=0.0, ge=0, le=100)
    imu_tilt_deg: float = Field(default=0.0, ge=0, le=10)
    wheel_radius: float = Field(default=0.0, ge=0, le=0.2)
    effective_track: float = Field(default=0.0, ge=0, le=0.2)
    slope_slip: float = Field(default=0.0, ge=0, le=1)
    range_noise: float = Field(default=0.0, ge=0, le=1)
    range_bias: float = Field(default=0.0, ge=0, le=1)
    range_scale: float = Field(default=0.0, ge=0, le=0.1)
    laser_clock: float = Field(default=0.0, ge=0, le=0.5)
    laser_tilt_deg: float = Field(default=0.0, ge=0, le=10)
    laser_height: float = Field(default=0.0, ge=0, le=0.5)
    latency: float = Field(default=0.0, ge=0, le=2)
    lag: float = Field(default=0.0, ge=0, le=2)

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, data: Any) -> Any:  # noqa: ANN401 - what a file or an option holds.
        """Take a level's name for its numbers."""
        return level(data).model_dump() if isinstance(data, str) else data

    @property
    def name(self) -> str:
        """Name of the level with these numbers; ``custom`` if none has them."""
        return next((name for name, known in LEVELS.items() if known == self), "custom")

    @classmethod
    def alone(cls, **strengths: float) -> Self:
        """Return a reality in which the given constants alone differ.

        Raises:
            ValueError: If a name is unknown or a number out of bounds.
        """
        return cls.model_validate(strengths)

    def draw(self, rng: np.random.Generator) -> TrueConstants:
        """Draw the true constants of one drive.

        Args:
            rng: Source of the draw; it gives as many numbers at each level.
        """
        seed = int(rng.integers(2**63))
        ends = np.cumsum(list(_UNITS.values()))
        units = dict(zip(_UNITS, np.split(rng.standard_normal(ends[-1]), ends[:-1]), strict=True))

        def around(name: str) -> NDArray[np.float64]:
            return np.asarray(getattr(self, name) * units[name])

        def up_to(name: str) -> float:
            return float(getattr(self, name) * (0.5 + ndtr(units[name].item()) / 2))

        exponent = 2 * ndtr(units["gnss_sigma_ratio"].item()) - 1
        soft_iron = around("soft_iron").reshape(3, 3)
        return TrueConstants(
            seed=seed,
            gnss_noise=self.gnss_noise,
            gnss_drift=self.gnss_drift,
            gnss_drift_time=self.gnss_drift_time,
            gnss_sigma_ratio=float(self.gnss_sigma_ratio**exponent),
            antenna=_vector(around("antenna")),
            soft_iron=(_vector(soft_iron[0]), _vector(soft_iron[1]), _vector(soft_iron[2])),
            motor_field=_vector(around("motor_field") / np.sqrt(3)),
            imu_tilt=_vector(np.deg2rad(around("imu_tilt_deg"))),
            wheel_radius=_within(around("wheel_radius").item()),
            effective_track=_within(around("effective_track").item()),
            slope_slip=up_to("slope_slip"),
            range_noise=self.range_noise,
            range_bias=self.range_bias,
            range_scale=around("range_scale").item(),
            laser_clock=up_to("laser_clock"),
            laser_tilt=_vector(np.deg2rad([*around("laser_tilt_deg"), 0.0]))[:2],
            laser_height=around("laser_height").item(),
            latency=up_to("latency"),
            lag=up_to("lag"),
        )


def _vector(numbers: NDArray[np.float64]) -> Vector:
    """Return three numbers as a tuple."""
    x, y, z = numbers.tolist()
    return x, y, z


def _within(ratio: float) -> float:
    """Return a ratio less 1, of a length that stays one however far a normal number lies out."""
    return max(ratio, -0.5)


LEVELS = {
    "ideal": Reality(),
    "field": Reality(
        gnss_noise=0.25,
        gnss_drift=0.66,
        gnss_sigma_ratio=1.7,
        antenna=0.02,
        soft_iron=0.03,
        motor_field=1.15,
        imu_tilt_deg=0.25,
        wheel_radius=0.015,
        effective_track=0.05,
        slope_slip=0.25,
        range_bias=0.01,
        range_scale=0.001,
        laser_clock=0.01,
        laser_tilt_deg=0.25,
        laser_height=0.01,
        latency=0.1,
        lag=0.1,
    ),
    "harsh": Reality(
        gnss_noise=0.25,
        gnss_drift=0.66,
        gnss_sigma_ratio=3.0,
        antenna=0.04,
        soft_iron=0.06,
        motor_field=2.3,
        imu_tilt_deg=0.5,
        wheel_radius=0.03,
        effective_track=0.1,
        slope_slip=0.5,
        range_bias=0.02,
        range_scale=0.002,
        laser_clock=0.02,
        laser_tilt_deg=0.5,
        laser_height=0.02,
        latency=0.2,
        lag=0.2,
    ),
}
"""Levels by name: the believed robot; one in the field; one at the far end of what is reported."""


def level(name: str) -> Reality:
    """Return a level by its name.

    Raises:
        ValueError: If there is none of that name.
    """
    if name not in LEVELS:
        raise ValueError(
            f"level: expected one of {', '.join(LEVELS)}, got {name!r}; choose one of them, or set "
            "its numbers one by one"
        )
    return LEVELS[name]
