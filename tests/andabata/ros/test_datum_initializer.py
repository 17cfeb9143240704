"""A live navigator's datum, on a simulated graph that plays a recording."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobotConfig, with_geo_reference
from andabata.localization.datum import DatumError
from andabata.localization.fix_check import NO_ALTITUDE
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose, wrap
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import Simulator
from andabata.models import Models
from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder
from andabata.records.recorder import DATUM, MessageQueue, queue_readings
from andabata.ros.graph import RosError
from andabata.ros.navigator_node import NavigatorNode
from tests.support.moved_drives import place
from tests.support.played_graph import MemoryWriter, PlayedGraph
from worlds.catalogue import make_world, patch
from worlds.rays.scene import RayScene
from worlds.world import Start

EPOCH = 1_700_000_000 * NS
THERE = place(43.47, -80.54, 330.0)


@pytest.fixture(scope="module")
def standing():
    """Sixteen seconds of a robot at rest in Waterloo, as messages."""
    world = make_world("hill", 4, 0.3, patch("hill", 60.0, 0.25))
    config = with_geo_reference(SimulatedRobotConfig(), THERE)
    rng = np.random.default_rng(1)
    simulator = Simulator(world, RayScene(world), config.robot, "kinematic", config.sensing, rng)
    writer = MemoryWriter()
    queue = MessageQueue(writer, MessageBuilder(1, EPOCH))
    simulator.reset(Start(-8.0, 0.0, 0.3))
    for _ in range(160):
        queue_readings(
            queue, replace(simulator.step(WheelSpeeds(0.0, 0.0), skip_scan=True), sweeps=None)
        )
        queue.flush()
    simulator.close()
    return writer.messages


@pytest.fixture(scope="module")
def models():
    """Shipped models."""
    return Models()


def navigate(messages, models, given=None, seconds=14.0):
    """Return the graph, a node on it, and the list of its status lines."""
    played = [(stamp, topic.ros1, message) for stamp, topic, message in messages]
    graph, status = PlayedGraph(played, EPOCH, EPOCH + round(seconds * NS)), []
    config = SimulatedRobotConfig()
    steering = make_steering("straight", None, config, models)
    node = NavigatorNode(graph, config, models, steering, given=given, status=status.append)
    return graph, node, status


def fixed(messages, change):
    """Return messages whose k-th fix is changed."""
    count = iter(range(1000))
    return [
        (stamp, topic, change(next(count), m) if topic is topics.FIX else m)
        for stamp, topic, m in messages
    ]


def test_the_first_consistent_fix_is_the_datum_and_is_reported_once(standing, models):
    """A bad first fix is skipped; the datum is reported once and published."""
    bad = fixed(
        standing,
        lambda k, fix: replace(fix, latitude=0.0, longitude=0.0) if k == 0 else fix,
    )
    graph, node, status = navigate(bad, models)
    data = node.run(seconds=4.0)
    assert THERE.distance(data["datum"]["latitude_deg"], data["datum"]["longitude_deg"]) < 20
    assert data["magnetic"]["declination_deg"] == pytest.approx(-9.46, abs=0.01)
    assert sum("the map's origin is latitude 43.4" in text for text in status) == 1
    diagnoses = [m.status[0] for _, topic, m in graph.messages if topic is topics.DIAGNOSTICS]
    published = [json.loads(v.value) for d in diagnoses for v in d.values if v.key == DATUM]
    assert published[0]["datum"] == data["datum"]
    assert data["health"] == "ok"


def test_a_given_start_keeps_its_position_once_the_fixes_agree(standing, models):
    """With a given start the datum is laid such that the fixes fall on it."""
    start = MessageBuilder(1, EPOCH).stamped_pose(0.0, pose_at(40.0, -30.0))
    messages = [(EPOCH + 1, topics.INITIAL_POSE, start), *standing]
    _, node, _ = navigate(messages, models)
    data = node.run(seconds=8.0)
    assert data["datum"]["source"] == "the mean of 5 good fixes, at the given start"
    here = GeoReference(
        **{k: data["datum"][k] for k in ("latitude_deg", "longitude_deg")},
        altitude=data["datum"]["altitude_m"],
    )
    first = THERE.to_geodetic(np.array([[-8.0, 0.0, 0.0]]))
    np.testing.assert_allclose(here.to_map(first)[0, :2], [40.0, -30.0], atol=5.0)
    assert data["counts"]["gnss"][0] > 1
    assert data["counts"]["compass"][0] > 200


def test_the_mean_of_the_first_fixes_lies_at_a_given_start(standing, models):
    """Five fixes that are off by 0 to 4 m to the north move the map by 2 m, none by its own."""
    start = MessageBuilder(1, EPOCH).stamped_pose(0.0, pose_at(40.0, -30.0))
    true = THERE.to_geodetic(np.array([[-8.0, 0.0, 0.0]]))[0]

    def off(k, fix):
        """Return a fix that is off by so many metres."""
        latitude, longitude, _ = THERE.to_geodetic(np.array([[-8.0, float(k % 5), 0.0]]))[0]
        return replace(fix, latitude=latitude, longitude=longitude)

    _, node, _ = navigate([(EPOCH + 1, topics.INITIAL_POSE, start), *fixed(standing, off)], models)
    data = node.run(seconds=8.0)["datum"]
    here = GeoReference(latitude_deg=data["latitude_deg"], longitude_deg=data["longitude_deg"])
    place = here.to_map(np.array([[true[0], true[1], 60.0]]))[0, :2]
    np.testing.assert_allclose(place, [40.0, -32.0], atol=0.15)


def test_without_any_fix_the_compass_keeps_the_given_heading(standing, models):
    """Without fixes for long the compass is referred to the given heading."""
    start = MessageBuilder(1, EPOCH).stamped_pose(0.0, pose_at(40.0, -30.0))
    readings = [entry for entry in standing if entry[1] is not topics.FIX]
    _, node, status = navigate(
        [(EPOCH + 1, topics.INITIAL_POSE, start), *readings], models, seconds=16.0
    )
    data = node.run(seconds=11.5)
    assert data["datum"] is None
    assert data["counts"]["compass"][0] > 100
    assert abs(wrap(node._localizer.pose.yaw - 0.3)) < 0.05
    assert "no datum yet: expected 5 good fixes" in status[0]


def test_a_given_datum_far_away_is_refused(standing, models):
    """A given datum far from the fixes raises a DatumError."""
    _, node, _ = navigate(standing, models, {"latitude_deg": 36.7, "longitude_deg": -4.4})
    with pytest.raises(DatumError, match="km away; give --datum"):
        node.run(seconds=4.0)


def test_a_waiting_navigator_reports_what_it_lacks(standing, models):
    """The status names the missing fixes and why others were refused."""
    nowhere = fixed(standing, lambda _, fix: replace(fix, latitude=0.0, longitude=0.0))
    _, node, status = navigate(nowhere, models)
    with pytest.raises(RosError, match="end of the graph"):
        node.run()
    assert "3 good fixes of /fix that agree with each other, got 0 of" in status[0]
    assert "refused at latitude 0, longitude 0" in status[0]


def test_fixes_without_altitude_start_a_navigator(standing, models):
    """A start needs no altitude, and the assumption is remarked."""
    flat = fixed(standing, lambda _, fix: replace(fix, altitude=float("nan")))
    _, node, _ = navigate(flat, models)
    data = node.run(seconds=4.0)
    assert data["datum"]["altitude_m"] is None
    assert NO_ALTITUDE in [remark["text"] for remark in data["remarks"]]
    assert data["health"] == "ok"


def pose_at(x, y):
    """Return a pose at x, y [m]."""
    return Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, 0.3)
