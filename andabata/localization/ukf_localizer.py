"""Localizer of the robot: inertial unit, wheels, compass and satellites, fused to a pose.

The parts: ``filter_period`` (predictions by ``process_model`` and corrections by
``measurement_models``, in the order of their stamps), ``fix_conversion`` (fixes to the map),
``replay_buffer`` (late fixes), ``sensor_monitor`` (warnings and health).
"""

from collections import Counter, deque

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.localization.antenna import remove_lever_arm
from andabata.localization.arrival_rate import ArrivalRate
from andabata.localization.estimator_status import EstimatorStatus
from andabata.localization.filter_parameters import BodyParameters, FilterModel, NoiseModel
from andabata.localization.filter_period import (
    ACCEPTED,
    COMPASS,
    DISTURBED,
    GATED,
    GNSS,
    OUTCOMES,
    REJECTED,
    SENSORS,
    WHEELS,
    first_inertial,
    run_period,
)
from andabata.localization.filter_state import (
    ATTITUDE,
    COMPASS_ERROR,
    GNSS_ERROR,
    GYRO_BIAS,
    HORIZONTAL,
    PITCH,
    POSITION,
    ROLL,
    SPEED,
    STATES,
    YAW,
    Belief,
    X,
    Y,
    Z,
)
from andabata.localization.fix_check import is_impossible, reports_no_fix
from andabata.localization.fix_conversion import FixConverter
from andabata.localization.fix_repetition import FixRepetition
from andabata.localization.heading_alignment import HeadingAlignment
from andabata.localization.inertial_bridge import BRIDGE_GYRO_NOISE, bridging_rows
from andabata.localization.initial_covariance import MIN_SLOW_ERROR, initial_covariance
from andabata.localization.localizer import Health
from andabata.localization.measurements import (
    HORIZONTAL_SIGMA,
    STAMP_TOLERANCE,
    Measurements,
)
from andabata.localization.plausibility import Plausibility, SenseRows
from andabata.localization.receiver_error import ReceiverError
from andabata.localization.replay_buffer import FilterPeriod, ReplayBuffer
from andabata.localization.sense_watch import Wheel
from andabata.localization.sensor_monitor import SensorMonitor, health_of
from andabata.localization.sigma_points import Workspace
from andabata.localization.ukf import SigmaWeights
from andabata.localization.ukf_config import UkfConfig
from andabata.localization.wheel_scale import WheelScale
from andabata.machine.clock import TICK
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose, PoseTrack, wrap
from andabata.machine.proprioception import MICROTESLA
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings
from terrain.record import packed

__all__ = ["UkfConfig", "UkfLocalizer"]

_NO_FIXES = np.empty((0, 6))
"""No rows of ``Measurements.gnss``."""

_TO_MICROTESLA = np.array([1.0, 1 / MICROTESLA, 1 / MICROTESLA, 1 / MICROTESLA])
"""Factors of a magnetometer row: its stamp, and tesla to microtesla."""

_FAR = 10_000.0
"""Distance from the map's origin from which ``odom`` begins at its own [m]: clouds in ``odom`` are
float32, with a resolution of a millimetre there and of half a metre at a thousand kilometres."""

_SLOW_CHANGE = 0.05
"""Relative change of the slow satellite error that changes the filter."""

_RESTART_SIGMA = 10.0
"""Standard deviation that is added to the position after a restart [m]."""

_RESTART_YAW_SIGMA = 0.5
"""Standard deviation that is added to the heading after a restart [rad]."""

_KEPT_STAMPS = 100
"""Number of latest fixes whose stamps are remembered: those of ten seconds at ten a second."""

_SUPERVISED = {"wheels": WHEELS, "compass": COMPASS, "gnss": GNSS}
"""Row of counts of each sensor whose rows the filter accepts or not."""

_INFLATION = {"compass": 1.0, "gnss": 3.0}
"""Standard deviation [rad, m] of a first inflation, by sensor."""

_POSE = [X, Y, Z, ROLL, PITCH, YAW]
"""States of the pose, in the order of a ROS message's covariance."""

_GATED, _DISTURBED = "beyond the gate", "in a field that is not the Earth's"
_INVALID, _LATE, _REPEATED = "invalid", "too late or too early", "repeated"
"""Reasons why a reading is not used."""

