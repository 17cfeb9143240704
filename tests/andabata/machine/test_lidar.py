"""Rotating laser and horizontal scanner: geometry, times, errors."""

import numpy as np
import pytest

from andabata.machine.beams import BeamTables, place_beams
from andabata.machine.lidar import HorizontalScanner, LidarConfig, RotatingLidar
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.reality import TrueConstants
from andabata.machine.robot import RobotModel
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from terrain.classes import SemanticClass
from terrain.objects import box
from traversability.grid import PolarGrid

ROBOT = RobotModel()
EXACT = LidarConfig(noise=0.0, dropout=0.0, mixed=0.0)
HALF_TURN = 133 / 40


def moving_track(speed=0.0, rate=0.0, seconds=8.0, tilt=0.0):
    """Poses of a drive along x that turns at a rate, nose up by a tilt."""
    track = PoseTrack(2048)
    for stamp in np.arange(0.0, seconds, 0.01):
        pose = Pose.from_euler(np.array([speed * stamp, 0.0, 0.0]), 0.0, -tilt, rate * stamp)
        track.append(float(stamp), pose.position, pose.quaternion)
    return track


def assembled(scene, track, config=EXACT, seconds=7.2, stride=1):
    """Return the assembler after some seconds of sweeps."""
    lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(0))
    assembler = CloudAssembler(CloudAssemblyConfig(dense_stride=stride), ROBOT.lidar_height)
    for step in range(round(seconds * 10)):
        assembler.add(lidar.sweeps(step / 10, (step + 1) / 10, track), track)
    return assembler


def test_forty_sweeps_a_second_and_half_a_turn_in_133():
    """Head and beams have the periods of the paper."""
    assert LidarConfig().head_rate * 133 / 40 == pytest.approx(np.pi)
    assert LidarConfig().beam_period * 1080 == pytest.approx(0.75 / 40)


def test_flat_ground_is_flat_and_the_blind_cone_is_as_wide_as_the_laser_is_high(make_scene):
    """Flat ground is level, and the blind cone has 45 degrees."""
    cloud = assembled(make_scene(), moving_track()).cloud
    np.testing.assert_allclose(cloud.points[:, 2], 0.0, atol=1e-4)
    r = np.hypot(*cloud.points[:, :2].T)
    assert r.min() == pytest.approx(0.72, abs=0.01)
    bearings = np.arctan2(*cloud.points[:, 1::-1].T)
    assert np.histogram(bearings, 64, (-np.pi, np.pi))[0].min() > 0


@pytest.mark.parametrize(
    ("speed", "rate", "tilt"), [(0.3, 0.0, 0.0), (0.3, 0.5, 0.0), (0.0, -0.5, 0.15)]
)
def test_a_wall_stays_a_plane_while_the_robot_moves(make_scene, speed, rate, tilt):
    """Motion compensation keeps a wall plane."""
    wall = box(SemanticClass.WALL, (6.0, 0.0, 1.0), (0.4, 16.0, 2.0))
    cloud = assembled(make_scene(objects=[wall]), moving_track(speed, rate, tilt=tilt)).cloud
    on_wall = cloud.points[cloud.classes == SemanticClass.WALL]
    faces = np.abs(on_wall[:, 0] - 5.8) < 0.3
    assert faces.sum() > 500
    np.testing.assert_allclose(on_wall[faces & (on_wall[:, 2] < 1.9), 0], 5.8, atol=2e-3)
    ground = cloud.points[cloud.classes == SemanticClass.GROUND]
    np.testing.assert_allclose(ground[:, 2], 0.0, atol=2e-3)


