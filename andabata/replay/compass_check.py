"""Check of a recorded compass against the gyro, and of its heading against the fixes' way."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.localization.fix_check import check_fixes
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.machine.proprioception import MICROTESLA
from andabata.machine.sensor_readings import SensorReadings
from andabata.records.frames.transform import yaw_pitch_roll
from andabata.replay.compass_fit import CompassFit, CompassSamples, fit_compass

_MIN_SECONDS, _MIN_TURN = 20.0, 0.6
"""Least time [s] and least standard deviation of the yaw [rad] by which a compass is judged."""

_STUCK_TURN = 1.5
"""Turn during which a compass repeats one reading from which it is stuck [rad]."""

_HARD_IRON, _SOFT_IRON = math.sin(math.radians(15.0)), math.sin(math.radians(10.0))
"""Shares of the Earth's horizontal field from which there is advice: 15 and 10 degrees of heading;
the filter copes with less."""

_SURE = 2.0
"""Number of standard deviations by which a share has to be beyond its limit."""

_MIN_OFFSET = math.radians(15.0)
"""Least constant error of the heading that there is advice on [rad]."""

_SQUARE = math.radians(12.0)
"""Largest difference from a right angle that is taken as one [rad]: sensors are mounted square."""

_MIN_CORRELATION, _MIN_SPREAD = 0.95, 5.0
"""Least correlation of driven way and fixes, and least spread of these [m]."""

_BACKWARDS = math.radians(135.0)
"""Offset from which wheels that are counted backwards explain it as well [rad]."""

_FEWEST_FIXES = 10


@dataclass(frozen=True)
class CompassMounting:
    """Correction of a compass, by options: a rotation, and perhaps the sign of all readings.

    Attributes:
        rotation: Rotation of its readings in the base frame.
        is_negated: True if the readings are turned round, too.
    """

    rotation: Rotation
    is_negated: bool = False

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Matrix that readings are multiplied with, shape (3, 3)."""
        return np.asarray(self.rotation.as_matrix() * (-1.0 if self.is_negated else 1.0))


