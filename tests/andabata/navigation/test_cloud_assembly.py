"""Cloud assembly: a complete cloud after each turn of the head, and the swath of the last one."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import Sweeps
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig, assembled_turn
from tests.support.situations import pose_at
from traversability.cloud import PointCloud

HEIGHT = 0.7
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
AHEAD = np.pi / 2
"""Elevation of a level beam, from the zenith [rad]."""


def standing(until=60.0):
    """Return the track of a robot that stands at the origin."""
    track = PoseTrack()
    track.append(0.0, np.zeros(3), LEVEL)
    track.append(until, np.zeros(3), LEVEL)
    return track


def sweeps(angles, stamps=None, ranges=5.0, elevations=(AHEAD,), classes=None):
    """Return sweeps at head angles [rad], a second apart by default."""
    angles = np.atleast_1d(np.asarray(angles, dtype=np.float64))
    stamps = angles if stamps is None else np.atleast_1d(np.asarray(stamps, dtype=np.float64))
    shape = (len(angles), len(elevations))
    return Sweeps(
        stamps,
        angles,
        0.0,
        0.0,
        np.float32(elevations),
        np.broadcast_to(np.float32(ranges), shape).copy(),
        None if classes is None else np.full(shape, classes, dtype=np.uint8),
    )


def assembler(**settings):
    """Return an assembler with some settings of its own."""
    return CloudAssembler(CloudAssemblyConfig(**settings), HEIGHT)


def turned(angles, **settings):
    """Return an assembler that was given one sweep after the other."""
    made, track = assembler(**settings), standing()
    for angle in angles:
        made.add(sweeps(angle), track)
    return made


def check_bearings(cloud, expected):
    """Check that a cloud's points lie 5 m away at some bearings [rad]."""
    places = 5.0 * np.stack([np.cos(expected), np.sin(expected)], axis=1)
    np.testing.assert_allclose(cloud.points[:, :2], places, atol=1e-5)


@pytest.mark.parametrize("turn", [np.pi, 2 * np.pi])
def test_a_cloud_is_complete_after_a_turn_and_replaced_after_the_next(turn):
    """It holds the sweeps from the turn's begin up to, but not including, its end."""
    angles = np.arange(0.0, 2.05 * turn, turn / 8)
    made, track, sizes = assembler(turn=turn), standing(), []
    for angle in angles:
        made.add(sweeps(angle), track)
        sizes.append(0 if made.cloud is None else len(made.cloud))
    assert sizes == [0] * 8 + [8] * (len(angles) - 8)
    check_bearings(made.cloud, turn + angles[:8])
    assert made.cloud.frame == "odom"


def test_sweeps_of_several_turns_may_come_at_once():
    """One call with three half turns gives the same cloud as one call a sweep."""
    angles = np.arange(0.0, 3.2 * np.pi, np.pi / 8)
    made = assembler()
    made.add(sweeps(angles), standing())
    single = turned(angles)
    np.testing.assert_array_equal(made.cloud.points, single.cloud.points)
    np.testing.assert_array_equal(made.cloud.stamps, single.cloud.stamps)


@pytest.mark.parametrize(("begin", "is_whole"), [(0.04, True), (0.06, False)])
def test_a_turn_that_began_in_its_middle_makes_no_cloud(begin, is_whole):
    """The first cloud is that of the first turn which was seen from its begin."""
    made = turned([begin, 1.0, np.pi + 0.01])
    assert (made.cloud is not None) == is_whole
    for angle in (4.0, 2 * np.pi + 0.01):
        made.add(sweeps(angle), standing())
    check_bearings(made.cloud, np.array([np.pi + 0.01, 4.0]))


def test_points_lie_where_the_beams_ended_with_their_stamps_and_classes():
    """A level beam of 5 m at a head angle of 90 degrees ends 5 m to the left, at lidar height."""
    made, track = assembler(), standing()
    made.add(sweeps([0.0, np.pi / 2], classes=3), track)
    made.add(sweeps(np.pi, classes=3), track)
    expected = [[5.0, 0.0, HEIGHT], [0.0, 5.0, HEIGHT]]
    np.testing.assert_allclose(made.cloud.points, expected, atol=1e-5)
    np.testing.assert_allclose(made.cloud.stamps, [0.0, np.pi / 2])
    np.testing.assert_array_equal(made.cloud.classes, [3, 3])


def kept(ranges, elevations, **settings):
    """Return the ranges of one sweep that a cloud keeps."""
    made, track = assembler(**settings), standing()
    made.add(sweeps(0.0, ranges=ranges, elevations=elevations), track)
    made.add(sweeps(np.pi, elevations=elevations), track)
    return np.linalg.norm(made.cloud.points - [0, 0, HEIGHT], axis=1)


def test_returns_beyond_the_range_and_on_the_body_are_dropped():
    """The body is a cylinder about the vertical axis: steep beams measure it from farther."""
    level = kept([[0.39, 0.41, 11.4, 11.6, np.inf]], (AHEAD,) * 5)
    np.testing.assert_allclose(level, [0.41, 11.4], rtol=1e-5)
    steep = np.arcsin(0.5)
    sloping = kept([[0.79, 0.81]], (np.pi - steep,) * 2)
    np.testing.assert_allclose(sloping, [0.81], rtol=1e-5)
    backwards = kept([[0.81]], (steep - np.pi,))
    np.testing.assert_allclose(backwards, [0.81], rtol=1e-5)