def test_a_wrong_clock_bends_the_wall(make_scene):
    """The law above can fail: poses half a second late leave no plane."""
    wall = box(SemanticClass.WALL, (6.0, 0.0, 1.0), (0.4, 16.0, 2.0))
    scene, track = make_scene(objects=[wall]), moving_track(0.3, 0.5)
    late = PoseTrack(2048)
    for stamp in np.arange(0.0, 8.0, 0.01):
        row = track.at(np.array([stamp - 0.5]))[0]
        late.append(float(stamp), row[:3], row[3:])
    lidar = RotatingLidar(scene.rays, EXACT, ROBOT, np.random.default_rng(0))
    assembler = CloudAssembler(CloudAssemblyConfig(), ROBOT.lidar_height)
    for step in range(72):
        assembler.add(lidar.sweeps(step / 10, (step + 1) / 10, track), late)
    on_wall = assembler.cloud.points[assembler.cloud.classes == SemanticClass.WALL]
    assert np.abs(on_wall[:, 0] - 5.8).max() > 0.3


def test_what_the_head_has_passed_is_settled_before_the_turn_ends_and_only_once(make_scene):
    """A post is settled half a second after the laser has passed it, in each half turn once."""
    post = box(SemanticClass.POST, (1.0, 4.0, 0.8), (0.2, 0.2, 1.6))
    lidar = RotatingLidar(make_scene(objects=[post]).rays, EXACT, ROBOT, np.random.default_rng(0))
    assembler, track = CloudAssembler(CloudAssemblyConfig(), ROBOT.lidar_height), moving_track()
    passed, reported, spans, before = [], [], [], -np.inf
    for step in range(72):
        now = (step + 1) / 10
        assembler.add(lidar.sweeps(step / 10, now, track), track)
        recent = assembler.window
        if recent.parts and (recent.parts[-1].cloud.classes == SemanticClass.POST).any():
            passed.append(now)
        if step % 5 == 4 and recent.settled > before:
            swath = recent.since(before)
            ages, (newest, oldest) = swath.newest - swath.stamps, swath.due
            on_post = (np.abs(swath.points - [1.0, 4.0, 0.9]) < [0.2, 0.2, 0.8]).all(axis=1)
            due = (ages >= newest) & (ages < oldest)
            reported += [now] * bool((due & on_post).any())
            spans.append(int(due.sum()))
            before = recent.settled
    ends = [a for a, b in zip(passed, [*passed[1:], np.inf], strict=True) if b - a > 1.0]
    assert len(ends) == 2
    assert len(reported) in (2, 3, 4)  # A post that is just being passed comes in two parts.
    for end in ends:
        assert any(0.4 < stamp - end < 1.2 for stamp in reported)
    whole = len(assembler.window.points)
    assert sum(spans) < 7.2 / HALF_TURN * whole
    assert sum(spans) > 6.0 / HALF_TURN * whole


def test_the_cloud_travels_with_the_robot(make_scene):
    """The relative cloud is in the frame of the robot."""
    post = box(SemanticClass.POST, (4.0, 1.0, 0.8), (0.2, 0.2, 1.6))
    assembler = assembled(make_scene(objects=[post]), moving_track())
    pose = Pose.from_euler(np.array([1.0, 1.0, 0.1]), 0.0, 0.0, np.pi / 2)
    cloud = assembler.relative(pose)
    seen = cloud.points[cloud.classes == SemanticClass.POST].mean(axis=0)
    np.testing.assert_allclose(seen[:2], [0.0, -3.0], atol=0.15)
    assert cloud.frame == "base_footprint"


def test_a_cloud_has_about_as_many_points_as_the_papers_when_near_beams_are_thinned(scenes):
    """Thinning leaves out two near beams in three and no far one."""
    scene = scenes.get("natural", 3)
    ground = scene.world.ground
    start = scene.world.tasks[0].start
    height = float(ground.height_at(start.x, start.y))
    track = PoseTrack(2048)
    for stamp in np.arange(0.0, 4.0, 0.01):
        track.append(float(stamp), np.array([start.x, start.y, height]), np.array([0, 0, 0, 1.0]))
    whole, thinned = (
        assembled(scene, track, LidarConfig(), 3.5, stride).cloud.points for stride in (1, 3)
    )
    assert 20_000 < len(thinned) < 45_000
    # What is left out is two near beams in three.
    eye = np.array([start.x, start.y, height + ROBOT.lidar_height])
    near, few = (np.linalg.norm(points - eye, axis=1) < 2.4 for points in (whole, thinned))
    assert near.sum() == pytest.approx(3 * few.sum(), rel=0.01)
    far, same = (np.linalg.norm(points - eye, axis=1) > 2.6 for points in (whole, thinned))
    np.testing.assert_array_equal(whole[far], thinned[same])