class CompassCheck:
    """Compares compass, gyro, wheels and fixes over a recording."""

    def __init__(self, reference: GeoReference, wheel_radius: float) -> None:
        """Begin before the first reading.

        Args:
            reference: Datum of the map, and the magnetic field there.
            wheel_radius: Radius of the wheels [m].
        """
        self._reference, self._radius = reference, wheel_radius
        self._yaw, self._stamp = 0.0, -math.inf
        self._rows: list[tuple[float, ...]] = []
        self._fixes: list[list[float]] = []
        self._last, self._stuck, self._most_stuck = b"", 0.0, 0.0

    def add(self, readings: SensorReadings, pose: Pose) -> None:
        """Add the readings of a control period.

        Args:
            readings: Readings in the robot's axes.
            pose: Estimated pose at the end of the period; its tilt alone counts.
        """
        if readings.gnss is not None:
            self._fixes += readings.gnss.tolist()
        if readings.imu is None or not len(readings.imu):
            return
        _, pitch, roll = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
        turn = self._turn(readings.imu, pitch, roll)
        if readings.mag is None or not len(readings.mag):
            return
        row = readings.mag[-1, 1:]
        self._stuck = self._stuck + abs(turn) if row.tobytes() == self._last else 0.0
        self._most_stuck, self._last = max(self._most_stuck, self._stuck), row.tobytes()
        speed = math.nan
        if readings.encoders is not None and len(readings.encoders):
            speed = self._radius * float(readings.encoders[:, 1:].mean())
        if np.isfinite(row).all():
            field = (row / MICROTESLA).tolist()
            self._rows.append((self._stamp, self._yaw, pitch, roll, *field, speed))

    def _turn(self, imu: NDArray[np.float64], pitch: float, roll: float) -> float:
        """Add the turn of a period's inertial rows to the yaw, and return it [rad]."""
        end = float(imu[-1, 0])
        seconds = min(max(end - self._stamp, 0.0), 1.0)
        self._stamp = end
        rate = (math.sin(roll) * imu[:, 2] + math.cos(roll) * imu[:, 3]) / math.cos(pitch)
        turn = float(np.nanmean(rate)) * seconds
        self._yaw += turn
        return turn

    @property
    def samples(self) -> CompassSamples:
        """Compass and gyro so far."""
        table = np.array(self._rows).reshape(-1, 8)
        return CompassSamples(table[:, 0], table[:, 1], table[:, 2:4], table[:, 4:7])

    def advice(self, unit: float, mounting: Rotation) -> str | None:
        """Return what is wrong with the compass and the step to take; None without any.

        Args:
            unit: Factor to tesla that its readings were multiplied with.
            mounting: Rotation that they were turned into the robot's axes with.
        """
        samples = self.samples
        if len(samples.stamps) < 3 or np.ptp(samples.stamps) < _MIN_SECONDS:
            return None
        if self._most_stuck > _STUCK_TURN:
            return (
                "it repeats one reading while the gyro turns by "
                f"{math.degrees(self._most_stuck):.0f} degrees: the sensor or its driver is stuck; "
                "map another topic (--map /mag_orientation=TOPIC)"
            )
        if samples.turns.std() < _MIN_TURN:
            return None
        fit = fit_compass(samples)
        if self._is_earths(fit):
            return self._iron_advice(fit) or self._offset_advice(mounting)
        correction = self._correction(samples)
        if correction is None:
            return None
        return self._axes_advice(correction, unit, mounting)

    def _is_earths(self, fit: CompassFit) -> bool:
        """Return true if a field turns as the Earth's does, with its vertical part."""
        level = float(np.hypot(*self._reference.flux[:2]))
        follows = abs(fit.earth) > 0.5 * level and abs(fit.soft) < 0.5 * abs(fit.earth)
        return follows and abs(fit.up - self._reference.flux[2]) < 0.6 * self._reference.field

    def _correction(self, samples: CompassSamples) -> CompassMounting | None:
        """Return the correction by right angles and sign after which the field is the Earth's.

        Rotations about the vertical do not change the sense: their angle is found by the fixes.
        """
        tilts = [(roll, 0) for roll in (0, 180, 90, -90)] + [(0, 90), (0, -90)]
        for is_negated, (roll, pitch) in product((False, True), tilts):
            rotation = Rotation.from_euler("ZYX", (0, pitch, roll), degrees=True)
            correction = CompassMounting(rotation, is_negated)
            fit = fit_compass(samples, correction.matrix)
            if self._is_earths(fit) and abs(fit.up - self._reference.flux[2]) < 15.0:
                return correction
        return None

    def _axes_advice(self, correction: CompassMounting, unit: float, mounting: Rotation) -> str:
        """Return the advice on a compass whose axes or signs are wrong."""
        offset = self._offset(correction)
        yaw = 0.0 if offset is None else _squared(offset)
        total = Rotation.from_euler("Z", -yaw) * correction.rotation * mounting
        steps = []
        if total.magnitude() > math.radians(1.0) or mounting.magnitude() > 0:
            steps.append(f"--mounting compass={_angles(total)}")
        if correction.is_negated:
            steps.append(f"--unit magnetic_field={-unit:g}")
        unsure = "" if offset is not None else ", with the YAW of your robot as the last number"
        return (
            "its field does not turn as the gyro says: its axes or signs differ from the robot's; "
            f"with {' '.join(steps)}{unsure} it agrees"
        )

    def _iron_advice(self, fit: CompassFit) -> str | None:
        """Return the advice on iron near the compass."""
        level, (_, soft_sigma, hard_sigma) = abs(fit.earth), fit.sigma
        if abs(fit.hard) - _SURE * hard_sigma > _HARD_IRON * level:
            x, y = fit.hard.real, fit.hard.imag
            degrees = math.degrees(math.asin(min(abs(fit.hard) / level, 1.0)))
            return (
                f"its heading is off by up to {degrees:.0f} degrees, once a turn, against the "
                f"gyro: hard iron of ({x:.1f}, {y:.1f}) uT forward and left; calibrate it, or "
                "subtract that in its driver"
            )
        if abs(fit.soft) - _SURE * soft_sigma > _SOFT_IRON * level:
            degrees = math.degrees(math.asin(min(abs(fit.soft) / level, 1.0)))
            return (
                f"its heading is off by up to {degrees:.0f} degrees, twice a turn, against the "
                "gyro: soft iron; calibrate it with a fit of an ellipse, or mount it away from iron"
            )
        return None

    def _offset_advice(self, mounting: Rotation) -> str | None:
        """Return the advice on a heading with a constant error."""
        offset = self._offset(CompassMounting(Rotation.identity()))
        if offset is None or not _MIN_OFFSET < abs(offset) < _BACKWARDS:
            return None
        # A field that is seen farther to the right is a heading farther to the left.
        total = Rotation.from_euler("Z", -_squared(offset)) * mounting
        return (
            f"its heading is {abs(math.degrees(offset)):.0f} degrees to the "
            f"{'right' if offset > 0 else 'left'} of the way that the fixes show: it is turned on "
            f"the robot, or the declination is wrong; with --mounting compass={_angles(total)} it "
            "agrees"
        )

    def _offset(self, correction: CompassMounting) -> float | None:
        """Return the angle by which the way by compass and wheels has to be turned to the fixes'.

        Args:
            correction: Correction of the compass.

        Returns:
            Angle [rad], counter-clockwise; None where the way or the fixes are too short.
        """
        table, fixes = np.array(self._rows), np.array(self._fixes).reshape(-1, 5)
        fixes = fixes[check_fixes(fixes).good]
        stamps, speeds = table[:, 0], np.nan_to_num(table[:, 7])
        fixes = fixes[(fixes[:, 0] >= stamps[0]) & (fixes[:, 0] <= stamps[-1])]
        if len(fixes) < _FEWEST_FIXES:
            return None
        east, north, _ = self._reference.flux
        forward, left, _ = self.samples.levelled(correction.matrix).T
        headings = math.atan2(north, east) - np.arctan2(left, forward)
        steps = speeds * np.diff(stamps, prepend=stamps[0]) * np.cos(table[:, 2])
        way = np.interp(fixes[:, 0], stamps, np.cumsum(steps * np.exp(1j * headings)))
        places = self._reference.to_map(np.nan_to_num(fixes[:, 1:4])) @ np.array([1, 1j, 0])
        way, places = way - way.mean(), places - places.mean()
        spread, driven = np.sqrt(np.mean(np.abs(places) ** 2)), np.sqrt(np.mean(np.abs(way) ** 2))
        moment = complex(np.vdot(way, places)) / len(way)
        if spread < _MIN_SPREAD or abs(moment) < _MIN_CORRELATION * spread * driven:
            return None
        return float(np.angle(moment))


def _squared(angle: float) -> float:
    """Return the right angle next to an angle if it is near, else the angle [rad]."""
    square = round(angle / (math.pi / 2)) * math.pi / 2
    return square if abs(angle - square) < _SQUARE else angle


def _angles(rotation: Rotation) -> str:
    """Return a mounting as ``--mounting`` takes it: place 0, then roll, pitch, yaw [deg]."""
    yaw, pitch, roll = (round(math.degrees(angle)) for angle in yaw_pitch_roll(rotation))
    return f"0,0,0,{roll},{pitch},{yaw}"
