"""A simulated robot: placed, driven by its navigator, and not changed by what is left out."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import (
    SimulatedRobot,
    SimulatedRobotConfig,
    at_world,
    with_geo_reference,
)
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.machine.faults import Fault
from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import Twist
from andabata.machine.reality import LEVELS
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import SensingConfig
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.reactive import ReactiveController
from tests.support.situations import StubController
from worlds.rays.geometry import NO_CLASS
from worlds.world import MapDatum, Start

FLAT = SimulatedRobotConfig(
    plant="kinematic",
    sensing=SensingConfig(scanner="horizontal", proprioception=None),
    localizer="truth",
    errors=NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0),
)
GOAL = np.array([6.0, -2.0])


@pytest.fixture
def make_robot(make_scene):
    """Return a function that makes robots in a flat world; all are closed in the end."""
    made = []

    def make(config=FLAT, models=None, steering=None, **options):
        made.append(SimulatedRobot(make_scene(), config, models, steering, **options))
        return made[-1]

    yield make
    for robot in made:
        robot.close()


@pytest.mark.parametrize("name", ["natural-test", "park", "maze"])
def test_a_short_sighted_robot_drives_the_same(scenes, name):
    """Returns beyond what clouds are made of change neither clouds nor scans nor commands."""
    scene, config = scenes.get(name, 7), SimulatedRobotConfig(plant="kinematic")
    clouds, steps = [], []
    for far_sighted in (False, True):
        steering = Steering(ReactiveController(config.robot, config.grid))
        robot = SimulatedRobot(scene, config, Models(), steering, far_sighted=far_sighted)
        task, found = scene.world.tasks[0], []
        readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(3))
        robot.navigator.observers.append(found.append)
        for _ in range(120):
            readings = robot.step(readings)
        clouds.append(robot.last_cloud())
        steps.append(found)
        robot.close()
    np.testing.assert_array_equal(clouds[0].points, clouds[1].points)
    np.testing.assert_array_equal(clouds[0].classes, clouds[1].classes)
    moved = 0
    for near, far in zip(*steps, strict=True):
        assert near.wheels == far.wheels
        assert (near.situation is None) == (far.situation is None)
        if near.situation is not None:
            moved += 1
            np.testing.assert_array_equal(near.situation.scan.ranges, far.situation.scan.ranges)
    assert moved > 60


@pytest.mark.parametrize("name", ["policy+planner", "reactive"])
def test_cells_are_classified_when_a_decision_is_due_and_observers_change_nothing(scenes, name):
    """With observers the scan is made at each step; the drive is the same to the bit."""
    scene, config = scenes.get("natural-test", 7), SimulatedRobotConfig(plant="kinematic")
    drives, scans = [], []
    for watched in (False, True):
        steering = make_steering(name, None, config)
        robot = SimulatedRobot(scene, config, Models(), steering)
        seen, scan = [], robot.perception.scan
        robot.perception.scan = lambda *now, seen=seen, scan=scan: (
            seen.append(scan(*now)) or seen[-1]
        )
        steps, wheels = [], []
        if watched:
            robot.navigator.observers.append(steps.append)
        task = scene.world.tasks[0]
        readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(3))
        for _ in range(150):
            wheels.append(robot.navigator.step(readings).wheels)
            readings = robot.simulator.step(wheels[-1])
        robot.close()
        drives.append(wheels)
        scans.append(sum(found is not None for found in seen))
        assert [step.scan is not None for step in steps] == [
            found is not None for found in seen
        ] * watched
    assert drives[0] == drives[1]
    assert scans[1] > 100
    assert scans[0] == -(-scans[1] // steering.action_repeat)


def test_rays_of_limited_range_hit_what_endless_ones_hit(scenes):
    """Within the limit ranges and classes are equal; beyond it there is no hit."""
    scene, rng = scenes.get("natural-test", 7), np.random.default_rng(0)
    rays, ground = scene.rays, scene.world.ground
    for _ in range(20):
        x, y = rng.uniform(-45, 45, 2)
        z = ground.height_at(np.array([x]), np.array([y]))[0] + 0.7
        origins = np.tile(np.array([[x, y, z]], dtype=np.float32), (2000, 1))
        directions = rng.normal(size=(2000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        beams = np.concatenate([origins, directions], axis=1).astype(np.float32)
        depths = rng.standard_exponential(2000, dtype=np.float32)
        near, kinds = rays.cast(beams, depths, 9.0)
        whole, all_kinds = rays.cast(beams, depths)
        inside = whole <= 9.0
        np.testing.assert_array_equal(near[inside], whole[inside])
        np.testing.assert_array_equal(kinds[inside], all_kinds[inside])
        assert np.isinf(near[~inside]).all()
        assert (kinds[~inside] == NO_CLASS).all()


def test_a_robot_is_placed_with_its_goal_and_knows_no_border(make_robot):
    """The navigator starts at the true pose, heading for the goal; the world's end is not said."""
    controller = StubController(Twist(0.3, 0.2))
    robot = make_robot(steering=Steering(controller))
    readings = robot.place(Start(1.0, 2.0, 0.5), GOAL, np.random.default_rng(0))
    pose, stamp = robot.navigator.start
    assert stamp == readings.stamp
    np.testing.assert_allclose(pose.position[:2], [1.0, 2.0], atol=1e-6)
    assert pose.yaw == pytest.approx(0.5)
    readings = robot.step(readings)
    robot.step(readings)
    (*_, given) = controller.situations
    np.testing.assert_array_equal(given.goal, GOAL)
    assert given.geofence is None