def test_noise_is_three_centimetres_and_some_returns_are_lost(make_scene):
    """Noise and dropouts have the configured numbers."""
    wall = box(SemanticClass.WALL, (4.0, 0.0, 2.0), (0.4, 16.0, 4.0))
    scene = make_scene(objects=[wall])
    track = moving_track()
    readings = []
    for config in (EXACT, LidarConfig(mixed=0.0)):
        lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(1))
        readings.append(lidar.sweeps(0.0, 3.3, track).ranges)
    both = np.isfinite(readings[0]) & np.isfinite(readings[1])
    assert (readings[1][both] - readings[0][both]).std() == pytest.approx(0.03, rel=0.05)
    lost = np.isfinite(readings[0]) & ~np.isfinite(readings[1])
    assert lost.sum() / np.isfinite(readings[0]).sum() == pytest.approx(0.005, rel=0.3)
    assert np.isinf(readings[1][~np.isfinite(readings[0])]).all()  # No-return stays no-return.


def test_edges_give_mixed_pixels(make_scene):
    """Mixed pixels lie between an edge and what is behind it."""
    post = box(SemanticClass.POST, (3.0, 0.0, 1.0), (0.3, 0.3, 2.0))
    scene = make_scene(objects=[post])
    config = LidarConfig(noise=0.0, dropout=0.0, mixed=1.0)
    lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(1))
    exact = RotatingLidar(scene.rays, EXACT, ROBOT, np.random.default_rng(1))
    track = moving_track()
    mixed, true = (source.sweeps(0.0, 3.3, track).ranges for source in (lidar, exact))
    changed = np.isfinite(true) & (mixed != true)
    assert 0 < changed.sum() < 0.02 * true.size
    assert (mixed[changed] <= true[changed]).all()  # Between the edge and what lies behind.


def test_the_same_rng_gives_the_same_sweeps(make_scene):
    """Sweeps are a function of the seed."""
    scene, track = make_scene(), moving_track(0.3, 0.2)
    first, second = (
        RotatingLidar(scene.rays, LidarConfig(), ROBOT, np.random.default_rng(5)).sweeps(
            0.0, 1.0, track
        )
        for _ in range(2)
    )
    np.testing.assert_array_equal(first.ranges, second.ranges)


def test_the_horizontal_scanner_sees_a_wall_at_its_bearing(make_scene):
    """Ranges of the horizontal scanner are those of a wall ahead."""
    wall = box(SemanticClass.WALL, (0.0, 4.0, 1.0), (20.0, 0.4, 2.0))
    scanner = HorizontalScanner(
        make_scene(objects=[wall]).rays, PolarGrid(), ROBOT, np.random.default_rng(0)
    )
    ranges = scanner.ranges(Pose.from_euler(np.zeros(3), 0.0, 0.0, np.pi / 2))
    ahead = np.abs(PolarGrid().bearings) < 0.2
    expected = 3.8 / np.cos(PolarGrid().bearings[ahead])
    np.testing.assert_allclose(ranges[ahead], expected, rtol=1e-4)
    assert np.isinf(ranges[np.abs(PolarGrid().bearings) > 1.6]).all()


def spinning(scene, **fields):
    """Return the cloud of one turn of a level laser of 16 beams at rest, with classes."""
    config = LidarConfig(
        span_deg=(-15.0, 15.0), beams=16, sweep_hz=18000.0, head_rate=20 * np.pi,
        noise=0.0, dropout=0.0, mixed=1.0, **fields,
    )  # fmt: skip
    lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(0))
    sweeps = lidar.sweeps(0.0, 0.1, moving_track())
    points, _ = place_beams(sweeps, moving_track(), ROBOT.lidar_height, BeamTables())
    return points, sweeps.classes.ravel()[np.isfinite(sweeps.ranges.ravel())]


