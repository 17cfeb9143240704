"""Parameters of the filter: body and magnetic field, noise, gates, weights of the points."""

from typing import NamedTuple

from andabata.localization.ukf import SigmaWeights


class NoiseModel(NamedTuple):
    """Process and measurement noise, as standard deviations.

    Attributes:
        gyro: Process: noise density of the gyro [rad/sqrt(s)].
        gyro_bias_walk: Process: random walk of the gyro's bias [rad/s/sqrt(s)].
        position_walk: Process: horizontal error of dead reckoning [m/sqrt(s)].
        height_walk: Process: vertical error of dead reckoning [m/sqrt(s)].
        speed_walk: Process: random walk of the forward speed [m/s/sqrt(s)].
        lateral_speed: Process: stationary standard deviation of the lateral speed [m/s].
        lateral_speed_time: Process: correlation time of the lateral speed [s].
        hard_iron_walk: Process: random walk of the hard iron [uT/sqrt(s)].
        compass_error: Process: stationary standard deviation of the error of the compass heading
            that is neither white nor hard iron: soft iron and the motors' currents [rad].
        compass_error_time: Process: correlation time of that error [s].
        gnss_error: Process: stationary standard deviation of the slow satellite error at the start
            [m]; then what ``ReceiverError`` makes of the fixes.
        gnss_error_time: Process: correlation time of that error [s].
        accel_bias_walk: Process: random walk of the accelerometer's bias [m/s2/sqrt(s)].
        wheel_scale_walk: Process: random walk of the wheels' scale [1/sqrt(s)].
        slope_slip_walk: Process: random walk of the slip on slopes [1/sqrt(s)].
        wheel_speed: Measurement: forward speed by encoders [m/s].
        vibration: Measurement: acceleration other than gravity, horizontal; vertical is twice that
            [m/s2].
        mag: Measurement: white noise of an axis of the magnetometer [uT].
        zero_rate: Measurement: gyro reading at rest [rad/s].
    """

    gyro: float = 2e-4
    gyro_bias_walk: float = 2e-5
    position_walk: float = 0.01
    height_walk: float = 0.03
    speed_walk: float = 0.5
    lateral_speed: float = 0.012
    lateral_speed_time: float = 5.0
    hard_iron_walk: float = 0.001
    compass_error: float = 0.06
    compass_error_time: float = 30.0
    gnss_error: float = 0.635
    gnss_error_time: float = 300.0
    accel_bias_walk: float = 0.003
    wheel_scale_walk: float = 1e-4
    slope_slip_walk: float = 1e-3
    wheel_speed: float = 0.05
    vibration: float = 0.75
    mag: float = 0.4
    zero_rate: float = 0.01


class BodyParameters(NamedTuple):
    """Parameters of the robot, and the magnetic field of the place.

    Attributes:
        wheel_radius: ``RobotModel.wheel_radius`` [m].
        creep: ``RobotModel.creep`` [m].
        creep_slope: ``RobotModel.creep_slope``.
        pivot: ``RobotModel.pivot`` [m].
        flux_east: Magnetic flux density to the east [uT].
        flux_north: Magnetic flux density to the north [uT].
        flux_up: Magnetic flux density upwards [uT].
        heading_only: True if the field is known only roughly. Magnetometer and fixes then correct
            heading, position and their own errors; tilt, speeds and biases depend on gravity, gyro
            and wheels alone, wherever on Earth the robot is.
        max_step: Longest step of a prediction [s]; longer gaps are rejected.
    """

    wheel_radius: float
    creep: float
    creep_slope: float
    pivot: float
    flux_east: float
    flux_north: float
    flux_up: float
    heading_only: bool = False
    max_step: float = 2.0


class Gates(NamedTuple):
    """Largest normalised innovations squared (NIS) that are accepted.

    Quantiles of the chi-square distribution at 0.999 with one and three degrees of freedom; for
    fixes, whose multipath is no noise, at 0.99 with three.

    Attributes:
        wheels: Gate of the forward speed by encoders.
        heading: Gate of the compass heading.
        vector: Gate of gravity and gyro at rest.
        gnss: Gate of satellite fixes.
        field: Largest difference of the levelled field's horizontal and vertical part from those
            of the place [uT]: more is no field of the Earth's and the robot's.
    """

    wheels: float = 10.83
    heading: float = 10.83
    vector: float = 16.27
    gnss: float = 11.34
    field: float = 15.0


class FilterModel(NamedTuple):
    """All parameters of the filter.

    Attributes:
        body: Parameters of the robot, and the magnetic field.
        noise: Process and measurement noise.
        gates: Limits of the NIS.
        weights: Weights of the sigma points.
        max_lead: ``UkfConfig.max_lead`` [s].
    """

    body: BodyParameters
    noise: NoiseModel
    gates: Gates
    weights: SigmaWeights
    max_lead: float
