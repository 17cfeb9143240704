"""The robot's one filter: inertial unit, wheels, compass and satellites to a pose."""

import math
from collections import Counter, deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.localization.antenna import base_of_antenna
from andabata.localization.fix_check import check_fixes
from andabata.localization.localizer import Health
from andabata.localization.process_model import (
    COMPASS,
    FIX,
    IMU,
    SENSORS,
    STATES,
    WHEELS,
    Belief,
    Body,
    Gates,
    Noise,
    Room,
    Sensed,
    Weights,
    run_period,
)
from andabata.machine.clock import TICK
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.proprioception import TESLA
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings

MOST_TURN = 50.0
"""No robot turns faster [rad/s]: such a gyro reading is refused."""

_BRIDGE = 100
"""Most steps of a prediction without inertial rows."""

_NOTHING = Sensed(*(np.empty((0, width)) for width in (7, 3, 4, 6)))
"""Nothing sensed."""

_MICROTESLA = np.array([1.0, 1 / TESLA, 1 / TESLA, 1 / TESLA])

_FEW = 5
"""Fixes whose median is compared."""

_BLIND_TURN = 0.1
"""Gyro noise of a prediction by wheels [rad/sqrt(s)]."""

_FAR = 10_000.0
"""Distance from the map's origin from which ``odom`` begins at its own [m]: clouds in ``odom`` are
float32, which has millimetres there and half metres at a thousand kilometres."""

_NO_HEIGHT = 1e6
"""Vertical standard deviation of a fix without an altitude [m]: it tells nothing."""

_LEAST_VARIANCE = 1e-4
"""Least variance of a fix that is believed [m2]: a centimetre."""


