"""Readings of a drive on flat ground, computed from formulas: any length, no simulator."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from andabata.localization.ukf_localizer import UkfConfig, UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose
from andabata.machine.proprioception import GRAVITY, MICROTESLA
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings

PERIOD, TICK = 0.1, 0.01
"""Control period and time between inertial rows [s]."""

SPEED, RADIUS = 0.3, 5.0
"""Speed [m/s] and radius [m] of the circle that is driven."""

_TICKS = round(PERIOD / TICK)
_GAP, _EVERY = 40, 400
"""Periods without compass and fixes, at the end of so many."""


def fresh_localizer(radius: float = RADIUS) -> UkfLocalizer:
    """Return a localizer at the begin of the drive.

    Args:
        radius: Radius of the circle [m].
    """
    localizer, place = UkfLocalizer(UkfConfig(), RobotModel(), GeoReference()), np.zeros(3)
    place[:2] = synthetic_place(0.0, radius)
    localizer.reset(Pose.from_euler(place, 0.0, 0.0, np.pi / 2), 0.0)
    return localizer


def synthetic_place(stamp: float, radius: float = RADIUS) -> NDArray[np.float64]:
    """Return the true place of the drive, shape (2,) [m].

    Args:
        stamp: Time [s].
        radius: Radius of the circle [m]; a large one begins at the origin of the map, too.
    """
    angle = stamp * SPEED / radius
    # Whatever the radius, the drive begins there: the map has no place for a far one.
    return np.array([RADIUS + radius * (np.cos(angle) - 1.0), radius * np.sin(angle)])


def synthetic_readings(
    periods: int, seed: int = 8003, gaps: bool = False, radius: float = RADIUS
) -> Iterator[SensorReadings]:
    """Yield the readings of a drive along a circle, a control period each.

    Args:
        periods: Number of control periods.
        seed: Seed of the noise.
        gaps: True to leave out compass and fixes for four of forty seconds.
        radius: Radius of the circle [m].
    """
    rng, geo_reference = np.random.default_rng(seed), GeoReference()
    wheels = SkidSteer(RobotModel()).unlimited_wheel_speeds(SPEED, SPEED / radius)
    for k in range(periods):
        stamps = k * PERIOD + TICK * np.arange(1, _TICKS + 1, dtype=np.float64)
        silent = gaps and k % _EVERY >= _EVERY - _GAP
        has_fix = k % _TICKS == _TICKS - 1 and not silent
        yield SensorReadings(
            stamp=float(stamps[-1]),
            imu=_inertial(stamps, rng, radius),
            encoders=np.column_stack(
                [stamps, rng.normal([wheels.left, wheels.right], 0.01, (_TICKS, 2))]
            ),
            mag=None if silent else _magnetic(stamps, geo_reference, rng, radius),
            gnss=_fix(float(stamps[-1]), geo_reference, rng, radius) if has_fix else None,
        )


def _inertial(
    stamps: NDArray[np.float64], rng: np.random.Generator, radius: float
) -> NDArray[np.float64]:
    """Return inertial rows: a constant yaw rate, gravity and centripetal acceleration."""
    rate = SPEED / radius
    mean = [0.0, 0.0, rate, 0.0, SPEED * rate, GRAVITY]
    sigma = [1e-3] * 3 + [0.05] * 3
    return np.column_stack([stamps, rng.normal(mean, sigma, (len(stamps), 6))])


def _magnetic(
    stamps: NDArray[np.float64],
    geo_reference: GeoReference,
    rng: np.random.Generator,
    radius: float,
) -> NDArray[np.float64]:
    """Return magnetometer rows [T]: the field of the place, turned into the base."""
    yaws = np.pi / 2 + stamps * SPEED / radius
    east, north, up = geo_reference.flux
    sine, cosine = np.sin(yaws), np.cos(yaws)
    field = np.column_stack(
        [cosine * east + sine * north, cosine * north - sine * east, np.full(len(yaws), up)]
    )
    return np.column_stack([stamps, MICROTESLA * rng.normal(field, 0.3)])


def _fix(
    stamp: float, geo_reference: GeoReference, rng: np.random.Generator, radius: float
) -> NDArray[np.float64]:
    """Return a row of a satellite fix."""
    place = np.array([[*synthetic_place(stamp, radius), 0.0]]) + rng.normal(0, 0.3, (1, 3))
    return np.array([[stamp, *geo_reference.to_geodetic(place)[0], 0.25]])
