"""Sensor readings of a control period: the interface between source and navigator.

Sources are the simulator, a recorded bag and ROS. ``ReadingsFilter`` is the seam between a source
and the navigator: faults, latency and perturbations are functions of that form.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import Pose
from traversability.cloud import PointCloud


@dataclass(frozen=True)
class WheelSpeeds:
    """Angular speeds of the wheels, positive forward.

    Attributes:
        left: Speed of the wheels on the left [rad/s].
        right: Speed of the wheels on the right [rad/s].
    """

    left: float
    right: float


@dataclass(frozen=True)
class Sweeps:
    """Vertical laser sweeps of the rotating head, oldest first.

    Beam ``j`` of sweep ``i`` is emitted at ``stamps[i] + j * beam_period``, at the head angle
    ``head_angles[i] + head_rate * j * beam_period``.

    Attributes:
        stamps: Time of each sweep's first beam [s], float64, shape (s,).
        head_angles: Head azimuth from the base's X axis at that time [rad], unwrapped, float64,
            shape (s,).
        head_rate: Turning speed of the head [rad/s].
        beam_period: Time from beam to beam [s].
        elevations: Angle of each beam from the head's zenith, positive towards the head's front
            [rad], float32, shape (b,), or (s, b) if they differ from sweep to sweep.
        ranges: Distances [m], float32, shape (s, b); ``inf`` is no return.
        classes: True semantic classes of the returns (simulation only), uint8, shape (s, b), or
            None.
        mounting: Pose of the head in ``frame``: x, y, z [m], quaternion x, y, z, w, shape (7,);
            None for its origin.
        frame: Frame of the mounting: ``sensor``, level at the robot's ``lidar_height``, or
            ``base_link``.
    """

    stamps: NDArray[np.float64]
    head_angles: NDArray[np.float64]
    head_rate: float
    beam_period: float
    elevations: NDArray[np.float32]
    ranges: NDArray[np.float32]
    classes: NDArray[np.uint8] | None = None
    mounting: NDArray[np.float64] | None = None
    frame: str = "sensor"


@dataclass(frozen=True)
class VehicleState:
    """True state of the body, for evaluation only.

    Attributes:
        stamp: Time [s].
        pose: Pose of ``base_footprint`` in the map.
        linear: Velocity in the base frame [m/s], shape (3,).
        angular: Angular velocity in the base frame [rad/s], shape (3,).
        wheels: Actual wheel speeds.
        collided: True if the body touches a walker, or a solid object other than the ground.
        tipped: True if the body has rolled over beyond recovery.
        work: Work of the motors since the body was put down [J], without recuperation; None if the
            plant has no motors.
        contact: Contact of the body: what it touches, and who drove into whom.
    """

    stamp: float
    pose: Pose
    linear: NDArray[np.float64]
    angular: NDArray[np.float64]
    wheels: WheelSpeeds
    collided: bool = False
    tipped: bool = False
    work: float | None = None
    contact: Contact = Contact.NONE


@dataclass(frozen=True)
class SensorReadings:
    """Readings of all sensors since the last control step; those of absent sensors are None.

    Attributes:
        stamp: End of the control period [s].
        sweeps: Sweeps that began in the period.
        frames: Clouds of a 3D laser that arrived, oldest first, with a time for each point, in
            ``sensor``, ``base_link`` or ``base_footprint``.
        horizontal: Ranges of a horizontal scanner with one beam per sector [m], float32, shape
            (n_sectors,), ``inf`` is no return (stage 1 of the curriculum).
        imu: Rows of stamp [s], angular velocity [rad/s], specific force [m/s2] in the base frame,
            float64, shape (k, 7).
        encoders: Rows of stamp [s], left, right wheel speed [rad/s], float64, shape (k, 3).
        mag: Rows of stamp [s], magnetic flux density in the base frame [T], float64, shape (k,
            4).
        gnss: Satellite fixes that arrived, which may be older than the period: rows of stamp [s],
            latitude, longitude [deg], altitude [m], NaN if unknown, and horizontal variance of each
            axis [m2], infinite if the receiver had no fix and NaN if unknown; float64, shape
            (k, 5).
        antenna: Lever arm: position of the satellite antenna in the base frame [m], shape (3,);
            None for its origin.
        truth: True state at ``stamp`` (simulation only).
        true_track: Rows of stamp [s], x, y, z [m], quaternion x, y, z, w in the period (simulation
            only), float64, shape (k, 8).
        walkers: Rows of x, y, z of the foot, radius, which is 0 for one that is not there, and
            height of each walker of the world at ``stamp`` [m] (simulation only), float64,
            shape (m, 5); None where there are none.
    """

    stamp: float
    sweeps: Sweeps | None = None
    frames: tuple[PointCloud, ...] = ()
    horizontal: NDArray[np.float32] | None = None
    imu: NDArray[np.float64] | None = None
    encoders: NDArray[np.float64] | None = None
    mag: NDArray[np.float64] | None = None
    gnss: NDArray[np.float64] | None = None
    antenna: NDArray[np.float64] | None = None
    truth: VehicleState | None = None
    true_track: NDArray[np.float64] | None = None
    walkers: NDArray[np.float64] | None = None


class ReadingsFilter(Protocol):
    """Function of readings between a source and the navigator.

    Sensor faults, latency and perturbations take this form, so that they apply alike to the
    simulator, a bag and a live robot. A filter returns new readings and leaves its argument as it
    is.
    """

    def __call__(self, readings: SensorReadings) -> SensorReadings:
        """Return the readings that the navigator receives.

        Args:
            readings: Readings of a control period, as the source delivered them.
        """


def unfiltered(readings: SensorReadings) -> SensorReadings:
    """Return the readings unchanged; the default ``ReadingsFilter``.

    Args:
        readings: Readings of a control period.
    """
    return readings
