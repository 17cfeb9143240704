"""Proprioceptive sensors: IMU, magnetometer, wheel encoders and GNSS, each with its errors.

The kernel differentiates true poses into the readings of IMU, encoders and magnetometer; what a
real robot's compass and inertial unit add, is added to them. Fixes come from ``GnssReceiver``.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.machine.clock import TICK
from andabata.machine.geo_reference import GeoReference
from andabata.machine.gnss_receiver import GnssConfig, GnssReceiver
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from andabata.machine.robot import RobotModel
from terrain.kernel import kernel
from terrain.objects import SceneObject

MICROTESLA = 1e-6
"""Microtesla [T]."""

GRAVITY = 9.81
"""Standard acceleration of free fall [m/s2]."""

_STAMP, _POSITION, _QUATERNION, _WHEELS = 0, 1, 4, 8
"""First columns of a row of the true track: stamp [s], x, y, z [m], quaternion x, y, z, w, left and
right wheel speed [rad/s]."""

_GYRO, _ACCELERATION = 1, 4
"""First columns of an inertial row after its stamp: angular velocity [rad/s], specific force
[m/s2]."""

_BIAS_ACCELERATION = 3
"""First element of the accelerometer's bias; the gyro's comes before."""

_NOISE_GYRO, _NOISE_ACCELERATION, _NOISE_WALK, _NOISE_MAG, _NOISE_COLUMNS = 0, 3, 6, 12, 15
"""First columns of a tick's noise: gyro, accelerometer, walks of the six biases, magnetometer; and
their number."""


class ImuConfig(BaseModel):
    """Inertial measurement unit, one reading per tick, at the middle of the axles.

    Noise densities and random walks are those that Burri et al. 2016 (EuRoC) publish for an
    ADIS16448. Turn-on biases are assumptions.

    Attributes:
        gyro_noise: Noise density of the gyro [rad/s/sqrt(Hz)].
        gyro_walk: Random walk of the gyro's bias [rad/s2/sqrt(Hz)].
        gyro_bias: Standard deviation of the gyro's bias at turn-on [rad/s].
        acceleration_noise: Noise density of the accelerometer [m/s2/sqrt(Hz)].
        acceleration_walk: Random walk of the accelerometer's bias [m/s3/sqrt(Hz)].
        acceleration_bias: Standard deviation of the accelerometer's bias at turn-on [m/s2].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    gyro_noise: float = Field(default=1.7e-4, ge=0)
    gyro_walk: float = Field(default=1.9e-5, ge=0)
    gyro_bias: float = Field(default=5e-3, ge=0)
    acceleration_noise: float = Field(default=2.0e-3, ge=0)
    acceleration_walk: float = Field(default=3.0e-3, ge=0)
    acceleration_bias: float = Field(default=0.03, ge=0)


class CompassConfig(BaseModel):
    """Magnetometer, one reading per tick.

    Attributes:
        noise: White noise of each axis [uT] (the HMC5883L's data sheet: 0.2 uT and more).
        hard_iron: Standard deviation of each axis of the robot's own field that remains after
            calibration [uT] (assumption: 1 uT, two degrees of heading).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noise: float = Field(default=0.4, ge=0)
    hard_iron: float = Field(default=1.0, ge=0)


class EncoderConfig(BaseModel):
    """Wheel encoders, one per side, one reading per tick.

    Attributes:
        counts: Number of counts per turn (assumption: 1024 lines, four edges each).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    counts: int = Field(default=4096, ge=4)