def test_a_step_drives_the_navigators_wheel_speeds(make_robot):
    """Readings that come back are those after the commanded twist: the robot drives and turns."""
    robot = make_robot(steering=Steering(StubController(Twist(0.3, 0.3))))
    readings = robot.place(Start(0.0, 0.0, 0.0), GOAL, np.random.default_rng(0))
    first = readings.truth.pose
    for _ in range(20):
        readings = robot.step(readings)
    assert readings.stamp == pytest.approx(2.0)
    assert readings.truth.pose.position[0] > first.position[0] + 0.3
    assert readings.truth.pose.yaw > 0.3


def test_the_filter_starts_with_the_errors_that_it_expects(make_robot):
    """Starts differ from the truth by the filter's initial sigmas, alike for the same seed."""
    config = SimulatedRobotConfig(plant="kinematic")
    robot = make_robot(config, Models())
    starts = []
    for seed in (*range(60), 0):
        readings = robot.place(Start(3.0, -1.0, 0.4), GOAL, np.random.default_rng(seed))
        truth, believed = readings.truth.pose, robot.navigator.start[0]
        starts.append([*(believed.position - truth.position), believed.yaw - truth.yaw])
    assert starts[0] == starts[-1]
    sigma, found = config.filter.initial_sigma, np.std(starts[:-1], axis=0)
    sigmas = [sigma.position, sigma.position, sigma.height, sigma.yaw]
    np.testing.assert_allclose(found, sigmas, rtol=0.35)
    assert (np.abs(np.mean(starts[:-1], axis=0)) < 3.5 * np.array(sigmas) / np.sqrt(60)).all()


def test_the_last_cloud_lies_around_the_robot(make_robot):
    """There is none before the first half turn, and none at all of a horizontal scanner."""
    assert make_robot().last_cloud() is None
    robot = make_robot(SimulatedRobotConfig(plant="kinematic"), Models())
    robot.navigator._controller = StubController(Twist(0.0, 0.0))
    readings = robot.place(Start(4.0, 3.0, 0.0), GOAL, np.random.default_rng(0))
    assert robot.last_cloud() is None
    for _ in range(90):
        readings = robot.step(readings)
    cloud = robot.last_cloud()
    assert cloud.frame == "base_footprint"
    near = np.hypot(*cloud.points[:, :2].T) < 3.0
    assert np.abs(cloud.points[near, 2]).max() < 0.3
    assert np.abs(cloud.points[near, :2].mean(axis=0)).max() < 0.3


def test_the_rotating_laser_needs_classifiers(make_scene):
    """A robot without models is refused, unless its scanner is horizontal."""
    with pytest.raises(ValueError, match="models: expected classifiers"):
        SimulatedRobot(make_scene(), SimulatedRobotConfig(plant="kinematic"))


