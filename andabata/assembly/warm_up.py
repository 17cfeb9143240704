"""Compilation ahead of the first drive: parts of a robot meet readings that nobody measured.

numba compiles a kernel at its first call, which takes seconds, and a minute or two for all that a
drive needs. A robot on the move does not have them, and a first drive should not wait.
"""

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.navigator import make_navigator
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import Pose
from andabata.machine.proprioception import GRAVITY, MICROTESLA
from andabata.machine.sensor_readings import SensorReadings, Sweeps, VehicleState, WheelSpeeds
from andabata.machine.simulator import Simulator
from andabata.models import Models
from andabata.navigation.navigator import Navigator
from traversability.cloud import PointCloud
from worlds.scenes import SceneCache
from worlds.splits import DEVELOPMENT_SEED, evaluation_world

_WORLD, _CONTROLLER = "hill", "policy+planner"

_AT_REST = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))


def warm_up(navigator: Navigator, config: SimulatedRobotConfig) -> None:
    """Send one control period of artificial readings through a navigator.

    Args:
        navigator: Navigator; it is reset and has to be reset again before its use.
        config: Configuration of the robot.
    """
    navigator.reset(_AT_REST, 0.0)
    navigator.step(_artificial_readings(config))


def warm_up_simulation() -> None:
    """Simulate the default robot for one control period: rays, plant and senses."""
    config = SimulatedRobotConfig()
    scene = SceneCache(1).get(_WORLD, evaluation_world(DEVELOPMENT_SEED, 0))
    rng = np.random.default_rng(0)
    reach = config.assembly.sight
    simulator = Simulator(
        scene.world, scene.rays, config.robot, config.plant, config.sensing, rng, reach
    )
    simulator.reset(scene.world.tasks[0].start)
    simulator.step(WheelSpeeds(1.0, 1.0))
    simulator.close()


def warm_up_localization() -> None:
    """Let the filter of the default robot process one control period."""
    config = SimulatedRobotConfig()
    localizer = UkfLocalizer(config.filter, config.robot, config.sensing.geo_reference)
    localizer.reset(_AT_REST, 0.0)
    localizer.update(_artificial_readings(config))


def warm_up_steering() -> None:
    """Let the default robot perceive, plan and steer once, at a pose that is given to it."""
    config = SimulatedRobotConfig(localizer="truth")
    models = Models()
    steering = make_steering(_CONTROLLER, None, config, models)
    rng = np.random.default_rng(0)
    navigator = make_navigator(config, models, steering, rng).navigator
    navigator.set_goal(np.array([10.0, 0.0]))
    warm_up(navigator, config)


def _artificial_readings(config: SimulatedRobotConfig) -> SensorReadings:
    """Return a tenth of a second of readings of a robot at rest, of every sensor."""
    stamps = np.arange(1, 11) / 100
    imu = np.column_stack([stamps, np.zeros((10, 5)), np.full(10, GRAVITY)])
    wheels = np.column_stack([stamps, np.zeros((10, 2))])
    flux = config.sensing.geo_reference.flux * MICROTESLA
    mag = np.column_stack([stamps, np.tile(flux, (10, 1))])
    lidar = config.sensing.lidar
    beams = lidar.elevations(0, 1)
    ranges = np.ones((1, beams.shape[-1]), dtype=np.float32)
    sweep = Sweeps(stamps[:1], np.zeros(1), lidar.head_rate, lidar.beam_period, beams, ranges)
    frame = PointCloud(np.ones((10, 3), dtype=np.float32), "sensor", stamps)
    truth = VehicleState(0.1, _AT_REST, np.zeros(3), np.zeros(3), WheelSpeeds(0.0, 0.0))
    track = np.column_stack([stamps, np.zeros((10, 6)), np.ones(10)])
    return SensorReadings(
        0.1,
        sweep,
        (frame,),
        imu=imu,
        encoders=wheels,
        mag=mag,
        truth=truth,
        true_track=track,
    )
