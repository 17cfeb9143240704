"""A start comes from an initial pose at once, or from the readings after a while."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.units import UnitFactors
from andabata.records.messages import NS, MessageBuilder
from andabata.ros import startup
from andabata.ros.graph import RosError
from andabata.ros.sensor_inbox import SensorInbox
from andabata.ros.startup import StartFinder, check_clock, wait_for_transforms
from tests.support.played_graph import PlayedGraph

EPOCH = 1_700_000_000 * NS
BUILDER = MessageBuilder(1, EPOCH)
POSE = Pose(np.array([1.0, 2.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))


class FixedDatum:
    """Datum initializer that returns a pose and keeps the readings that it got."""

    def __init__(self, pose):
        self._pose, self.calls = pose, []

    def initial_pose(self, readings, now_ns):
        """Return the pose."""
        self.calls.append((readings, now_ns))
        return self._pose


def finder(messages, pose, seconds=30.0):
    """Return a start finder on a graph, the graph, its datum initializer, and the status lines."""
    graph = PlayedGraph(messages, EPOCH, EPOCH + round(seconds * NS))
    inbox = SensorInbox(graph, SensorDecoder(0, decoder=MessageDecoder(units=UnitFactors())))
    inbox.subscribe()
    datum, status = FixedDatum(pose), []
    return StartFinder(graph, inbox, datum, status.append), graph, datum, status


def imu(seconds, offset=0.0):
    """Return an inertial message with its stamp off by an offset [s], as it is played."""
    row = np.array([seconds + offset, 0.0, 0.0, 0.0, 0.0, 0.0, 9.81])
    return EPOCH + round(seconds * NS), "/imu", BUILDER.imu(row)


def test_an_initial_pose_is_exact_and_taken_at_once():
    """A published pose ends the wait before the readings are asked."""
    message = (EPOCH + NS // 10, "/initialpose", BUILDER.stamped_pose(0.1, POSE))
    start, graph, datum, _ = finder([message], None)
    pose, is_rough = start.wait()
    assert pose.position.tolist() == [1.0, 2.0, 0.0]
    assert not is_rough
    assert graph.now_ns() < EPOCH + NS // 5
    assert datum.calls == []


def test_the_readings_give_a_rough_start_after_a_second():
    """Readings are collected from the begin on, and asked once nobody has published a pose."""
    start, graph, datum, _ = finder([imu(0.2), imu(0.9)], POSE)
    assert start.wait() == (POSE, True)
    assert NS < graph.now_ns() - EPOCH < 1.2 * NS
    assert len(datum.calls[0][0].imu) == 2


def test_a_wait_reports_every_ten_seconds_and_ends_with_the_graph():
    """The status names what is missing, twice in 25 s; the end of the graph is an error."""
    start, _, _, status = finder([], None, 25.0)
    with pytest.raises(RosError, match="expected /initialpose"):
        start.wait()
    assert len(status) == 2
    assert status[0].startswith("no start yet: expected /imu and /mag_orientation and 3 good fixes")


def test_a_second_of_offset_is_another_clock():
    """Stamps up to one second from the graph's time are accepted, on either side."""
    for stamp in (9.0, 10.0, 11.0):
        check_clock(stamp, 10.0)
    for stamp in (8.9, 11.1):
        with pytest.raises(RosError, match="use_sim_time"):
            check_clock(stamp, 10.0)
    with pytest.raises(RosError, match=r"/imu/data: .* --use-sim-time"):
        check_clock(8.9, 10.0, 2)
    start, _, _, _ = finder([imu(0.2, -5.0)], None)
    with pytest.raises(RosError, match=r"5\.0 s behind"):
        start.wait()


def test_the_last_rows_are_kept(monkeypatch):
    """Beyond the limit the oldest rows are dropped."""
    monkeypatch.setattr(startup, "_KEPT_ROWS", 3)
    start, _, datum, _ = finder([imu(k / 10) for k in range(1, 9)], POSE)
    start.wait()
    stamps = datum.calls[0][0].imu[:, 0] - EPOCH / NS
    np.testing.assert_allclose(stamps, [0.6, 0.7, 0.8], atol=1e-3)
    assert isinstance(datum.calls[0][0], SensorReadings)


class Inbox:
    """Inbox whose transforms are complete from some look on."""

    mounting_remarks = ("laser: something",)

    def __init__(self, looks):
        self._looks = looks

    @property
    def has_all_transforms(self):
        """True after some looks."""
        self._looks -= 1
        return self._looks <= 0


@pytest.mark.parametrize(("looks", "seconds"), [(4, 0.2), (1000, 3.0)])
def test_transforms_are_waited_for_up_to_three_seconds(looks, seconds):
    """The wait ends with the last transform or after the timeout, with the remarks as status."""
    graph, status = PlayedGraph([], EPOCH, EPOCH + 10 * NS), []
    wait_for_transforms(graph, Inbox(looks), status.append)
    assert (graph.now_ns() - EPOCH) / NS == pytest.approx(seconds)
    assert status == ["note: laser: something"]
