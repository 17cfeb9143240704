"""Check of a ROS 2 graph: publishers and subscribers that cannot match ours, by name."""

from collections.abc import Callable, Iterable, Iterator, Mapping

from andabata.records import topics
from andabata.records.topics import Topic
from andabata.ros.dds_discovery import Endpoint, EndpointWatch, NodeDirectory
from andabata.ros.dds_qos import publisher_profile
from andabata.ros.dds_subscription import Subscription
from andabata.ros.graph import TopicNames

_PATIENCE = 25
"""Number of looks after which an endpoint is judged although its node's name is not known."""

_COMMANDS = (topics.TWIST.ros2, topics.WHEEL_COMMAND.ros2)
"""Topics of which a robot obeys one publisher."""


class EndpointCheck:
    """Reports each endpoint once with which nothing, or too much, is exchanged."""

    def __init__(self, nodes: NodeDirectory, status: Callable[[str], None]) -> None:
        """Begin without findings.

        Args:
            nodes: Nodes of the graph, for their names.
            status: Function called with a line of text for the user.
        """
        self._nodes, self._status = nodes, status
        self._looks: dict[bytes, int] = {}
        self._judged: set[bytes] = set()

    def poll(
        self,
        watch: EndpointWatch,
        subscriptions: Iterable[Subscription],
        published: Mapping[Topic, bool],
        names: TopicNames,
    ) -> None:
        """Judge the endpoints that are new.

        Args:
            watch: Publishers and subscribers of others.
            subscriptions: Our subscriptions.
            published: Topics that we publish, with True for those that are latched.
            names: Names of the topics in the graph.
        """
        received = {each.name: each for each in subscriptions}
        sent = {names.of(topic): (topic, latch) for topic, latch in published.items()}
        for publisher in self._ripe(watch.publishers):
            if publisher.topic in received:
                self._judge_publisher(publisher, received[publisher.topic])
            if publisher.topic in sent and sent[publisher.topic][0].ros2 in _COMMANDS:
                self._report(publisher, "publishes it, too: a robot obeys one; --remap ours")
        for subscriber in self._ripe(watch.subscribers):
            if subscriber.topic in sent:
                self._judge_subscriber(subscriber, *sent[subscriber.topic])

    def _ripe(self, endpoints: Mapping[bytes, Endpoint]) -> Iterator[Endpoint]:
        """Yield the endpoints whose time to be judged has come."""
        for gid, endpoint in endpoints.items():
            if gid in self._judged:
                continue
            self._looks[gid] = self._looks.get(gid, 0) + 1
            if self._nodes.knows(endpoint) or self._looks[gid] > _PATIENCE:
                self._judged.add(gid)
                yield endpoint

    def _judge_publisher(self, publisher: Endpoint, ours: Subscription) -> None:
        """Report a publisher whose messages do not arrive here."""
        if publisher.kind not in ours.kinds:
            self._report(
                publisher,
                f"publishes {publisher.kind}, expected {' or '.join(ours.kinds)}: it is not read; "
                "--remap reads another topic",
            )
        elif not any(publisher.profile.can_serve(asked) for asked in ours.profiles):
            asked = ours.profiles[-1]
            self._report(
                publisher,
                f"offers {publisher.profile}, expected {asked}: nothing arrives; publish it with "
                "that quality of service",
            )

    def _judge_subscriber(self, subscriber: Endpoint, topic: Topic, latch: bool) -> None:
        """Report a subscriber that gets nothing from us."""
        ours, kind = publisher_profile(topic, latch), topic.type_name(2)
        if subscriber.kind != kind:
            stamped = "; --stamped publishes that" if topic.ros2 == topics.TWIST.ros2 else ""
            self._report(
                subscriber, f"expects {subscriber.kind}, got {kind}: nothing arrives there{stamped}"
            )
        elif not ours.can_serve(subscriber.profile):
            self._report(
                subscriber,
                f"asks for {subscriber.profile}, got {ours}: nothing arrives there; subscribe with "
                "that quality of service",
            )

    def _report(self, endpoint: Endpoint, text: str) -> None:
        """Report an endpoint."""
        self._status(f"{endpoint.topic}: {self._nodes.node_of(endpoint)} {text}")
