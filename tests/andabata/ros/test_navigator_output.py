"""Output has the form that the rest of a graph takes it in."""

import numpy as np

from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder, header_ns
from andabata.ros.navigator_output import NavigatorOutput, OutputForm, thinned
from tests.support.played_graph import PlayedGraph
from traversability.cloud import PointCloud

BUILDER = MessageBuilder(1)


def written(form, topic, message):
    """Return the stamp, topic and message that a graph gets."""
    graph = PlayedGraph([], 0, NS)
    NavigatorOutput(graph, form).write(topic, 7 * NS, message)
    return graph.messages[0]


def cloud(points):
    """Return a cloud of points whose x counts them."""
    xyz = np.zeros((points, 3), dtype=np.float32)
    xyz[:, 0] = np.arange(points)
    return BUILDER.cloud(0.0, PointCloud(xyz, "base_footprint"))


def xs(message):
    """Return the x of a cloud's points."""
    return np.asarray(message.data).view("<f4").reshape(-1, 3)[:, 0]


def test_the_papers_form_is_the_default():
    """Nothing is changed."""
    for topic, message in ((topics.TWIST, BUILDER.twist(0.3, 0.1)), (topics.CLOUD, cloud(50))):
        assert written(OutputForm(), topic, message) == (7 * NS, topic, message)


def test_a_stamped_command_has_the_same_twist_and_its_time():
    """Name and twist stay, type and stamp are new."""
    twist = BUILDER.twist(0.3, 0.1)
    stamp, topic, message = written(OutputForm(is_twist_stamped=True), topics.TWIST, twist)
    assert (topic.ros2, topic.kind) == ("/cmd_vel", "geometry_msgs/msg/TwistStamped")
    assert message.twist == twist
    assert header_ns(message) == stamp == 7 * NS


def test_a_large_cloud_is_thinned_evenly():
    """Every k-th point stays, as many as allowed at most; a small cloud is untouched."""
    small = cloud(10)
    assert thinned(small, 10) is small
    message = thinned(cloud(25), 10)
    np.testing.assert_array_equal(xs(message), np.arange(0, 25, 3))
    assert message.width == 9
    assert message.row_step == len(message.data) == 9 * message.point_step


def test_maps_are_latched_where_asked_for():
    """A costmap that comes late gets the map; commands are never latched."""
    calls = {}
    graph = PlayedGraph([], 0, NS)
    graph.advertise = lambda topic, latch=False: calls.setdefault(topic, latch)
    output = NavigatorOutput(graph, OutputForm(latches_maps=True))
    for topic in (topics.LOCAL_MAP, topics.TWIST):
        output.advertise(topic)
    assert calls == {topics.LOCAL_MAP: True, topics.TWIST: False}