class UkfConfig(BaseModel):
    """What the filter expects of its senses, and when it says so.

    Attributes:
        start: Standard deviations at the start: tilt [rad], yaw [rad], gyro bias [rad/s], position
            [m], height [m], speed [m/s], own field [uT], accelerometer bias [m/s2].
        rough_start: The same of a start that the first fix, the compass and gravity tell.
        noise: Numbers of the model.
        gates: Squared Mahalanobis distances beyond which a measurement is not believed.
        fix_sigma: Standard deviation of a fix that does not tell its own [m].
        vertical: Noise of a fix's altitude, as a multiple of the horizontal one.
        memory: How late a measurement may come [s].
        overtaking: How far a measurement may be ahead of the inertial rows [s].
        imu_silence: Without inertial rows for longer, the wheels tell the turning [s].
        wheel_silence: Longest silence of the encoders that goes unsaid [s].
        compass_silence: Of the compass, or of believed readings [s].
        fix_silence: Of the satellites, or of believed fixes [s].
        doubt: When a sense that speaks has not been believed for so long, the filter doubts itself
            [s].
        steady_doubt: The same for fixes that all lie off by the same, which signals do that come by
            a detour, and a robot whose wheels spin does not [s].
        steady: How much the offsets of such fixes may change [m].
        detour: How far a detour shifts a fix at most [m].
        lost_position: Standard deviation of the position from which the robot is lost [m].
        lost_yaw: Of the heading [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    start: tuple[float, float, float, float, float, float, float, float] = (
        0.02,
        0.05,
        0.006,
        0.5,
        0.1,
        0.05,
        1.0,
        0.03,
    )
    rough_start: tuple[float, float, float, float, float, float, float, float] = (
        0.05,
        0.1,
        0.006,
        1.5,
        3.0,
        0.3,
        1.0,
        0.03,
    )
    noise: Noise = Noise()
    gates: Gates = Gates()
    fix_sigma: float = Field(default=3.0, gt=0, le=100)
    vertical: float = Field(default=2.0, gt=0)
    memory: float = Field(default=2.0, gt=0, le=30)
    overtaking: float = Field(default=0.5, gt=0, le=5)
    imu_silence: float = Field(default=0.1, gt=0)
    wheel_silence: float = Field(default=0.2, gt=0)
    compass_silence: float = Field(default=1.0, gt=0)
    fix_silence: float = Field(default=6.0, gt=0)
    doubt: float = Field(default=15.0, gt=0)
    steady_doubt: float = Field(default=45.0, gt=0)
    steady: float = Field(default=2.5, gt=0)
    detour: float = Field(default=15.0, gt=0)
    lost_position: float = Field(default=3.0, gt=0)
    lost_yaw: float = Field(default=0.35, gt=0)


@dataclass(frozen=True)
class _Period:
    """A control period as it began and what was sensed in it, for measurements that come late."""

    x: NDArray[np.float64]
    P: NDArray[np.float64]
    now: float
    counts: NDArray[np.int64]
    sensed: Sensed
    noise: Noise


class UkfLocalizer:
    """An unscented Kalman filter of 18 numbers, fed one control period at a time.

    A fix that comes late is put where it belongs: the filter goes back to the period in which the
    fix was taken and runs on from there. A sense that falls silent, or speaks nonsense, is done
    without as long as the rest suffices, and ``health`` and ``complaints`` say so.

    Attributes:
        refused: Number of fixes that were refused before the filter saw them, by reason.
        assumed: Number of fixes in which something was missing, by what was assumed.
    """

    def __init__(self, config: UkfConfig, robot: RobotModel, geo_reference: GeoReference) -> None:
        """Begin without a pose; ``reset`` gives one.

        Args:
            config: What to expect.
            robot: Wheel radius and track.
            geo_reference: Datum of the map, and the magnetic field there.
        """
        self._config = config
        self._body = Body(
            robot.wheel_radius, robot.creep, robot.creep_slope, robot.pivot, 0.0, 0.0, 0.0
        )
        self._yaw_rate = robot.wheel_radius / robot.effective_track
        self._belief = Belief(self._body, config.noise, config.gates, Weights.make())
        self.refused, self.assumed = Counter[str](), Counter[str]()
        self.refer(geo_reference)
        self._room = Room.make()
        self._track = PoseTrack()
        self._rows = np.zeros((64, 8))
        self._scratch = np.zeros(4)
        self.reset(Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), 0.0)

    def refer(self, geo_reference: GeoReference, loose: bool = False) -> None:
        """Take another datum of the map, and the magnetic field there, from now on.

        Args:
            geo_reference: The datum.
            loose: Whether its field is known only roughly, so that the compass tells the heading
                and nothing of the tilt.
        """
        self._geo_reference = geo_reference
        # Added to heights by fixes [m]; None until the first that has an altitude.
        self._height: float | None = None if geo_reference.altitude is None else 0.0
        x, y, z = (float(part) for part in geo_reference.flux)
        self._body = self._body._replace(flux_x=x, flux_y=y, flux_z=z, loose=loose)
        self._belief = self._belief._replace(body=self._body)

    def reset(self, pose: Pose, stamp: float, rough: bool = False) -> None:
        """Start at a pose that is known as well as ``start`` says, or ``rough_start``.

        From a rough start, and far from the map's origin, ``odom`` begins at its own origin: clouds
        then depend neither on where on Earth the robot is nor on the compass.
        """
        known = self._config.rough_start if rough else self._config.start
        tilt, yaw, bias, position, height, speed, iron, force = known
        noise = self._config.noise
        sigma = np.array(
            [tilt, tilt, yaw]
            + [bias] * 3
            + [position, position, height]
            + [speed, max(speed, noise.drift)]
            + [iron] * 3
            + [max(noise.wander, 1e-3)] * 2
            + [force] * 2
        )
        self._x, self._P = np.zeros(STATES), np.diag(sigma**2)
        self._x[:3] = Rotation.from_quat(pose.quaternion).as_euler("ZYX")[::-1]
        self._x[6:9] = pose.position
        own = rough or float(np.abs(pose.position).max()) > _FAR
        self._odometry = np.zeros(4) if own else np.array([*pose.position, self._x[2]])
        self._now = stamp
        self._counts = np.zeros((len(SENSORS), 3), dtype=np.int64)
        self._periods: deque[_Period] = deque()
        self._ahead = _NOTHING
        self._heard = dict.fromkeys(("imu", "wheels", "compass", "gnss"), stamp)
        self._believed = dict.fromkeys(("compass", "gnss"), stamp)
        self._doubted = dict(self._believed)
        self._doubts = dict.fromkeys(self._believed, 0)
        self._offsets: list[NDArray[np.float64]] = []  # Of fixes since the last that was believed.
        self._whole = True
        self._track.clear()
        first = self.odometry if own else pose
        self._track.append(stamp, first.position, first.quaternion)

    def update(self, readings: SensorReadings) -> None:
        """Take in one control period of senses, late ones where they belong."""
        before = self._counts[:, 0].copy()
        places = self._in_map(readings.gnss)
        arrived = early = base_of_antenna(places, self.pose.quaternion, readings.antenna)
        if len(arrived):
            late = arrived[:, 0] <= self._now
            for fix in arrived[late]:
                self._go_back(fix)
            early = arrived[~late]
        imu, noise = self._inertial(readings)
        field = _rows(readings.mag, 4) * _MICROTESLA
        sensed = self._parted(Sensed(imu, _rows(readings.encoders, 3), field, early))
        period = self._begun(sensed, noise)
        self._keep(period)
        filled = self._run(period, self._odometry)
        if filled:
            rows = self._rows[:filled]
            self._track.extend(rows[:, 0], rows[:, 1:4], rows[:, 4:8])
        self._offsets += [fix[1:3] - self._x[6:8] for fix in arrived]
        self._listen(readings, before, arrived)

    def _in_map(self, fixes: NDArray[np.float64] | None) -> NDArray[np.float64]:
        """Return fixes as stamp, x, y, z, horizontal and vertical sigma, shape (k, 6)."""
        given = _rows(fixes, 5)
        if not len(given):
            return _NOTHING.fixes
        check = check_fixes(given)
        self._counts[FIX, 2] += check.refused.total()
        self.refused += check.refused
        self.assumed += check.assumed
        given = given[check.good]
        if not len(given):
            return _NOTHING.fixes
        config, variance = self._config, given[:, 4]
        known = np.isfinite(variance) & (variance > 0)
        variance = np.where(known, np.maximum(variance, _LEAST_VARIANCE), config.fix_sigma**2)
        found = np.empty((len(given), 6))
        found[:, 0], found[:, 1:4] = given[:, 0], self._places(given[:, 1:4])
        # What a receiver calls its error holds the wandering part, which is a state here.
        found[:, 4] = np.sqrt(np.maximum(variance - config.noise.wander**2, 0.01))
        found[:, 5] = config.vertical * np.sqrt(variance)
        found[np.isnan(given[:, 3]), 5] = _NO_HEIGHT
        return found

    def _places(self, geodetic: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places in the map [m]; without an altitude at the height that is believed."""
        geo_reference, flat = self._geo_reference, np.isnan(geodetic[:, 2])
        if not flat.any() and self._height == 0.0:
            return geo_reference.to_map(geodetic)
        filled = geodetic.copy()
        filled[flat, 2] = geo_reference.altitude or 0.0
        places = geo_reference.to_map(filled)
        if self._height is None and not flat.all():
            self._height = float(self._x[8] - places[~flat, 2][0])
        places[:, 2] += self._height or 0.0
        places[flat, 2] = self._x[8]
        return places

    def _inertial(self, readings: SensorReadings) -> tuple[NDArray[np.float64], Noise]:
        """Return inertial rows that can be, and the model's noise.

        Where rows are missing for longer than ``imu_silence``, the wheels tell the turning.
        """
        given, noise = _rows(readings.imu, 7), self._config.noise
        good = (np.abs(given[:, 1:4]) < MOST_TURN).all(axis=1) & np.isfinite(given[:, 0])
        if not good.all():
            self._counts[IMU, 2] += int((~good).sum())
            given = given[good]
        if len(given):
            self._heard["imu"] = readings.stamp
        until = float(given[0, 0]) if len(given) else readings.stamp + TICK
        gap = until - self._now
        if not gap > self._config.imu_silence + TICK:
            return given, noise
        step = max(TICK, (gap - TICK) / _BRIDGE)
        stamps = np.arange(self._now + step, until - TICK / 2, step)
        bridge = np.full((len(stamps), 7), np.nan)
        bridge[:, 0], bridge[:, 1:4] = stamps, self._x[3:6]
        wheels = _rows(readings.encoders, 3)
        if len(wheels) and np.isfinite(wheels).all():
            bridge[:, 3] += float((wheels[:, 2] - wheels[:, 1]).mean()) * self._yaw_rate
        return np.concatenate([bridge, given]), noise._replace(turn=_BLIND_TURN)

    def _parted(self, sensed: Sensed) -> Sensed:
        """Return what the period's inertial rows reach; what has overtaken them waits.

        In a live robot each sense comes its own way. Rows too far ahead are refused.
        """
        last = float(sensed.imu[-1, 0]) if len(sensed.imu) else self._now
        now, later = [sensed.imu], [_NOTHING[0]]
        for k, sensor in enumerate((WHEELS, COMPASS, FIX), start=1):
            rows, waited = sensed[k], self._ahead[k]
            if len(waited):
                rows = np.concatenate([waited, rows])
            ahead = rows[:, 0] > last + 1e-9
            if not len(rows) or not ahead.any():
                now.append(rows)
                later.append(_NOTHING[k])
                continue
            early = ahead & (rows[:, 0] > last + self._config.overtaking)
            self._counts[sensor, 2] += int(early.sum())
            now.append(rows[~ahead])
            later.append(rows[ahead & ~early])
        self._ahead = Sensed(*later)
        return Sensed(*now)

    def _begun(self, sensed: Sensed, noise: Noise) -> _Period:
        """Return a period that begins now."""
        return _Period(
            self._x.copy(), self._P.copy(), self._now, self._counts.copy(), sensed, noise
        )

    def _keep(self, period: _Period) -> None:
        """Remember a period as long as something may come late."""
        self._periods.append(period)
        while self._now - self._periods[0].now > self._config.memory:
            self._periods.popleft()

    def _run(self, period: _Period, odometry: NDArray[np.float64]) -> int:
        """Run the filter through a period and return how many rows of the track were filled."""
        if len(period.sensed.imu) > len(self._rows):  # A long gap was bridged.
            self._rows = np.zeros((2 * len(period.sensed.imu), 8))
        belief = self._belief
        if period.noise is not belief.noise:
            belief = belief._replace(noise=period.noise)
        self._now, filled, whole = run_period(
            self._x,
            self._P,
            self._now,
            odometry,
            period.sensed,
            belief,
            self._room,
            self._counts,
            self._rows,
        )
        self._whole = bool(whole and np.isfinite(self._x).all())
        return int(filled)

    def _go_back(self, fix: NDArray[np.float64]) -> None:
        """Put a late fix into the period that it was taken in, and run on from there."""
        earlier = [k for k, period in enumerate(self._periods) if period.now < fix[0]]
        if not earlier:
            self._counts[FIX, 2] += 1
            return
        later = list(self._periods)[earlier[-1] :]
        first = later[0]
        at = int(np.searchsorted(first.sensed.fixes[:, 0], fix[0]))
        fixes = np.insert(first.sensed.fixes, at, fix, axis=0)
        self._x, self._P, self._now = first.x.copy(), first.P.copy(), first.now
        self._counts = first.counts.copy()
        for _ in later:
            self._periods.pop()
        for k, old in enumerate(later):
            sensed = old.sensed if k else old.sensed._replace(fixes=fixes)
            period = self._begun(sensed, old.noise)
            self._periods.append(period)
            self._run(period, self._scratch)

    def _listen(
        self, readings: SensorReadings, before: NDArray[np.int64], fixes: NDArray[np.float64]
    ) -> None:
        """Note which senses spoke and which were believed; ``fixes`` are those that arrived.

        A sense that speaks and is not believed for long makes the filter doubt itself, each time
        twice as much as before.
        """
        given = {
            "wheels": readings.encoders,
            "compass": readings.mag,
            "gnss": fixes,
        }
        for name, rows in given.items():
            if rows is not None and len(rows):
                self._heard[name] = readings.stamp
        for name, sensor, states, sigma in (
            ("compass", COMPASS, slice(2, 3), 1.0),
            ("gnss", FIX, slice(6, 8), 3.0),
        ):
            if self._counts[sensor, 0] > before[sensor]:
                self._believed[name] = self._doubted[name] = readings.stamp
                self._doubts[name] = 0
                if sensor == FIX:
                    self._offsets.clear()
            speaks = self._heard[name] == readings.stamp
            steady = sensor == FIX and self._look_like_a_detour()
            patience = self._config.steady_doubt if steady else self._config.doubt
            if speaks and readings.stamp - self._doubted[name] > patience:
                diagonal = np.arange(STATES)[states]
                self._P[diagonal, diagonal] += (sigma * 2 ** self._doubts[name]) ** 2
                self._doubts[name] += 1
                self._doubted[name] = readings.stamp
        if not self._whole:
            self._start_over(readings.stamp)

    def _look_like_a_detour(self) -> bool:
        """Return whether the fixes since the last that was believed are all off by the same."""
        if len(self._offsets) < 2 * _FEW or self._doubts["gnss"]:
            return False
        first = np.median(self._offsets[:_FEW], axis=0)
        last = np.median(self._offsets[-_FEW:], axis=0)
        near = np.hypot(*last) < self._config.detour
        return bool(near and np.hypot(*(last - first)) < self._config.steady)

    def _start_over(self, stamp: float) -> None:
        """Begin afresh at the last pose that was a number, knowing it badly."""
        begins = (period.x for period in reversed(self._periods))
        x = next((x for x in begins if np.isfinite(x).all()), np.zeros(STATES))
        pose = Pose.from_euler(x[6:9].copy(), float(x[0]), float(x[1]), float(x[2]))
        self.reset(pose, stamp)
        diagonal = np.arange(6, 8)
        self._P[diagonal, diagonal] += 10.0**2

    @property
    def pose(self) -> Pose:
        """The latest estimated pose in the map."""
        roll, pitch, yaw = self._x[:3]
        return Pose.from_euler(self._x[6:9].copy(), float(roll), float(pitch), float(yaw))

    @property
    def odometry(self) -> Pose:
        """The latest pose of dead reckoning."""
        roll, pitch = self._x[:2]
        yaw = float(self._odometry[3])
        return Pose.from_euler(self._odometry[:3].copy(), float(roll), float(pitch), yaw)

    @property
    def track(self) -> PoseTrack:
        """Poses of dead reckoning by time."""
        return self._track

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Of x, y [m] and yaw [rad], shape (3, 3)."""
        return self._P[np.ix_([6, 7, 2], [6, 7, 2])]

    @property
    def counts(self) -> dict[str, tuple[int, int, int]]:
        """Believed, gated and refused measurements of each sensor."""
        rows = self._counts.tolist()
        return {name: (row[0], row[1], row[2]) for name, row in zip(SENSORS, rows, strict=True)}

    @property
    def complaints(self) -> tuple[str, ...]:
        """What is wrong, in words; empty when all is well."""
        config, now = self._config, self._now
        found = []
        for name, since, limit, text in (
            ("imu", self._heard["imu"], config.imu_silence, "silent"),
            ("wheels", self._heard["wheels"], config.wheel_silence, "silent"),
            ("compass", self._believed["compass"], config.compass_silence, "not believed"),
            ("gnss", self._believed["gnss"], config.fix_silence, "not believed"),
        ):
            if now - since > limit + 1e-9:
                found.append(f"{name}: {text} for {now - since:.1f} s")
        east, north, both = self._P[6, 6], self._P[7, 7], self._P[6, 7]
        position = math.sqrt((east + north) / 2 + math.hypot((east - north) / 2, both))
        if position > config.lost_position:
            found.append(f"position: uncertain by {position:.1f} m")
        yaw = math.sqrt(self._P[2, 2])
        if yaw > config.lost_yaw:
            found.append(f"heading: uncertain by {np.rad2deg(yaw):.0f} degrees")
        return tuple(found)

    @property
    def health(self) -> Health:
        """Lost without a position, a heading, or both IMU and wheels."""
        found = self.complaints
        if not found:
            return Health.OK
        silent = {text.split(":")[0] for text in found}
        if {"position", "heading"} & silent or {"imu", "wheels"} <= silent:
            return Health.LOST
        return Health.DEGRADED


def _rows(given: NDArray[np.float64] | None, width: int) -> NDArray[np.float64]:
    """Return rows of a sense as float64, none when it was silent.

    Raises:
        ValueError: If the rows have another width.
    """
    if given is None:
        return np.empty((0, width))
    if given.ndim != 2 or given.shape[1] != width:
        raise ValueError(f"rows: expected shape (k, {width}), got {given.shape}")
    return np.ascontiguousarray(given, dtype=np.float64)