def test_rows_of_beams_that_lie_degrees_apart_do_not_mix(make_scene):
    """Rows of a multi-beam laser are no neighbours."""
    points, _ = spinning(make_scene(size=40.0))
    near = np.hypot(points[:, 0], points[:, 1]) < 15
    np.testing.assert_allclose(points[near, 2], 0.0, atol=1e-3)


def test_columns_of_a_spinning_laser_mix_at_the_side_of_a_wall(make_scene):
    """Columns of a multi-beam laser are neighbours."""
    wall = box(SemanticClass.WALL, (4.0, 0.0, 1.0), (0.4, 2.0, 2.0))
    points, classes = spinning(make_scene(objects=[wall], size=40.0))
    ground = points[classes == SemanticClass.GROUND]
    floating = ground[ground[:, 2] > 0.02]
    assert len(floating) > 0
    beside = np.abs(np.abs(np.arctan2(floating[:, 1], floating[:, 0])) - np.arctan(1 / 3.8))
    assert beside.max() < 0.02


def test_a_rosette_has_no_neighbours():
    """Neighbours are one beam, one column or none apart."""
    assert LidarConfig(span_deg=(-52.0, 7.0), beams=100, weave=0.0137).neighbour_stride == 0
    assert LidarConfig().neighbour_stride == 1
    assert LidarConfig(span_deg=(-15.0, 15.0), beams=16).neighbour_stride == 16


def test_a_reach_changes_no_return_within_it(make_scene):
    """Returns within the reach are the same, bit for bit, mixed pixels included."""
    post = box(SemanticClass.POST, (3.0, 0.0, 1.0), (0.3, 0.3, 2.0))
    wall = box(SemanticClass.WALL, (8.0, 0.0, 1.0), (0.4, 16.0, 2.0))
    scene, track = make_scene(objects=[post, wall]), moving_track()
    config = LidarConfig(mixed=1.0)
    whole, short = (
        RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(1), reach)
        .sweeps(0.0, 3.3, track)
        .ranges
        for reach in (np.inf, 5.0)
    )
    near = whole < 4.8
    np.testing.assert_array_equal(whole[near], short[near])
    assert np.isinf(short).sum() > np.isinf(whole).sum()


def test_ranges_outside_of_the_limits_are_no_returns(make_scene):
    """Returns nearer than the least or farther than the largest range are lost."""
    scene, track = make_scene(), moving_track()
    config = LidarConfig(noise=0.0, dropout=0.0, mixed=0.0, min_range=1.0, max_range=3.0)
    lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(0))
    ranges = lidar.sweeps(0.0, 1.0, track).ranges
    found = ranges[np.isfinite(ranges)]
    assert (found.min() >= 1.0) & (found.max() <= 3.0)
    assert len(found) > 100


def test_sweeps_of_adjacent_spans_follow_each_other(make_scene):
    """Spans that share a border share no sweep: stamps go on by the sweep period."""
    track = moving_track()
    lidar = RotatingLidar(make_scene().rays, EXACT, ROBOT, np.random.default_rng(0))
    stamps = [lidar.sweeps(k / 10, (k + 1) / 10, track).stamps for k in range(5)]
    np.testing.assert_allclose(np.concatenate(stamps), np.arange(20) / 40)


def swept(scene, constants=None, track=None, config=EXACT, span=(0.0, 1.0)):
    """Return the sweeps of a second by a laser with some true constants."""
    lidar = RotatingLidar(scene.rays, config, ROBOT, np.random.default_rng(0))
    if constants is not None:
        lidar.reset(constants)
    return lidar.sweeps(*span, track or moving_track())


def test_a_bias_is_common_to_a_sweep_and_independent_from_sweep_to_sweep(make_scene):
    """Ranges of a sweep are wrong alike; sweeps have the configured spread."""
    scene = make_scene()
    true, found = swept(scene), swept(scene, TrueConstants(range_bias=0.02))
    hit = np.isfinite(true.ranges)
    errors = np.full(hit.shape, np.nan)
    errors[hit] = found.ranges[hit] - true.ranges[hit]
    assert np.nanstd(errors, axis=1).max() < 1e-5
    biases = np.nanmean(errors, axis=1)
    assert np.std(biases) == pytest.approx(0.02, rel=0.35)
    assert abs(np.corrcoef(biases[:-1], biases[1:])[0, 1]) < 0.4
    np.testing.assert_array_equal(np.isfinite(found.ranges), hit)


