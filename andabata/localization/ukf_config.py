"""Configuration of the robot's filter."""

from typing import NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from andabata.localization.filter_parameters import Gates, NoiseModel
from andabata.localization.fix_repetition import RepetitionConfig
from andabata.localization.receiver_error import ReceiverConfig
from andabata.localization.sense_watch import PlausibilityConfig
from andabata.localization.wheel_scale import WheelScaleConfig
from andabata.machine.clock import CONTROL_PERIOD


class InitialSigma(NamedTuple):
    """Standard deviations of the state at the start.

    Attributes:
        tilt: Roll and pitch [rad].
        yaw: Heading [rad].
        gyro_bias: Each axis of the gyro's bias [rad/s].
        position: Each horizontal coordinate [m].
        height: Height [m].
        speed: Forward speed [m/s].
        hard_iron: Each axis of the robot's own magnetic field [uT].
        accel_bias: Each axis of the accelerometer's bias [m/s2].
        wheel_scale: Share by which the wheels read too fast.
        slope_slip: That share per sine of a climb.
    """

    tilt: float = 0.02
    yaw: float = 0.05
    gyro_bias: float = 0.006
    position: float = 0.5
    height: float = 0.1
    speed: float = 0.05
    hard_iron: float = 3.0
    accel_bias: float = 0.03
    wheel_scale: float = 0.01
    slope_slip: float = 0.08


class UkfConfig(BaseModel):
    """Parameters of the filter: initial uncertainty, noise, gates, time limits and supervision.

    Attributes:
        initial_sigma: Standard deviations at a start from a given pose.
        rough_initial_sigma: Standard deviations at a start from the first fix, the compass and
            gravity.
        noise: Process and measurement noise.
        gates: Largest normalised innovations squared that are accepted.
        receiver: Assumptions about the satellite receiver.
        plausibility: Limits beyond which inertial unit, encoders and compass are not believed.
        repetition: Limits beyond which a receiver that repeats its last fix is not believed.
        wheel_scale: Limits beyond which the fixes contradict the wheels.
        fix_sigma: Standard deviation of a fix without a covariance [m].
        vertical_ratio: Ratio of vertical to horizontal noise of a fix.
        max_delay: Largest delay of a fix that is still taken into account [s].
        max_lead: Largest time by which a measurement may be ahead of the inertial rows [s].
        imu_timeout: Time without inertial rows after which the wheels replace the gyro [s].
        wheel_timeout: Time without an accepted encoder row after which there is a warning [s].
        compass_timeout: Time without an accepted compass reading after which there is a warning
            [s].
        gnss_timeout: Time without an accepted fix after which there is a warning [s], although
            others arrive; and time without any, until the receiver's period is known.
        gnss_periods: Number of the receiver's own periods, the usual time from fix to fix, of
            silence after which there is a warning, at the least a second: one lost message is none.
        no_fix_periods: Number of its periods for a receiver that sends, and reports that it has no
            fix: near trees several in a row are usual.
        inflation_time: Time of rejected measurements of a sensor after which the covariance is
            inflated [s].
        multipath_inflation_time: Time of rejected fixes after which the covariance is inflated if
            all are off by the same, as by multipath and not by spinning wheels [s].
        jump_inflation_time: Time of rejected fixes after which the covariance is inflated if they
            are farther off than the robot can have driven: whoever carried it has put it down [s].
        jump_offset: Distance of a rejected fix, beyond what the robot can have driven since the
            last accepted one, from which there is a warning at once [m].
        multipath_spread: Largest change of the offsets of such fixes [m].
        multipath_offset: Largest offset of such fixes [m].
        lost_position: Standard deviation of the position from which the robot is lost [m].
        lost_yaw: Standard deviation of the heading from which the robot is disoriented [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    initial_sigma: InitialSigma = InitialSigma()
    rough_initial_sigma: InitialSigma = InitialSigma(
        tilt=0.05, yaw=0.1, position=1.5, height=3.0, speed=0.3
    )
    noise: NoiseModel = NoiseModel()
    gates: Gates = Gates()
    receiver: ReceiverConfig = Field(default_factory=ReceiverConfig)
    plausibility: PlausibilityConfig = PlausibilityConfig()
    repetition: RepetitionConfig = Field(default_factory=RepetitionConfig)
    wheel_scale: WheelScaleConfig = Field(default_factory=WheelScaleConfig)
    fix_sigma: float = Field(default=3.0, gt=0, le=100)
    vertical_ratio: float = Field(default=2.0, gt=0)
    max_delay: float = Field(default=2.0, gt=0, le=30)
    max_lead: float = Field(default=0.5, gt=0, le=5)
    imu_timeout: float = Field(default=CONTROL_PERIOD, gt=0)
    wheel_timeout: float = Field(default=0.2, gt=0)
    compass_timeout: float = Field(default=1.0, gt=0)
    gnss_timeout: float = Field(default=6.0, gt=0)
    gnss_periods: float = Field(default=2.3, ge=1)
    no_fix_periods: float = Field(default=4.3, ge=1)
    inflation_time: float = Field(default=15.0, gt=0)
    multipath_inflation_time: float = Field(default=45.0, gt=0)
    jump_inflation_time: float = Field(default=300.0, gt=0)
    jump_offset: float = Field(default=16.0, gt=0)
    multipath_spread: float = Field(default=2.5, gt=0)
    multipath_offset: float = Field(default=15.0, gt=0)
    lost_position: float = Field(default=3.0, gt=0)
    lost_yaw: float = Field(default=0.35, gt=0)
