"""A live robot whose sensors contradict each other says so, on a simulated graph."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.pose import Pose
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.reactive import StraightController
from andabata.records import map_messages, topics
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import Topic
from andabata.ros.navigator_node import NavigatorNode
from tests.support import computed_bags
from tests.support.computed_bags import restamped, stamp_of
from tests.support.edited_bags import reframed
from tests.support.played_graph import PlayedGraph


@pytest.fixture(scope="module")
def rows():
    """Messages of a winding drive."""
    return computed_bags.drive(13.0)


@pytest.fixture(autouse=True)
def _quick(monkeypatch):
    """Do not wait for the last messages to leave."""
    monkeypatch.setattr("andabata.ros.navigator_node._FLUSH_TIME", 0.0)


def edited(rows, topic, edit):
    """Return rows with the messages of a topic edited, each by its number."""
    found, k = [], 0
    for row in rows:
        found.append(edit(row, k) if row.topic == topic else row)
        k += row.topic == topic
    return found


def run(rows, faults=(), others=(), **options):
    """Return the result of a node, its status lines, and the diagnostics that it published."""
    sensed = [(row.stamp_ns, row.topic, row.content) for row in rows]
    messages = sorted((*sensed, *others), key=lambda m: m[0])
    graph, status = PlayedGraph(messages, messages[0][0], messages[-1][0]), []
    config = SimulatedRobotConfig(faults=faults)
    steering = Steering(StraightController(config.robot.speed), LocalPlanner(config.grid))
    node = NavigatorNode(
        graph, config, Models(), steering, topics.LASER_CLOUD, status=status.append, **options
    )
    found = node.run(Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0))
    published = [m.status[0] for _, topic, m in graph.messages if topic is topics.DIAGNOSTICS]
    return found, status, published


class Recording:
    """Recording that keeps the goals alone."""

    def __init__(self):
        self.goals = []

    def add_goal(self, now, goal):
        """Keep a goal [m]."""
        self.goals.append(goal)

    def begin(self, *_):
        """Keep nothing."""

    add_update = add_readings = write = begin


def test_a_gyro_of_the_wrong_sign_is_in_the_diagnostics(rows):
    """From the check that fails on no message is ok; the user is told once."""

    def turned_round(row, _):
        rate = row.content.angular_velocity
        return replace(row, content=replace(row.content, angular_velocity=replace(rate, z=-rate.z)))

    found, status, published = run(edited(rows, "/imu", turned_round))
    failed = [k for k, each in enumerate(published) if "the gyro turns left" in each.message]
    assert failed
    assert all(each.level >= 1 for each in published[failed[0] :])
    assert all(not each.message.startswith("ok") for each in published[failed[0] :])
    assert sum("failed check: imu: the gyro turns left" in line for line in status) == 1
    assert found["health"] == "degraded"


def test_a_drive_without_contradictions_is_ok(rows):
    """The same drive as it is has no failed check."""
    found, status, published = run(rows)
    assert not any("failed check" in line for line in status)
    assert published[-1].level == 0
    assert published[-1].message == "ok"
    assert found["health"] == "ok"


def test_faults_of_the_settings_are_injected_from_the_start_of_the_drive(rows):
    """The encoders fall silent after six seconds; until then all is as without a fault."""
    found, _, published = run(rows, faults=("wheels:off@6",))
    silent = [k for k, each in enumerate(published) if "wheels: silent" in each.message]
    assert 0 < silent[0] == len(published) - len(silent)
    assert found["health"] == "degraded"
    assert found["counts"]["wheels"][0] == pytest.approx(600, abs=15)


def test_a_second_imu_is_left_out_and_reported_and_the_option_chooses(rows):
    """The robot goes on with the first, not ok; the option reads one alone, and all is well."""

    def upside_down(row):
        force = row.content.linear_acceleration
        content = reframed(row.content, "imu2_link")
        content = replace(content, linear_acceleration=replace(force, z=-force.z))
        later = replace(row, stamp_ns=row.stamp_ns + NS // 500, content=content)
        return restamped(later, stamp_of(row) + NS // 500)

    both = [*rows, *(upside_down(row) for row in rows if row.topic == "/imu")]
    found, status, published = run(both)
    assert any("expected one source" in line for line in status)
    assert published[-1].level == 1
    assert "--source /imu=base_link" in published[-1].message
    assert found["refused"] > 1000
    found, _, published = run(both, sources={"/imu": "base_link"})
    assert found["refused"] == 0
    assert published[-1].message == "ok"


def test_bursts_are_spread_over_the_time_before_them(rows):
    """An IMU that sends ten readings at once gives as many scans as one that sends each."""
    plain, _, _ = run(rows)

    def arrived(row, k):
        late = (9 - k % 10) * (NS // 100 - NS // 10_000)
        return replace(restamped(row, stamp_of(row) + late), stamp_ns=row.stamp_ns + late)

    found, _, _ = run(edited(rows, "/imu", arrived))
    assert found["scans"] == pytest.approx(plain["scans"], abs=3)
    assert found["refused"] == 0
    assert found["health"] == "ok"
    assert any("readings come in bursts of " in text for text in found["remark_texts"])


def test_another_planners_path_is_followed_in_place_of_a_goal(rows):
    """Goals on record move along the path; one in another frame is in the diagnostics."""
    plan, begin = Topic("/plan", "/plan", topics.PATH, None), rows[0].stamp_ns
    builder = MessageBuilder(1, begin)
    places = np.column_stack([np.arange(0.0, 30.0, 0.5), np.zeros(60), np.zeros(60)])
    there, own = (map_messages.path(builder, 1.0, places) for _ in range(2))
    aside = map_messages.path(builder, 1.0, places[:, [1, 0, 2]])
    there.header.frame_id = aside.header.frame_id = "map"
    others = [(begin + k * NS, "/plan", each) for k, each in enumerate((there, own, aside), 1)]
    recording = Recording()
    _, status, published = run(rows, others=others, path=plan, recording=recording)
    goals = np.unique(recording.goals, axis=0)
    assert goals.tolist() == [[0.0, 4.5], [4.0, 0.0]]
    assert any("expected a path in map, got one in odom" in line for line in status)
    assert "got one in odom" in published[-1].message