_ONE_YAW, _ONE_COMPASS_ERROR = slice(YAW, YAW + 1), slice(COMPASS_ERROR, COMPASS_ERROR + 1)
"""Slices of one state, for ``_inflate``."""


class UkfLocalizer:
    """Unscented Kalman filter of 20 states, updated once per control period.

    A late fix is inserted where it belongs: the filter returns to the period in which the fix was
    taken and runs again from there. The filter continues without a sensor that falls silent or
    sends invalid data as long as the others suffice; ``health`` and ``warnings`` report it.
    """

    def __init__(self, config: UkfConfig, robot: RobotModel, geo_reference: GeoReference) -> None:
        """Begin without a pose; ``reset`` sets one.

        Args:
            config: Parameters of the filter.
            robot: Parameters of the body.
            geo_reference: Datum of the map, and the magnetic field there.
        """
        self._config = config
        self._yaw_rate_per_wheel = robot.wheel_radius / robot.effective_track
        body = BodyParameters(
            robot.wheel_radius, robot.creep, robot.creep_slope, robot.pivot, 0.0, 0.0, 0.0
        )
        weights = SigmaWeights.merwe(STATES)
        self._model = FilterModel(body, config.noise, config.gates, weights, config.max_lead)
        self._converter = FixConverter(config, geo_reference)
        self._plausibility = Plausibility(
            config.plausibility, Wheel(robot.wheel_radius, self._yaw_rate_per_wheel)
        )
        self._arrivals = ArrivalRate()
        self.set_geo_reference(geo_reference)
        self._workspace = packed(Workspace.allocate())
        self._buffer = ReplayBuffer(config.max_delay)
        self._track = PoseTrack()
        self._rows = np.zeros((64, 8))
        self._scratch_odometry = np.zeros(4)
        self.reset(Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), 0.0)

    def set_geo_reference(self, geo_reference: GeoReference, heading_only: bool = False) -> None:
        """Replace the datum of the map, and the magnetic field there, from now on.

        Args:
            geo_reference: Datum of the map.
            heading_only: True if its field is known only roughly, so that the compass corrects the
                heading and not the tilt.
        """
        self._converter.set_geo_reference(geo_reference)
        east, north, up = (float(part) for part in geo_reference.flux)
        body = self._model.body._replace(
            flux_east=east, flux_north=north, flux_up=up, heading_only=heading_only
        )
        self._model = self._model._replace(body=body)
        self._models = packed(self._model)

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Start at a pose with the configured uncertainty.

        After a rough start, and far from the map's origin, ``odom`` begins at its own origin: its
        clouds then depend neither on the place on Earth nor on the compass.

        Args:
            pose: Pose in the map.
            stamp: Time [s].
            rough: True if the pose comes from the first fix, the compass and gravity.
        """
        counts = np.zeros((len(SENSORS), OUTCOMES), dtype=np.int64)
        self._converter.clear_counts()
        belief = Belief(np.zeros(STATES), initial_covariance(self._config, rough), counts)
        self._belief = packed(belief)
        self._x, self._P, self._counts = (self._belief[name][0] for name in Belief._fields)
        self._x[ATTITUDE] = Rotation.from_quat(pose.quaternion).as_euler("ZYX")[::-1]
        self._x[POSITION] = pose.position
        own_origin = rough or float(np.abs(pose.position).max()) > _FAR
        self._odometry = np.zeros(4) if own_origin else np.array([*pose.position, self._x[YAW]])
        self._now = stamp
        self._buffer.clear()
        self._ahead: Measurements | None = None  # Rows that wait for the next period.
        self._refused = 0  # Fixes that the filter never saw, whatever it runs again.
        self._fix_stamps: deque[float] = deque(maxlen=_KEPT_STAMPS)
        self._alignment = HeadingAlignment()
        self._monitor = SensorMonitor(self._config, stamp)
        self._plausibility.reset(stamp)
        self._arrivals.reset(stamp)
        self._repetition = FixRepetition(self._config.repetition)
        self._wheel_scale = WheelScale(self._config.wheel_scale)
        self._reported: tuple[str, ...] = ()
        self._receiver = ReceiverError(self._config.receiver)
        self._model = self._model._replace(noise=self._config.noise)
        self._models = packed(self._model)
        self._is_valid = True
        self._track.clear()
        first = self.odometry if own_origin else pose
        self._track.append(stamp, first.position, first.quaternion)

    def update(self, readings: SensorReadings) -> None:
        """Filter the readings of one control period, late ones at their own time.

        Args:
            readings: Readings of the period.
        """
        before = self._counts.tolist()
        given = _rows(readings.gnss, 5)
        fixes = self._fixes_in_map(given, readings)
        punctual = fixes
        if len(fixes):
            late = fixes[:, 0] < self._now - STAMP_TOLERANCE
            for fix in fixes[late]:
                self._replay_with(fix)
            punctual = fixes[~late]
        rows = SenseRows(
            _rows(readings.imu, 7), _rows(readings.encoders, 3), _rows(readings.mag, 4)
        )
        self._arrivals.update(readings.stamp, *rows, given)
        rows = self._plausibility.believed(readings.stamp, self._now, rows, self._x)
        imu, noise = self._inertial_rows(readings.stamp, rows)
        measurements = self._with_waiting(rows, imu, punctual)
        period = FilterPeriod(self._belief.copy(), self._now, measurements, noise)
        self._buffer.append(period)
        self._buffer.drop_old(self._now)
        filled, waiting = self._run(period, self._odometry)
        self._ahead = self._rows_ahead(measurements) if waiting else None
        self._track.extend(self._rows[:filled])
        way = float(self._x[SPEED]) * (self._now - period.now)
        self._monitor.drive(way)
        self._repetition.drive(way)
        self._supervise(readings.stamp, before, fixes)
        self._orient(fixes)
        if not self._is_valid:
            self._restart(readings.stamp)

    def _fixes_in_map(
        self, given: NDArray[np.float64], readings: SensorReadings
    ) -> NDArray[np.float64]:
        """Return the valid fixes as rows of ``Measurements.gnss``, without the lever arm."""
        if not len(given):
            return _NO_FIXES
        if is_impossible(given).any():
            self._monitor.report_impossible_fix(readings.stamp)
        reports = given[reports_no_fix(given), 0]
        if len(reports) and reports.max() > readings.stamp - self._config.max_delay:
            self._monitor.report_no_fix(readings.stamp)
        believed = self._repetition.believed(given)
        self._plausibility.unused["gnss"][_REPEATED] += len(given) - len(believed)
        fixes, rejected = self._converter.to_map(believed, self._x[Z])
        self._refused += rejected
        fixes = self._timely(fixes, readings.stamp)
        fixes = remove_lever_arm(fixes, self.pose.quaternion, readings.antenna)
        if len(fixes):
            self._split_errors(fixes)
        return fixes

    def _timely(self, fixes: NDArray[np.float64], stamp: float) -> NDArray[np.float64]:
        """Return the fixes of new instants that the filter can still or already take in.

        Others are counted here: even the error of the receiver must not follow from them. A fix
        that is sent again, as by drivers that repeat the last one, would count twice.

        Args:
            fixes: Rows of ``Measurements.gnss``.
            stamp: End of the period [s].
        """
        timely = np.zeros(len(fixes), dtype=np.bool_)
        for k, time in enumerate(fixes[:, 0].tolist()):
            is_late = time < self._now - STAMP_TOLERANCE
            lost = time > stamp + self._config.max_lead or time in self._fix_stamps
            timely[k] = not (lost or (is_late and not self._buffer.reaches(time)))
            if timely[k]:
                self._fix_stamps.append(time)
        self._refused += len(fixes) - int(timely.sum())
        return fixes[timely]

    def _split_errors(self, fixes: NDArray[np.float64]) -> None:
        """Leave each fix its white noise alone, in place: its slow error is a state.

        Args:
            fixes: Rows of ``Measurements.gnss`` whose horizontal sigma is the stated one.
        """
        turn = self._x[YAW] - self._odometry[3]
        sine, cosine = np.sin(turn), np.cos(turn)
        for fix, place in zip(fixes, self._track.at(fixes[:, 0]), strict=True):
            x, y = place[:2]
            way = np.array([cosine * x - sine * y, sine * x + cosine * y])
            self._receiver.add(float(fix[0]), fix[1:3] - way)
        slow = self._receiver.slow(float(fixes[-1, HORIZONTAL_SIGMA]) ** 2)
        if abs(slow - self._model.noise.gnss_error) > _SLOW_CHANGE * slow:
            self._set_slow_error(slow)
        fixes[:, HORIZONTAL_SIGMA] = self._receiver.white

    def _set_slow_error(self, sigma: float) -> None:
        """Change the standard deviation of the slow satellite error [m]."""
        noise = self._model.noise
        ratio = sigma / max(noise.gnss_error, MIN_SLOW_ERROR)
        if ratio > 1:
            self._inflate(GNSS_ERROR, np.sqrt(sigma**2 - noise.gnss_error**2))
        else:  # What is a smaller error than it was held for is so by its ratio.
            self._x[GNSS_ERROR] *= ratio
            self._P[GNSS_ERROR] *= ratio
            self._P[:, GNSS_ERROR] *= ratio
        self._model = self._model._replace(noise=noise._replace(gnss_error=sigma))
        self._models = packed(self._model)

    def _inertial_rows(
        self, stamp: float, rows: SenseRows
    ) -> tuple[NDArray[np.float64], NoiseModel]:
        """Return the inertial rows, a gap before them bridged, and the noise that they have."""
        imu, noise = rows.imu, self._model.noise
        # A row as old as the state, or far ahead of the clock, moves nothing: it is no arrival.
        first = first_inertial(imu, self._now, stamp + self._config.max_lead)
        end = stamp + TICK
        if first < len(imu):
            self._monitor.receive("imu", stamp)
            end = float(imu[first, 0])
        if not end - self._now > self._config.imu_timeout + TICK:
            return imu, noise
        bias, wheels = self._x[GYRO_BIAS], rows.wheels
        bridge = bridging_rows(self._now, end, bias, wheels, self._yaw_rate_per_wheel)
        return np.concatenate([bridge, imu]), noise._replace(gyro=BRIDGE_GYRO_NOISE)

    def _with_waiting(
        self, rows: SenseRows, imu: NDArray[np.float64], fixes: NDArray[np.float64]
    ) -> Measurements:
        """Return the measurements of a period, after those that waited for it.

        Args:
            rows: Rows that are believed.
            imu: Inertial rows, a gap before them bridged.
            fixes: Fixes in the map that are not late.
        """
        arrived = Measurements(imu, rows.wheels, rows.mag * _TO_MICROTESLA, fixes)
        if self._ahead is None:
            return arrived
        return Measurements(*map(np.concatenate, zip(self._ahead, arrived, strict=True)))

    def _rows_ahead(self, measurements: Measurements) -> Measurements:
        """Return the measurements that are ahead of the state, and not too far."""
        ahead = []
        for rows in measurements:
            lead = rows[:, 0] > self._now + STAMP_TOLERANCE
            ahead.append(rows[lead & (rows[:, 0] <= self._now + self._config.max_lead)])
        return Measurements(measurements.imu[:0], *ahead[1:])

    def _run(self, period: FilterPeriod, odometry: NDArray[np.float64]) -> tuple[int, int]:
        """Filter a period; return the numbers of rows of the track, and of rows that wait."""
        if len(period.measurements.imu) > len(self._rows):  # A long gap was bridged.
            self._rows = np.zeros((2 * len(period.measurements.imu), 8))
        models = self._models
        if period.noise is not self._model.noise:
            # Without an inertial unit nothing levels the compass: it corrects the heading alone.
            bridged = period.noise.gyro == BRIDGE_GYRO_NOISE
            body = self._model.body
            body = body._replace(heading_only=body.heading_only or bridged)
            models = packed(self._model._replace(noise=period.noise, body=body))
        self._now, filled, waiting, self._is_valid = run_period(
            self._belief,
            self._now,
            odometry,
            period.measurements,
            models,
            self._workspace,
            self._rows,
        )
        return filled, waiting

    def _replay_with(self, fix: NDArray[np.float64]) -> None:
        """Insert a late fix into the period in which it was taken, and filter again from there."""
        periods = self._buffer.rewind(float(fix[0]))
        if not periods:
            self._counts[GNSS, REJECTED] += 1
            return
        first = periods[0]
        self._belief[:], self._now = first.belief, first.now
        for k, old in enumerate(periods):
            measurements = old.measurements if k else old.with_fix(fix)
            period = FilterPeriod(self._belief.copy(), self._now, measurements, old.noise)
            self._buffer.append(period)
            # The track in odom stays as it was published: sweeps were placed with it.
            self._run(period, self._scratch_odometry)

    def _supervise(self, stamp: float, before: list[list[int]], fixes: NDArray[np.float64]) -> None:
        """Record which sensors sent data and were accepted, and inflate the covariance if due.

        Only a row that the filter could weigh, whether it accepted it or not, counts as received.

        Args:
            stamp: End of the period [s].
            before: Table of counts before the period.
            fixes: Fixes that arrived, in the map.
        """
        monitor = self._monitor
        for fix in fixes:
            monitor.add_offset(fix[1:3] - self._x[HORIZONTAL])
            scale = self._wheel_scale
            scale.add(float(fix[0]), fix[1:3], self._plausibility.way)
            if scale.is_wrong is not None:
                self._plausibility.judge_wheels(scale.is_wrong, scale.begin, stamp)
        after = self._counts.tolist()
        for name, row in _SUPERVISED.items():
            was, now = before[row], after[row]
            if now[ACCEPTED] > was[ACCEPTED]:
                monitor.accept(name, stamp)
            elif now[GATED] > was[GATED] or now[DISTURBED] > was[DISTURBED]:
                monitor.receive(name, stamp)
        for name, sigma in _INFLATION.items():
            if name == "gnss" and self._repetition.is_repeating:
                continue
            factor = monitor.inflation(name, stamp)
            if factor is not None:
                self._inflate(self._doubted(name, stamp), sigma * factor)

    def _orient(self, fixes: NDArray[np.float64]) -> None:
        """Find the heading of a disoriented robot by two fixes, as soon as they are far apart."""
        if self._P[YAW, YAW] < self._config.lost_yaw**2:
            self._alignment.clear()
            return
        for fix, place in zip(fixes, self._track.at(fixes[:, 0]), strict=True):
            found = self._alignment.add(fix[1:3], place[:2], self._receiver.white)
            if found is not None:
                self._set_heading(wrap(float(self._odometry[3]) + found.angle), found.sigma)

    def _set_heading(self, yaw: float, sigma: float) -> None:
        """Replace the heading and its uncertainty; the compass has to prove itself again."""
        self._x[YAW] = yaw
        self._P[YAW], self._P[:, YAW] = 0.0, 0.0
        self._P[YAW, YAW] = sigma**2
        self._inflate(_ONE_COMPASS_ERROR, np.pi / 2)

    def _doubted(self, sensor: str, stamp: float) -> slice:
        """Return the states that are wrong if all data of a sensor are rejected for long.

        The gyro holds the heading: a compass that contradicts it errs itself, unless fixes
        contradict the estimate as well.
        """
        if sensor == "gnss":
            return HORIZONTAL
        return _ONE_YAW if self._monitor.contradicts_fixes(stamp) else _ONE_COMPASS_ERROR

    def _inflate(self, states: slice, sigma: float) -> None:
        """Add a variance ``sigma**2`` to some states."""
        diagonal = np.arange(STATES)[states]
        self._P[diagonal, diagonal] += sigma**2

    def _restart(self, stamp: float) -> None:
        """Start again at the last finite pose, with a large uncertainty."""
        x = self._buffer.latest_finite_state()
        if x is None:
            x = np.zeros(STATES)
        self.reset(_pose_of(x), stamp)
        self._inflate(HORIZONTAL, _RESTART_SIGMA)
        self._inflate(_ONE_YAW, _RESTART_YAW_SIGMA)

    def report(self, causes: tuple[str, ...]) -> None:
        """Take causes from outside of the estimate, which hold until the next report."""
        self._reported = causes

    @property
    def pose(self) -> Pose:
        """Latest estimated pose in the map."""
        return _pose_of(self._x)

    @property
    def odometry(self) -> Pose:
        """Latest pose of dead reckoning, in ``odom``."""
        roll, pitch = self._x[:2]
        yaw = float(self._odometry[3])
        return Pose.from_euler(self._odometry[:3].copy(), float(roll), float(pitch), yaw)

    @property
    def track(self) -> PoseTrack:
        """Poses of dead reckoning over time, in ``odom``."""
        return self._track

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Covariance of x, y [m] and yaw [rad], shape (3, 3)."""
        return self._P[np.ix_([X, Y, YAW], [X, Y, YAW])]

    @property
    def belief(self) -> Belief:
        """Copies of all states, their covariance and the table of counts."""
        return Belief(self._x.copy(), self._P.copy(), self._all_counts())

    @property
    def counts(self) -> dict[str, tuple[int, int, int]]:
        """Numbers of accepted, gated and rejected measurements, by sensor.

        A magnetic field that is not the Earth's counts as gated.
        """
        return {
            name: (
                row[ACCEPTED],
                row[GATED] + row[DISTURBED],
                row[REJECTED] + self._plausibility.unused[name].total(),
            )
            for name, row in zip(SENSORS, self._all_counts().tolist(), strict=True)
        }

    def _all_counts(self) -> NDArray[np.int64]:
        """Return the table of counts with the fixes that were refused before the filter."""
        counts = self._counts.copy()
        counts[GNSS, REJECTED] += self._refused
        return counts

    @property
    def rejected_fixes(self) -> Counter[str]:
        """Number of fixes that were rejected before the filter, by reason."""
        return self._converter.rejected

    @property
    def assumed_fixes(self) -> Counter[str]:
        """Number of fixes with something missing, by what was assumed."""
        return self._converter.assumed

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about sensors and estimate, and what was reported; empty without any."""
        repetition, doubted = self._repetition, list(self._plausibility.doubts)
        arrivals = self._arrivals.warnings()
        if not (doubted or repetition.is_frozen):
            return self._reported + self._monitor.warnings(self._now, self._P, (), arrivals)
        causes = self._plausibility.warnings(self._now)
        if repetition.is_frozen:
            time = self._now - repetition.since
            causes += (f"gnss: repeats its last fix while the wheels turn, for {time:.1f} s",)
            doubted.append("gnss")
        return (
            self._reported + causes + self._monitor.warnings(self._now, self._P, doubted, arrivals)
        )

    @property
    def health(self) -> Health:
        """Health of the estimate; see ``health_of``."""
        return health_of(self.warnings, self._monitor.has_fixes(self._now))

    @property
    def status(self) -> EstimatorStatus:
        """Status of the estimate, made at each call."""
        warnings = self.warnings
        accepted = self._counts[:, ACCEPTED].tolist()
        return EstimatorStatus(
            health_of(warnings, self._monitor.has_fixes(self._now)),
            warnings,
            self._P[np.ix_(_POSE, _POSE)],
            dict(zip(SENSORS, accepted, strict=True)),
            self._unused(),
        )

    def _unused(self) -> dict[str, dict[str, int]]:
        """Return the numbers of readings that were not used, by sensor and reason."""
        unused = {}
        for name, row in zip(SENSORS, self._all_counts().tolist(), strict=True):
            invalid = Counter({_INVALID: row[REJECTED]})
            if name == SENSORS[GNSS]:  # Those that the filter never saw have a reason of their own.
                reasons = self._converter.rejected
                late = row[REJECTED] - reasons.total()
                invalid = reasons + Counter({_LATE: late})
            found = Counter({_GATED: row[GATED], _DISTURBED: row[DISTURBED]})
            found.update(invalid)
            found.update(self._plausibility.unused[name])
            unused[name] = {reason: number for reason, number in found.items() if number}
        return {name: reasons for name, reasons in unused.items() if reasons}


def _pose_of(x: NDArray[np.float64]) -> Pose:
    """Return the pose of a state."""
    roll, pitch, yaw = x[ATTITUDE]
    return Pose.from_euler(x[POSITION].copy(), float(roll), float(pitch), float(yaw))


def _rows(given: NDArray[np.float64] | None, width: int) -> NDArray[np.float64]:
    """Return the rows of a sensor as float64, none without any.

    Raises:
        ValueError: If the rows have another width.
    """
    if given is None:
        return np.empty((0, width))
    if given.ndim != 2 or given.shape[1] != width:
        raise ValueError(f"rows: expected shape (k, {width}), got {given.shape}")
    return np.ascontiguousarray(given, dtype=np.float64)