def test_fixes_lie_where_the_world_lies_on_earth(make_scene):
    """A world's datum is the drive's, with the field there; one that the user gives stays."""
    scene = make_scene()
    hobart = MapDatum(latitude_deg=-42.88, longitude_deg=147.32, altitude=120.0)
    scene = replace(scene, world=replace(scene.world, datum=hobart))
    config = FLAT.model_copy(update={"sensing": SensingConfig(scanner="horizontal")})
    robot = SimulatedRobot(scene, config)
    readings = robot.place(Start(0.0, 0.0, 0.0), GOAL, np.random.default_rng(0))
    there = robot.config.sensing.geo_reference
    assert (there.latitude_deg, there.longitude_deg, there.altitude) == (-42.88, 147.32, 120.0)
    assert there.declination_deg == pytest.approx(14.9, abs=1.0)
    while readings.gnss is None or not len(readings.gnss):
        readings = robot.simulator.step(WheelSpeeds(0.0, 0.0))
    robot.close()
    assert np.hypot(*there.to_map(readings.gnss[:1, 1:4])[0, :2]) < 20.0
    given = with_geo_reference(FLAT, GeoReference(latitude_deg=50.0, longitude_deg=8.0))
    assert at_world(given, scene.world) == given


def test_another_datum_changes_nothing_else():
    """The configuration comes back with the new datum; the given one stays as it is."""
    datum = GeoReference(latitude_deg=50.0, longitude_deg=8.0)
    changed = with_geo_reference(FLAT, datum)
    assert changed.sensing.geo_reference == datum
    assert FLAT.sensing.geo_reference != datum
    assert with_geo_reference(changed, FLAT.sensing.geo_reference) == FLAT


def test_reality_moves_no_noise_of_ideal_sensors(make_robot):
    """At another level a drive has the same start and noise; its compass errs in proportion."""
    found, compass = [], []
    for name in ("ideal", "field", "harsh"):
        reality = LEVELS[name].model_copy(update={"imu_tilt_deg": 0.0})
        config = SimulatedRobotConfig(plant="kinematic", reality=reality)
        robot = make_robot(config, Models(), Steering(StubController(Twist(0.0, 0.0))))
        readings = robot.place(Start(0.0, 0.0, 0.0), GOAL, np.random.default_rng(5))
        believed = robot.navigator.start[0]
        readings = robot.step(readings)
        found.append(np.concatenate([believed.position, believed.quaternion, *readings.imu]))
        compass.append(readings.mag[:, 1:])
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], found[2])
    weak, strong = compass[1] - compass[0], compass[2] - compass[0]
    np.testing.assert_allclose(strong, 2 * weak, rtol=1e-6)
    assert np.abs(weak).max() > 1e-7


def test_each_drive_has_a_robot_of_its_own(make_robot):
    """True constants are a function of the drive's seed."""
    config = SimulatedRobotConfig(plant="kinematic", reality=LEVELS["field"])
    robot = make_robot(config, Models(), Steering(StubController(Twist(0.3, 0.0))))
    ways = []
    for seed in (1, 2, 1):
        readings = robot.place(Start(0.0, 0.0, 0.0), GOAL, np.random.default_rng(seed))
        for _ in range(10):
            readings = robot.step(readings)
        ways.append(readings.mag.tobytes())
    assert ways[0] == ways[2]
    assert ways[0] != ways[1]


def test_faults_begin_again_with_each_drive_and_leave_the_source_alone(make_robot):
    """The navigator gets garbage, the same of one seed; the simulator's readings stay whole."""
    faults = (Fault("laser", "garbage", 0.5, 0.5, 0.5),)
    robot = make_robot(
        FLAT.model_copy(update={"faults": faults}),
        steering=Steering(StubController(Twist(0.3, 0.0))),
    )
    plain = make_robot(FLAT, steering=Steering(StubController(Twist(0.3, 0.0))))

    def drive(one, seed):
        given, received = [], []
        one.navigator.spectators[:] = [lambda result: received.append(result.readings.horizontal)]
        readings = one.place(Start(0.0, 0.0, 0.0), GOAL, np.random.default_rng(seed))
        for _ in range(12):
            given.append(readings.horizontal)
            readings = one.step(readings)
        return np.array(given), np.array(received)

    (given, first), (_, again), (_, other) = (drive(robot, seed) for seed in (3, 3, 4))
    source, passed = drive(plain, 3)
    np.testing.assert_array_equal(source, passed)
    np.testing.assert_array_equal(given, source)
    np.testing.assert_array_equal(first, again)
    same = (first == given).all(axis=1)
    assert same.tolist() == [True] * 5 + [False] * 5 + [True] * 2
    assert not np.array_equal(np.isnan(first), np.isnan(other))