@pytest.mark.parametrize(
    ("blind", "hidden"),
    [
        ([], []),
        ([(60.0, 150.0)], [2, 3]),
        ([(150.0, 210.0), (-50.0, -40.0)], [4, 7]),
        ([(90.0, 270.0)], [2, 3, 4, 5, 6]),
        ([(-180.0, 180.0)], range(8)),
    ],
)
def test_what_a_mast_hides_is_dropped(blind, hidden):
    """Bearings from one to the other are lost, of both halves of the plane and of 3D frames."""
    angles = np.radians(np.arange(8) * 45.0)
    expected = np.delete(angles, list(hidden))
    behind = sweeps(angles - np.pi, np.ones(8), elevations=(-AHEAD,))
    made, track = assembler(turn=100.0, blind_deg=blind), standing()
    made.add(sweeps(angles, np.zeros(8)), track)
    made.add(behind, track)
    points = made.window.points
    np.testing.assert_allclose(
        points[:, :2],
        5.0 * np.tile(np.stack([np.cos(expected), np.sin(expected)], 1), (2, 1)),
        atol=1e-5,
    )
    places = 5.0 * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    made = assembler(blind_deg=blind)
    made.add_frame(frame(1.0, np.float32(places)), track)
    assert (0 if made.cloud is None else len(made.cloud)) == len(expected)


def test_blind_bearings_are_finite():
    """NaN and infinity are no bearings."""
    for bad in (np.nan, np.inf):
        with pytest.raises(ValidationError):
            CloudAssemblyConfig(blind_deg=((0.0, bad),))


def test_dense_returns_are_thinned():
    """Below the dense range each third beam is kept, beyond it every one."""
    near = [1.0, 1.1, 1.2, 1.3, 1.4, 1.5]
    ranges = [[*near, 2.6, 2.7]]
    found = kept(ranges, (AHEAD,) * 8, dense_stride=3)
    np.testing.assert_allclose(found, [1.0, 1.3, 2.6, 2.7], rtol=1e-5)
    np.testing.assert_allclose(kept(ranges, (AHEAD,) * 8), ranges[0], rtol=1e-5)


def test_sweeps_without_poses_are_refused_and_counted():
    """Beams more than a second before the first pose or after the last cannot be placed."""
    made, track = assembler(), PoseTrack()
    for stamp in (10.0, 20.0):
        track.append(stamp, np.zeros(3), LEVEL)
    for k, stamp in enumerate((8.9, 9.1, 20.9, 21.1)):
        made.add(sweeps(0.5 * k, stamps=stamp), track)
    assert made.refused == 2
    made.add(sweeps(np.pi, stamps=15.0), track)
    np.testing.assert_allclose(made.cloud.stamps, [9.1, 20.9])
    made.reset()
    assert made.refused == 0


def test_a_cloud_is_moved_into_the_levelled_base():
    """A point of odom is shifted by the pose and turned back by its yaw; tilt does not count."""
    made = assembler()
    frame = PointCloud(np.float32([[3.0, 4.0, 1.0]]), "base_footprint", np.array([0.0]))
    made.add_frame(frame, standing())
    pose = pose_at(1.0, 2.0, np.pi / 2)
    pose.position[2] = 0.4
    found = made.relative(pose)
    np.testing.assert_allclose(found.points, [[2.0, -2.0, 0.6]], atol=1e-6)
    assert found.frame == "base_footprint"
    np.testing.assert_array_equal(found.stamps, [0.0])
    made.relative(pose_at(9.0, 9.0))
    np.testing.assert_allclose(found.points, [[2.0, -2.0, 0.6]], atol=1e-6)
    np.testing.assert_allclose(made.around(pose), found.points)


def test_one_turn_by_several_tracks_is_what_assemblers_gather():
    """Points, stamps and classes are bit-equal; the sweeps of the next turn are left out."""
    config, angles = CloudAssemblyConfig(blind_deg=((10, 40),)), np.arange(0.0, 3.5, 0.1)
    ranges = np.random.default_rng(2).uniform(0.2, 14.0, (len(angles), 3))
    given = sweeps(angles, ranges=ranges, elevations=(-AHEAD, 0.8, AHEAD), classes=4)
    moving = PoseTrack()
    for stamp in (0.0, 9.0):
        moving.append(stamp, np.array([0.3 * stamp, 0.1, 0.2]), LEVEL)
    tracks, pose = (moving, standing()), pose_at(1.0, 2.0, 0.7)
    cloud, placed = assembled_turn(config, HEIGHT, given, tracks, pose)
    for k, track in enumerate(tracks):
        made = CloudAssembler(config, HEIGHT)
        made.add(given, track)
        np.testing.assert_array_equal(placed[k], made.cloud.points)
        if k == 0:
            expected = made.relative(pose)
            np.testing.assert_array_equal(cloud.points, expected.points)
            np.testing.assert_array_equal(cloud.points, made.around(pose))
            np.testing.assert_array_equal(cloud.stamps, expected.stamps)
            np.testing.assert_array_equal(cloud.classes, expected.classes)