class ProprioceptionConfig(BaseModel):
    """Parameters of all proprioceptive sensors.

    Attributes:
        imu: Inertial measurement unit.
        compass: Magnetometer.
        encoders: Wheel encoders.
        gnss: Satellite receiver.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    imu: ImuConfig = Field(default_factory=ImuConfig)
    compass: CompassConfig = Field(default_factory=CompassConfig)
    encoders: EncoderConfig = Field(default_factory=EncoderConfig)
    gnss: GnssConfig = Field(default_factory=GnssConfig)


class ProprioceptiveReadings(NamedTuple):
    """Readings of a control period, in the units of ``SensorReadings``.

    Attributes:
        imu: Inertial rows, shape (k, 7).
        encoders: Encoder rows, shape (k, 3).
        mag: Magnetometer rows, shape (k, 4).
        gnss: Fixes that arrived, shape (j, 5).
    """

    imu: NDArray[np.float64]
    encoders: NDArray[np.float64]
    mag: NDArray[np.float64]
    gnss: NDArray[np.float64]


class Proprioception:
    """Proprioceptive sensors of one robot in one world, sampled once per control period."""

    def __init__(
        self,
        config: ProprioceptionConfig,
        geo_reference: GeoReference,
        objects: Sequence[SceneObject],
        robot: RobotModel,
    ) -> None:
        """Mount the sensors.

        Args:
            config: Errors of the sensors.
            geo_reference: Datum of the map, and the magnetic field there.
            objects: Objects of the world; its trees shade the receiver.
            robot: Parameters of the body, for the speed of its wheels at cruising speed.
        """
        self._config = config
        self._flux = geo_reference.flux
        self._receiver = GnssReceiver(config.gnss, geo_reference, objects)
        self._cruise = robot.speed / robot.wheel_radius
        # Densities become standard deviations of a tick: white noise by 1 / sqrt(dt), walks by
        # sqrt(dt).
        imu, root = config.imu, np.sqrt(TICK)
        densities = [imu.gyro_noise / root, imu.acceleration_noise / root]
        walks = [imu.gyro_walk * root, imu.acceleration_walk * root]
        self._noise_sigma = np.repeat([*densities, *walks, config.compass.noise], 3)
        self._count_angle = 2 * np.pi / config.encoders.counts

    def reset(
        self,
        pose: NDArray[np.float64],
        rng: np.random.Generator,
        constants: TrueConstants = AS_BELIEVED,
    ) -> None:
        """Draw new biases and begin at rest at time zero.

        Args:
            pose: True pose x, y, z [m], quaternion x, y, z, w, shape (7,).
            rng: Source of the seed of all further noise.
            constants: True constants of the drive.
        """
        self._constants, self._is_ideal = constants, constants.is_ideal
        self._rng = np.random.default_rng(rng.integers(2**63))
        imu = self._config.imu
        draw = self._rng.standard_normal
        self._bias = np.concatenate([imu.gyro_bias * draw(3), imu.acceleration_bias * draw(3)])
        self._hard_iron = self._config.compass.hard_iron * draw(3)
        self._receiver.reset(self._rng, constants)
        self._poses = np.tile(pose, (2, 1))  # The last two, oldest first.
        self._angles = np.zeros(2)

    def sample(self, rows: NDArray[np.float64]) -> ProprioceptiveReadings:
        """Return the readings of a control period.

        Args:
            rows: Rows of stamp [s], x, y, z [m], quaternion x, y, z, w, actual left and right wheel
                speed [rad/s] at each tick; shape (k, 10).
        """
        noise = self._rng.standard_normal((len(rows), _NOISE_COLUMNS))
        inertial = np.empty((len(rows), 7))
        encoders = np.empty((len(rows), 3))
        mag = np.empty((len(rows), 4))
        _sample_ticks(
            rows,
            self._poses,
            self._angles,
            self._bias,
            self._flux,
            self._hard_iron,
            self._count_angle,
            noise,
            self._noise_sigma,
            inertial,
            encoders,
            mag,
        )
        if not self._is_ideal:
            self._distort(rows, inertial, mag)
        return ProprioceptiveReadings(inertial, encoders, mag, self._receiver.arrived(rows))

    def _distort(
        self, rows: NDArray[np.float64], inertial: NDArray[np.float64], mag: NDArray[np.float64]
    ) -> None:
        """Give the readings of a real robot's inertial unit and compass, in place.

        Args:
            rows: Rows as in ``sample``, with the speeds of the true wheels, shape (k, 10).
            inertial: Inertial rows, shape (k, 7).
            mag: Magnetometer rows [T], shape (k, 4).
        """
        turn = Rotation.from_rotvec(self._constants.imu_tilt).as_matrix()
        for first in (_GYRO, _ACCELERATION):
            inertial[:, first : first + 3] = inertial[:, first : first + 3] @ turn
        attitude = Rotation.from_quat(rows[:, _QUATERNION : _QUATERNION + 4])
        soft = attitude.apply(self._flux, inverse=True) @ np.transpose(self._constants.soft_iron)
        speeds = np.abs(rows[:, _WHEELS : _WHEELS + 2]).mean(axis=1, keepdims=True)
        motors = np.minimum(speeds / self._cruise, 1.0) * self._constants.motor_field
        mag[:, 1:] += (soft + motors) * MICROTESLA


@kernel
def _sample_ticks(
    rows: NDArray[np.float64],
    poses: NDArray[np.float64],
    angles: NDArray[np.float64],
    bias: NDArray[np.float64],
    flux: NDArray[np.float64],
    hard_iron: NDArray[np.float64],
    step: float,
    noise: NDArray[np.float64],
    sigma: NDArray[np.float64],
    imu: NDArray[np.float64],
    encoders: NDArray[np.float64],
    mag: NDArray[np.float64],
) -> None:
    """Fill the rows of IMU, encoders and magnetometer from true poses.

    A gyro integrates: its reading is the rotation from tick to tick. Specific force comes from
    three consecutive positions, which is what an accelerometer with a filter of two ticks reads.

    Args:
        rows: Rows of the true track as in ``Proprioception.sample``, shape (k, 10).
        poses: Last two true poses, oldest first, changed in place, shape (2, 7).
        angles: Angles of left and right wheel [rad], changed in place, shape (2,).
        bias: Biases of gyro [rad/s] and accelerometer [m/s2], changed in place, shape (6,).
        flux: Magnetic flux density in the map [uT], shape (3,).
        hard_iron: Field of the robot itself in the base frame [uT], shape (3,).
        step: Angle of an encoder count [rad].
        noise: Standard normal noise of each tick, scaled in place, shape (k, 15).
        sigma: Standard deviations of the noise, shape (15,).
        imu: Inertial rows that are filled, shape (k, 7).
        encoders: Encoder rows that are filled, shape (k, 3).
        mag: Magnetometer rows that are filled [T], shape (k, 4).
    """
    for k in range(len(rows)):
        for c in range(_NOISE_COLUMNS):
            noise[k, c] *= sigma[c]
        # Biases of gyro and accelerometer walk.
        for c in range(6):
            bias[c] += noise[k, _NOISE_WALK + c]
        # Rotation from the last pose to this one, in the base frame: conj(q_last) * q.
        q = _QUATERNION
        x, y, z, w = rows[k, q], rows[k, q + 1], rows[k, q + 2], rows[k, q + 3]
        px, py, pz, pw = -poses[1, 3], -poses[1, 4], -poses[1, 5], poses[1, 6]
        dw = pw * w - px * x - py * y - pz * z
        dx = pw * x + px * w + py * z - pz * y
        dy = pw * y - px * z + py * w + pz * x
        dz = pw * z + px * y - py * x + pz * w
        if dw < 0:  # The same rotation, the short way.
            dw, dx, dy, dz = -dw, -dx, -dy, -dz
        # Rotation vector from the quaternion: angle 2 atan2(|v|, w) along v.
        sine = np.sqrt(dx * dx + dy * dy + dz * dz)
        scale = 2.0 if sine < 1e-12 else 2.0 * np.arctan2(sine, dw) / sine
        imu[k, 0] = rows[k, _STAMP]
        imu[k, _GYRO] = scale * dx / TICK + bias[0] + noise[k, _NOISE_GYRO]
        imu[k, _GYRO + 1] = scale * dy / TICK + bias[1] + noise[k, _NOISE_GYRO + 1]
        imu[k, _GYRO + 2] = scale * dz / TICK + bias[2] + noise[k, _NOISE_GYRO + 2]
        # Rows of the rotation matrix from base to map.
        r = (
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        )
        # Specific force: the second difference of positions, less gravity, which points down.
        force = np.zeros(3)
        for a in range(3):
            force[a] = (rows[k, _POSITION + a] - 2 * poses[1, a] + poses[0, a]) / TICK**2
        force[2] += GRAVITY
        mag[k, 0] = rows[k, _STAMP]
        # Both are vectors of the map: the transposed matrix turns them into the base frame.
        for a in range(3):
            base_force, base_flux = 0.0, 0.0
            for b in range(3):
                base_force += r[b][a] * force[b]
                base_flux += r[b][a] * flux[b]
            imu[k, _ACCELERATION + a] = (
                base_force + bias[_BIAS_ACCELERATION + a] + noise[k, _NOISE_ACCELERATION + a]
            )
            mag[k, 1 + a] = (base_flux + hard_iron[a] + noise[k, _NOISE_MAG + a]) * MICROTESLA
        # Encoders report whole counts; the remainder of the angle is kept for the next tick.
        encoders[k, 0] = rows[k, _STAMP]
        for side in range(2):
            before = np.floor(angles[side] / step)
            angles[side] += rows[k, _WHEELS + side] * TICK
            encoders[k, 1 + side] = (np.floor(angles[side] / step) - before) * step / TICK
        for c in range(7):
            poses[0, c] = poses[1, c]
            poses[1, c] = rows[k, _POSITION + c]
