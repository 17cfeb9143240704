"""What the robot feels of itself: IMU, compass, wheel encoders, GNSS, each with its faults."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial import cKDTree

from andabata.machine.clock import TICK
from andabata.machine.geo_reference import GeoReference
from terrain.classes import SemanticClass
from terrain.kernel import kernel
from terrain.objects import SceneObject

TESLA = 1e-6
"""A microtesla in tesla."""

GRAVITY = 9.81
"""Acceleration of free fall [m/s2]."""


class ImuConfig(BaseModel):
    """An inertial unit of 100 Hz at the middle of the axles.

    Noise densities and random walks are those that Burri et al. 2016 (EuRoC) publish for an
    ADIS16448. Turn-on biases are assumptions.

    Attributes:
        gyro_noise: Density [rad/s/sqrt(Hz)].
        gyro_walk: Random walk of the bias [rad/s2/sqrt(Hz)].
        gyro_bias: Standard deviation of the bias at turn-on [rad/s].
        acceleration_noise: Density [m/s2/sqrt(Hz)].
        acceleration_walk: Random walk of the bias [m/s3/sqrt(Hz)].
        acceleration_bias: Standard deviation of the bias at turn-on [m/s2].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    gyro_noise: float = Field(default=1.7e-4, ge=0)
    gyro_walk: float = Field(default=1.9e-5, ge=0)
    gyro_bias: float = Field(default=5e-3, ge=0)
    acceleration_noise: float = Field(default=2.0e-3, ge=0)
    acceleration_walk: float = Field(default=3.0e-3, ge=0)
    acceleration_bias: float = Field(default=0.03, ge=0)


class CompassConfig(BaseModel):
    """A magnetometer of 100 Hz.

    Attributes:
        noise: White noise of each axis [uT] (the HMC5883L's data sheet: 0.2 uT and more).
        iron: Standard deviation of each axis of the field that the robot itself makes and that
            calibration has left over [uT] (assumption: 1 uT, two degrees of heading).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noise: float = Field(default=0.4, ge=0)
    iron: float = Field(default=1.0, ge=0)


class EncoderConfig(BaseModel):
    """Wheel encoders, one a side, read 100 times a second.

    Attributes:
        counts: Counts of a turn (assumption: 1024 lines, four edges each).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    counts: int = Field(default=4096, ge=4)


class GnssConfig(BaseModel):
    """A satellite receiver with one fix a second (paper: 1 m of horizontal resolution).

    The metre is split, by assumption, into white noise and an error that wanders. Near trees
    signals are lost or come by a detour.

    Attributes:
        noise: White noise of each horizontal axis [m].
        wander: Standard deviation of each axis of the wandering error [m].
        wander_time: Its correlation time [s].
        vertical: Noise of the altitude, as a multiple of the horizontal one.
        latency: From the instant of a fix to its arrival [s].
        dropout: Chance that a fix is lost, in the open; the receiver then says that it has none.
        detour: Chance a second that a detour begins, in the open.
        detour_shift: Standard deviation of each axis of a detour [m].
        detour_time: Mean duration of a detour [s].
        shade: Factor on both chances nearer than ``shade_range`` to a tree.
        shade_range: See ``shade`` [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noise: float = Field(default=0.66, ge=0)
    wander: float = Field(default=0.25, ge=0)
    wander_time: float = Field(default=60.0, gt=0)
    vertical: float = Field(default=2.0, ge=0)
    latency: float = Field(default=0.15, ge=0, lt=1)
    dropout: float = Field(default=0.01, ge=0, le=1)
    detour: float = Field(default=0.005, ge=0, le=1)
    detour_shift: float = Field(default=6.0, ge=0)
    detour_time: float = Field(default=4.0, ge=1)
    shade: float = Field(default=6.0, ge=1)
    shade_range: float = Field(default=3.0, ge=0)


class ProprioceptionConfig(BaseModel):
    """All of them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    imu: ImuConfig = Field(default_factory=ImuConfig)
    compass: CompassConfig = Field(default_factory=CompassConfig)
    encoders: EncoderConfig = Field(default_factory=EncoderConfig)
    gnss: GnssConfig = Field(default_factory=GnssConfig)