def test_there_is_no_cloud_to_move_before_the_first():
    """An early call is refused with an error that says how long to wait."""
    for move in (assembler().relative, assembler().around):
        with pytest.raises(ValueError, match="cloud: expected a complete one, got none"):
            move(pose_at())


def test_a_cloud_grows_old():
    """Its age counts from its newest point; from five seconds on it is stale."""
    made = assembler()
    assert made.cloud_age(3.0) == np.inf
    assert made.is_stale(3.0)
    made = turned([0.0, 1.0, 2.0, np.pi])
    assert made.cloud_age(3.0) == pytest.approx(1.0)
    assert not made.is_stale(6.9)
    assert made.is_stale(7.1)
    made.reset()
    assert made.cloud is None
    assert made.is_stale(3.0)


def test_the_window_holds_the_last_turn_of_the_head():
    """Parts older than a turn leave it; without points it does not grow."""
    made = turned(np.arange(0.0, 6.05, 0.25))
    stamps = made.window.stamps.tolist()
    np.testing.assert_allclose(stamps, np.arange(6.0 - 3.0, 6.05, 0.25))
    made.add(sweeps(6.25, ranges=np.inf), standing())
    assert made.window.stamps.tolist() == stamps
    assert [part.newest for part in made.window.parts] == stamps


def test_a_place_settles_when_the_head_has_turned_on():
    """Settled is the stamp of what lies half a radian of head angle or more behind."""
    made = turned([])
    assert (made.window.parts, made.window.settled) == ((), -np.inf)
    settled = []
    for angle in (0.0, 0.25, 0.5, 0.75):
        made.add(sweeps(angle), standing())
        settled.append(made.window.settled)
    assert settled == [-np.inf, -np.inf, 0.0, 0.25]
    made.reset()
    assert (made.window.parts, made.window.settled) == ((), -np.inf)


def test_the_newest_stamp_is_asked_for_once():
    """A cloud remembers it; one with other stamps has its own."""
    cloud = PointCloud(np.zeros((3, 3), np.float32), "odom", np.array([1.0, 3.0, 2.0]))
    assert cloud.newest == 3.0
    assert vars(cloud)["newest"] == 3.0
    assert replace(cloud, stamps=cloud.stamps + 1.0).newest == 4.0


def frame(stamp, points, name="base_footprint"):
    """Return a frame of a 3D laser, all at one time."""
    points = np.atleast_2d(np.float32(points))
    return PointCloud(points, name, np.full(len(points), stamp))


def test_frames_are_gathered_for_their_span():
    """The cloud is replaced when the gathered frames cover the span, by all of them."""
    made, track, sizes = assembler(accumulation_time=1.0), standing(), []
    for stamp in (0.0, 0.4, 0.8, 1.0, 1.2, 1.6, 2.2):
        made.add_frame(frame(stamp, [2.0, 0.0, 0.0]), track)
        sizes.append(0 if made.cloud is None else len(made.cloud))
    assert sizes == [0, 0, 0, 4, 4, 4, 3]
    assert made.window.settled == 2.2
    assert len(made.window.parts) == 3


def test_frames_after_a_long_gap_begin_anew():
    """What was gathered before a silence of span and stale together is left out."""
    made, track = assembler(accumulation_time=1.0, max_age=5.0), standing()
    for stamp in (0.0, 6.1, 7.2):
        made.add_frame(frame(stamp, [2.0, 0.0, 0.0]), track)
    np.testing.assert_allclose(made.cloud.stamps, [6.1, 7.2])
    made = assembler(accumulation_time=1.0, max_age=5.0)
    for stamp in (0.0, 5.9):
        made.add_frame(frame(stamp, [2.0, 0.0, 0.0]), track)
    assert len(made.cloud) == 2


@pytest.mark.parametrize(("name", "below"), [("sensor", HEIGHT), ("base_footprint", 0.0)])
def test_a_frames_range_is_measured_from_the_laser(name, below):
    """The range limit holds from the optical centre, the body's from the vertical axis."""
    points = [[0.41, 0, 0], [11.4, 0, HEIGHT], [9.0, 0, 7.7]]
    dropped = [[0.39, 0, 0], [11.6, 0, HEIGHT], [9.0, 0, -6.5]]
    shifted = np.array(points + dropped) - [0, 0, below]
    made = assembler()
    made.add_frame(frame(0.0, shifted, name), standing())
    np.testing.assert_allclose(made.cloud.points, points, atol=1e-5)


def test_frames_without_poses_are_refused():
    """A frame two seconds after the last pose makes no cloud."""
    made = assembler()
    made.add_frame(frame(62.0, [2.0, 0.0, 0.0]), standing())
    assert made.cloud is None
    assert made.refused == 1


def test_beams_are_simulated_beyond_the_range_that_is_kept():
    """Noise moves returns across the limit: half a metre more is simulated."""
    assert CloudAssemblyConfig(max_range=8.0).sight == 8.5
