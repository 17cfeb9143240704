"""Tracks hold the poses of a topic, once each, in the order of their times."""

import json

import numpy as np
import pytest

from andabata.exports.tracks import (
    Track,
    TrackError,
    bag_geo_reference,
    read_drive_folder,
    read_tracks,
    tum_text,
)
from andabata.machine.pose import Pose
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag, BagError
from andabata.records.messages import NS, MessageBuilder
from tests.support.planned_drives import GOAL, START, T_MAP_ODOM, in_map, record_drive

EPOCH = 1_700_000_000


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """Recording of two seconds."""
    return record_drive(tmp_path_factory.mktemp("tracks") / "drive.mcap", clouds=False)


def write(path, *messages):
    """Write topic and message of each pair, a second apart."""
    writer = open_writer(path)
    for k, (topic, message) in enumerate(messages):
        writer.write(topic, (EPOCH + k) * NS, message)
    writer.close()
    return path


def test_the_filters_track_comes_before_the_true_one(drive):
    """Both are in the map, with every pose once: the start and twenty steps."""
    with Bag(drive) as bag:
        found = read_tracks(bag)
    assert [track.name for track in found] == ["/odometry/filtered", "/ground_truth"]
    estimated, true = found
    assert (estimated.frame, true.frame) == ("map", "map")
    assert np.diff(estimated.stamps_ns).tolist() == [NS // 10] * 20
    np.testing.assert_allclose(estimated.positions[0], in_map(START).position)
    np.testing.assert_allclose(estimated.quaternions[0], in_map(START).quaternion)
    assert estimated.length == pytest.approx(0.5 * 2.0)


def test_transforms_give_the_track_of_the_body(drive):
    """Of /tf the body's transforms count, and not those of odom in the map."""
    with Bag(drive) as bag:
        (track,) = read_tracks(bag, ("/tf",))
    assert track.frame == "odom"
    np.testing.assert_allclose(
        track.positions[-1, :2], START.position[:2] + np.array([np.cos(0.2), np.sin(0.2)])
    )


def test_the_bodys_transform_counts_wherever_it_stands(tmp_path):
    """Transforms between other frames are no track, also where they come first."""
    builder, kind = MessageBuilder(2), "tf2_msgs/msg/TFMessage"
    rows = np.array([[1.0, 0, 0, 0, 0, 0, 1], [2.0, 0, 0, 0, 0, 0, 1]])
    frames = (("map", "odom"), ("odom", "husky/base_link"))
    parts = [
        builder.stamped_transform(0.0, pair, row) for pair, row in zip(frames, rows, strict=True)
    ]
    path = write(tmp_path / "x.mcap", (topics.TF, builder.new(kind, transforms=parts)))
    with Bag(path) as bag:
        (track,) = read_tracks(bag, ("/tf",))
    assert (track.frame, track.positions[:, 0].tolist()) == ("odom", [2.0])


def test_the_last_plan_is_a_track_without_times(drive):
    """Its poses have one stamp: they keep their order, from the robot to the goal."""
    with Bag(drive) as bag:
        (track,) = read_tracks(bag, ("/plan",))
    assert (track.frame, track.stamps_ns) == ("odom", None)
    np.testing.assert_allclose(track.positions[-1, :2], GOAL, atol=1e-9)
    ahead = START.position[:2] + 0.8 * np.array([np.cos(0.2), np.sin(0.2)])
    np.testing.assert_allclose(track.positions[0, :2], ahead)
    with pytest.raises(TrackError, match="expected times and rotations for TUM"):
        tum_text(track)


def test_a_recording_without_poses_is_refused_with_its_topics(tmp_path):
    """The message tells what is there, and what to do."""
    builder = MessageBuilder(1)
    path = write(tmp_path / "x.bag", (topics.TWIST, builder.twist(0.3, 0.1)))
    with Bag(path) as bag:
        with pytest.raises(BagError, match=r"expected poses .*got /cmd_vel \(Twist\).*--topic"):
            read_tracks(bag)
        with pytest.raises(BagError, match="in /cmd_vel, got"):
            read_tracks(bag, ("/cmd_vel",))


def test_poses_are_sorted_and_of_one_frame(tmp_path):
    """Header stamps give the order; poses of another frame than the first's are left out."""
    builder = MessageBuilder(2)
    goals = [builder.goal(seconds, np.array([seconds, 0.0])) for seconds in (2.0, 1.0, 1.0, 3.0)]
    goals[3].header.frame_id = "odom"
    path = write(tmp_path / "x.mcap", *((topics.GOAL, goal) for goal in goals))
    with Bag(path) as bag:
        (track,) = read_tracks(bag, ("/goal",))
    assert track.positions[:, 0].tolist() == [1.0, 2.0]


def test_tum_lines_are_exact_and_in_its_order():
    """Stamps keep their nanoseconds; the rotation is x, y, z, w after the position."""
    turn = Pose.from_euler(np.zeros(3), 0.0, 0.0, np.pi / 2).quaternion
    track = Track(
        "t", "map", np.array([EPOCH * NS + 23_456_789]), np.array([[1.5, -2, 3]]), turn[None]
    )
    comment, line = tum_text(track).splitlines()
    assert comment.startswith("#")
    assert line == "1700000000.023456789 1.5 -2 3 0 0 0.707106781 0.707106781"


def test_a_recorded_simulation_knows_its_place_on_earth(drive, tmp_path):
    """Settings tell the geo reference; a recording with neither settings nor fixes does not."""
    with Bag(drive) as bag:
        assert bag_geo_reference(bag).altitude == 60.0
    odometry = MessageBuilder(1).odometry(0.0, START)
    path = write(tmp_path / "x.bag", (topics.FILTERED_ODOMETRY, odometry))
    with Bag(path) as bag:
        assert bag_geo_reference(bag) is None
    assert T_MAP_ODOM[0] == 100.0


def test_a_run_folder_gives_path_goals_and_place(tmp_path):
    """They come from drive.json and run.json; a folder without settings has no place."""
    data = {"path": [[0, 0, 1], [3, 4, 1]], "goals": [[3, 4]]}
    (tmp_path / "drive.json").write_text(json.dumps(data))
    assert read_drive_folder(tmp_path).reference is None
    config = {"sensing": {"geo_reference": {"latitude_deg": 10.0}}}
    (tmp_path / "run.json").write_text(json.dumps({"config": config}))
    found = read_drive_folder(tmp_path)
    assert (found.track.length, found.goals.tolist()) == (5.0, [[3.0, 4.0]])
    assert found.reference.latitude_deg == 10.0
    with pytest.raises(TrackError, match="expected times and rotations for TUM"):
        tum_text(found.track)


@pytest.mark.parametrize("text", ["{}", "[]", "no json", '{"path": [], "goals": []}'])
def test_a_folder_of_something_else_is_refused(tmp_path, text):
    """Truncated, foreign and empty files give one clear error."""
    (tmp_path / "drive.json").write_text(text)
    with pytest.raises(TrackError, match=r"drive\.json: expected .*got .*drive again"):
        read_drive_folder(tmp_path)