class Proprioception:
    """The senses of one robot in one world, sampled each control period."""

    def __init__(
        self,
        config: ProprioceptionConfig,
        geo_reference: GeoReference,
        objects: Sequence[SceneObject],
    ) -> None:
        """Mount the senses.

        Args:
            config: Their faults.
            geo_reference: Where on Earth.
            objects: Of the world; its trees shade the receiver.
        """
        self._config = config
        self._geo_reference = geo_reference
        self._flux = geo_reference.flux
        trees = [o.vertices[:, :2].mean(axis=0) for o in objects if o.semantic in _SHADING]
        self._trees = cKDTree(np.array(trees)) if trees else None
        gnss = config.gnss
        self._keep = np.exp(-1 / gnss.wander_time)
        self._spread = np.array([gnss.noise, gnss.noise, gnss.noise * gnss.vertical])

    def reset(self, pose: NDArray[np.float64], rng: np.random.Generator) -> None:
        """Draw fresh biases and stand still at a pose (x, y, z, quaternion) at time zero."""
        self._rng = np.random.default_rng(rng.integers(2**63))
        imu, gnss = self._config.imu, self._config.gnss
        draw = self._rng.standard_normal
        self._bias = np.concatenate([imu.gyro_bias * draw(3), imu.acceleration_bias * draw(3)])
        self._iron = self._config.compass.iron * draw(3)
        self._wander = gnss.wander * draw(3)
        self._detour = np.zeros(3)
        self._poses = np.tile(pose, (2, 1))  # The last two, oldest first.
        self._angles = np.zeros(2)
        self._fixes: list[NDArray[np.float64]] = []
        self._seconds = 0

    def sample(
        self, rows: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Sense a control period.

        Args:
            rows: At each tick stamp [s], x, y, z [m], quaternion x, y, z, w, actual left and right
                wheel speed [rad/s]; shape (k, 10).

        Returns:
            Inertial rows, encoder rows, compass rows and fixes as in ``SensorReadings``.
        """
        imu = self._config.imu
        noise = self._rng.standard_normal((len(rows), 15))
        noise[:, 0:3] *= imu.gyro_noise / np.sqrt(TICK)
        noise[:, 3:6] *= imu.acceleration_noise / np.sqrt(TICK)
        noise[:, 6:9] *= imu.gyro_walk * np.sqrt(TICK)
        noise[:, 9:12] *= imu.acceleration_walk * np.sqrt(TICK)
        noise[:, 12:15] *= self._config.compass.noise
        inertial = np.empty((len(rows), 7))
        encoders = np.empty((len(rows), 3))
        field = np.empty((len(rows), 4))
        _feel(
            rows,
            self._poses,
            self._angles,
            2 * np.pi / self._config.encoders.counts,
            self._flux,
            self._iron,
            self._bias,
            noise,
            inertial,
            encoders,
            field,
        )
        return inertial, encoders, field, self._arrived(rows)

    def _arrived(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fixes that arrive in a period, taking a new one each whole second."""
        if rows[-1, 0] > self._seconds + 1 - TICK / 2:
            for row in rows:
                second = round(row[0])
                if second > self._seconds and abs(row[0] - second) < TICK / 2:
                    self._seconds = second
                    self._receive(row)
        due = [fix for fix in self._fixes if fix[0] + self._config.gnss.latency <= rows[-1, 0]]
        self._fixes = self._fixes[len(due) :]
        return np.array(due).reshape(-1, 5)

    def _receive(self, row: NDArray[np.float64]) -> None:
        """Take a fix; of one that is lost the receiver says so."""
        gnss, draw = self._config.gnss, self._rng.standard_normal
        wander = gnss.wander * np.sqrt(1 - self._keep**2)
        self._wander = self._keep * self._wander + wander * draw(3)
        shaded = (
            self._trees is not None
            and len(self._trees.query_ball_point(row[1:3], gnss.shade_range)) > 0
        )
        factor = gnss.shade if shaded else 1.0
        lost, begins, ends = self._rng.random(3)
        if self._detour.any():
            if ends < 1 / gnss.detour_time:
                self._detour = np.zeros(3)
        elif begins < gnss.detour * factor:
            self._detour = gnss.detour_shift * draw(3)
        error = self._spread * draw(3) + self._wander + self._detour
        if lost < gnss.dropout * factor:
            self._fixes.append(np.array([row[0], *[np.nan] * 3, np.inf]))
            return
        place = self._geo_reference.to_geodetic((row[1:4] + error)[None])[0]
        self._fixes.append(np.array([row[0], *place, gnss.noise**2 + gnss.wander**2]))


_SHADING = (SemanticClass.TRUNK, SemanticClass.FOLIAGE)


@kernel
def _feel(rows, poses, angles, step, flux, iron, bias, noise, inertial, encoders, field):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the rows of IMU, encoders and compass from poses.

    A gyro integrates: its reading is the turn from tick to tick. Specific force comes from three
    positions in a row, which is what an accelerometer with a filter of two ticks reads.
    """
    for k in range(len(rows)):
        for c in range(6):
            bias[c] += noise[k, 6 + c]
        x, y, z, w = rows[k, 4], rows[k, 5], rows[k, 6], rows[k, 7]
        px, py, pz, pw = -poses[1, 3], -poses[1, 4], -poses[1, 5], poses[1, 6]
        # The turn from the last pose to this one, in the base frame.
        dw = pw * w - px * x - py * y - pz * z
        dx = pw * x + px * w + py * z - pz * y
        dy = pw * y - px * z + py * w + pz * x
        dz = pw * z + px * y - py * x + pz * w
        if dw < 0:
            dw, dx, dy, dz = -dw, -dx, -dy, -dz
        sine = np.sqrt(dx * dx + dy * dy + dz * dz)
        scale = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, dw) / sine
        inertial[k, 0] = rows[k, 0]
        inertial[k, 1] = scale * dx / TICK + bias[0] + noise[k, 0]
        inertial[k, 2] = scale * dy / TICK + bias[1] + noise[k, 1]
        inertial[k, 3] = scale * dz / TICK + bias[2] + noise[k, 2]
        # Rows of the rotation from base to map.
        r = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
        force = np.zeros(3)
        for a in range(3):
            force[a] = (rows[k, 1 + a] - 2 * poses[1, a] + poses[0, a]) / TICK**2
        force[2] += GRAVITY
        field[k, 0] = rows[k, 0]
        for a in range(3):
            felt, seen = 0.0, 0.0
            for b in range(3):
                felt += r[b][a] * force[b]
                seen += r[b][a] * flux[b]
            inertial[k, 4 + a] = felt + bias[3 + a] + noise[k, 3 + a]
            field[k, 1 + a] = (seen + iron[a] + noise[k, 12 + a]) * TESLA
        encoders[k, 0] = rows[k, 0]
        for side in range(2):
            before = np.floor(angles[side] / step)
            angles[side] += rows[k, 8 + side] * TICK
            encoders[k, 1 + side] = (np.floor(angles[side] / step) - before) * step / TICK
        for c in range(7):
            poses[0, c] = poses[1, c]
            poses[1, c] = rows[k, 1 + c]
