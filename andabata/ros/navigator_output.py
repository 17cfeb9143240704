"""What a navigator publishes, in the form that the rest of the graph takes it in."""

from dataclasses import dataclass, replace

import numpy as np

from andabata.records import topics
from andabata.records.messages import MessageBuilder
from andabata.records.topics import POINT_CLOUD, Ros, RosMessage, Topic
from andabata.ros.graph import Graph
from andabata.ros.live_recording import LiveRecording

STAMPED_TWIST = replace(topics.TWIST, kind="geometry_msgs/msg/TwistStamped")
"""The command with a stamp, as Nav2 has it since ROS 2 Kilted."""

_LATCHED = frozenset({topics.LOCAL_MAP, topics.GRID_MAP})
"""Maps, which layers of a costmap ask for once."""


@dataclass(frozen=True)
class OutputForm:
    """Form of the output; the default is the paper's.

    Attributes:
        is_twist_stamped: True to publish ``TwistStamped`` in place of ``Twist``.
        max_points: Largest number of points of a published cloud; None for all of them.
        latches_maps: True to send the last map to later subscribers, too.
    """

    is_twist_stamped: bool = False
    max_points: int | None = None
    latches_maps: bool = False


class NavigatorOutput:
    """Writer of a navigator's messages to a graph."""

    def __init__(
        self, graph: Graph, form: OutputForm, recording: LiveRecording | None = None
    ) -> None:
        """Write to a graph.

        Args:
            graph: The graph.
            form: Form of the output.
            recording: Recording that the messages are written to, too; None for none.
        """
        self._graph, self._form, self._recording = graph, form, recording
        self.ros: Ros = graph.ros

    def advertise(self, topic: Topic) -> None:
        """Announce a topic in its form."""
        latch = self._form.latches_maps and topic in _LATCHED
        self._graph.advertise(self._formed(topic), latch)

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Publish a message in the form of its topic."""
        if topic is topics.TWIST and self._form.is_twist_stamped:
            message = self._stamped(stamp_ns, message)
        if topic.kind == POINT_CLOUD and self._form.max_points is not None:
            message = thinned(message, self._form.max_points)
        self._graph.write(self._formed(topic), stamp_ns, message)
        if self._recording is not None:
            self._recording.write(self._formed(topic), stamp_ns, message)

    def stop_recording(self) -> None:
        """Record nothing more: what follows belongs to no control period."""
        self._recording = None

    def close(self) -> None:
        """Leave the graph."""
        self._graph.close()

    def _formed(self, topic: Topic) -> Topic:
        """Return the topic that is published for one of ours."""
        is_stamped = topic is topics.TWIST and self._form.is_twist_stamped
        return STAMPED_TWIST if is_stamped else topic

    def _stamped(self, stamp_ns: int, twist: RosMessage) -> RosMessage:
        """Return a twist with a stamp [ns]."""
        builder = MessageBuilder(self.ros, stamp_ns)
        header = builder.header(0.0, "base_link")
        return builder.new(STAMPED_TWIST.kind, header=header, twist=twist)


def thinned(cloud: RosMessage, max_points: int) -> RosMessage:
    """Return a cloud with every k-th point of its own, such that it has at most ``max_points``.

    A datagram of a large cloud gets lost between DDS implementations.

    Args:
        cloud: The cloud.
        max_points: Largest number of points.
    """
    points = int(cloud.width) * int(cloud.height)
    if points <= max_points:
        return cloud
    rows = np.asarray(cloud.data).reshape(points, -1)[:: -(-points // max_points)]
    data = np.ascontiguousarray(rows).ravel()
    return replace(cloud, height=1, width=len(rows), row_step=len(data), data=data)