def test_ranges_are_off_by_their_scale(make_scene):
    """A laser that measures 1 % too much does so at every range."""
    scene = make_scene()
    true, found = swept(scene), swept(scene, TrueConstants(range_scale=0.01))
    hit = np.isfinite(true.ranges)
    np.testing.assert_allclose(found.ranges[hit], 1.01 * true.ranges[hit], rtol=1e-6)


def test_white_noise_of_ranges_adds_in_squares(make_scene):
    """3 cm of the laser's own and 4 cm more are 5 cm."""
    scene, own = make_scene(), EXACT.model_copy(update={"noise": 0.03})
    true, found = swept(scene), swept(scene, TrueConstants(range_noise=0.04), config=own)
    hit = np.isfinite(true.ranges) & np.isfinite(found.ranges)
    assert (found.ranges[hit] - true.ranges[hit]).std() == pytest.approx(0.05, rel=0.03)


def test_late_stamps_are_those_of_earlier_beams(make_scene):
    """A laser 20 ms late sees from where the robot was 20 ms before; stamps are as ever."""
    wall = box(SemanticClass.WALL, (6.0, 0.0, 1.0), (0.4, 16.0, 2.0))
    scene, track = make_scene(objects=[wall]), moving_track(speed=1.0)
    true, late = swept(scene, track=track), swept(scene, TrueConstants(laser_clock=0.02), track)
    np.testing.assert_array_equal(true.stamps, late.stamps)
    np.testing.assert_array_equal(true.head_angles, late.head_angles)
    # The first sweeps of a head that begins forward: level beams meet the wall ahead.
    level = [int(np.abs(true.elevations - np.pi / 2).argmin())]
    on_wall = true.classes[2:8, level] == SemanticClass.WALL
    assert on_wall.any()
    gain = late.ranges[2:8, level][on_wall] - true.ranges[2:8, level][on_wall]
    np.testing.assert_allclose(gain, 0.02, rtol=0.05)


def test_a_laser_mounted_higher_sees_the_ground_further_away(make_scene):
    """Ranges to flat ground grow in the ratio of the heights."""
    scene = make_scene()
    true, high = swept(scene), swept(scene, TrueConstants(laser_height=0.072))
    near = np.isfinite(true.ranges) & (true.ranges < 3.0)
    np.testing.assert_allclose(high.ranges[near], 1.1 * true.ranges[near], rtol=1e-4)


def test_a_reset_without_differences_is_the_laser_as_built(make_scene):
    """Constants of one drive do not stay for the next."""
    scene = make_scene()
    lidar = RotatingLidar(scene.rays, LidarConfig(), ROBOT, np.random.default_rng(3))
    lidar.reset(TrueConstants(range_bias=0.1, range_scale=0.01, laser_height=0.1, laser_clock=0.1))
    lidar.reset(TrueConstants(seed=4))
    other = RotatingLidar(scene.rays, LidarConfig(), ROBOT, np.random.default_rng(3))
    track = moving_track(0.3, 0.2)
    np.testing.assert_array_equal(
        lidar.sweeps(0.5, 1.0, track).ranges, other.sweeps(0.5, 1.0, track).ranges
    )


def test_rows_are_the_elevations_of_a_multibeam_laser():
    """A plane and a rosette have none."""
    assert LidarConfig(span_deg=(-15.0, 15.0), beams=11).rows_deg == tuple(range(-15, 16, 3))
    table = tuple(float(k) for k in range(-20, 2, 2))
    assert LidarConfig(elevations_deg=table, beams=11).rows_deg == table
    assert LidarConfig().rows_deg == ()
    assert LidarConfig(span_deg=(-52.0, 7.0), beams=100, weave=0.0137).rows_deg == ()
