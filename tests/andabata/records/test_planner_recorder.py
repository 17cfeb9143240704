"""What the planner knows is recorded at its rates, and nothing else changes."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.bags import Bag
from andabata.records.messages import NS, header_ns, pose_of
from tests.support.grid_maps import layer_of
from tests.support.planned_drives import GOAL, START, PlannedDrive, in_map, record_drive
from tests.support.played_graph import MemoryWriter


@pytest.fixture(scope="module")
def written():
    """Messages of two seconds, by topic: stamp [s] and message."""
    writer = MemoryWriter()
    PlannedDrive().record(writer)
    found = {}
    for stamp, topic, message in writer.messages:
        found.setdefault(topic, []).append((stamp / NS - 1_700_000_000, message))
    return found


def test_maps_come_once_a_second_and_plans_twice(written):
    """From the first decision on; the heading error with each decision."""
    assert [stamp for stamp, _ in written[topics.LOCAL_MAP]] == pytest.approx([0.1, 1.1])
    assert [stamp for stamp, _ in written[topics.GRID_MAP]] == pytest.approx([0.1, 1.1])
    times = [0.1, 0.6, 1.1, 1.6]
    assert [stamp for stamp, _ in written[topics.PLAN]] == pytest.approx(times)
    assert [stamp for stamp, _ in written[topics.SUBGOAL]] == pytest.approx(times)
    assert len(written[topics.HEADING_ERROR]) == 20
    stamp, message = written[topics.LOCAL_MAP][1]
    assert header_ns(message) / NS - 1_700_000_000 == pytest.approx(stamp)


def test_map_plan_and_sub_goal_fit_each_other(written):
    """The plan begins at the robot, ends at the goal, and the sub-goal is where it heads for."""
    path = [pose_of(each.pose) for each in written[topics.PLAN][-1][1].poses]
    np.testing.assert_allclose(
        path[0].position[:2], START.position[:2] + 0.8 * np.array([np.cos(0.2), np.sin(0.2)])
    )
    np.testing.assert_allclose(path[-1].position[:2], GOAL, atol=1e-9)
    assert path[3].position[2] == pytest.approx(0.25)  # The ground of the cloud.
    subgoal = pose_of(written[topics.SUBGOAL][-1][1].pose)
    ahead = subgoal.position[:2] - path[0].position[:2]
    error = written[topics.HEADING_ERROR][15][1].data
    assert np.arctan2(ahead[1], ahead[0]) - START.yaw == pytest.approx(error, abs=0.05)
    assert subgoal.yaw == pytest.approx(np.arctan2(ahead[1], ahead[0]))
    grid = written[topics.LOCAL_MAP][-1][1]
    layer = layer_of(written[topics.GRID_MAP][-1][1], "occupancy")
    data = np.asarray(grid.data).reshape(grid.info.height, grid.info.width).T
    np.testing.assert_array_equal(data == -1, np.isnan(layer))
    assert (data > 50).sum() > 10


def test_every_period_ends_with_the_place_of_odom_in_the_map(written):
    """The goal of the map and the map in odom are in one tree, without a message more."""
    messages = [message for _, message in written[topics.TF]]
    pairs = [(t.header.frame_id, t.child_frame_id) for t in messages[-1].transforms]
    assert pairs == [("odom", "base_footprint"), ("map", "odom")]
    shift = messages[-1].transforms[1].transform.translation
    np.testing.assert_allclose([shift.x, shift.y, shift.z], [100.0, 50.0, 0.0], atol=1e-9)


def test_without_the_map_the_recording_is_as_it_was(written):
    """No planner's topic, one transform a message, and all else the same."""
    writer = MemoryWriter()
    PlannedDrive().record(writer, local_map=False)
    kinds = {topic for _, topic, _ in writer.messages}
    assert kinds == set(written) - set(topics.PLANNER_TOPICS)
    assert {len(m.transforms) for _, topic, m in writer.messages if topic is topics.TF} == {1}
    twists = [m.angular.z for _, topic, m in writer.messages if topic is topics.TWIST]
    assert twists == [message.angular.z for _, message in written[topics.TWIST]]


def test_without_a_planner_there_is_a_heading_error_alone():
    """The goal itself is what the controller heads for."""
    writer = MemoryWriter()
    PlannedDrive(has_planner=False).record(writer, 0.5)
    found = {topic for _, topic, _ in writer.messages} & set(topics.PLANNER_TOPICS)
    assert found == {topics.HEADING_ERROR}


def test_a_new_clock_begins_anew():
    """A second drive from time 0 gets its first map at once."""
    drive, writer = PlannedDrive(), MemoryWriter()
    drive.record(writer, 1.5)
    recorder = drive.navigator.observers.pop()
    drive.__post_init__()
    drive.navigator.observers.append(recorder)
    count = sum(topic is topics.LOCAL_MAP for _, topic, _ in writer.messages)
    drive.navigator.step(drive._readings(0.1))
    assert sum(topic is topics.LOCAL_MAP for _, topic, _ in writer.messages) == count + 1


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
def test_every_format_holds_the_map(tmp_path, suffix):
    """Maps and plans are read back from each kind of recording."""
    path = record_drive(tmp_path / f"drive.{suffix}", 0.3)
    with Bag(path) as bag:
        found = {m.topic: m for m in bag.messages()}
    for topic in topics.PLANNER_TOPICS:
        assert found[topic.name(1)].kind == topic.kind
    assert layer_of(found["/grid_map"].content, "occupancy").shape == (256, 256)
    assert found["/initialpose"].content.pose.pose.position.x == in_map(START).position[0]
