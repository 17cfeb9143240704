"""Live graph of ROS 2: publishers and subscribers of our topics by DDS, without ROS."""

import os
import threading
import time
from collections.abc import Callable
from functools import cache
from typing import Any

from andabata.distribution import install_extra
from andabata.records.decoding.accepted_types import accepted_types
from andabata.records.messages import NS
from andabata.records.topics import Ros, RosMessage, Topic, message_types
from andabata.ros.dds_configuration import configuration, domain_id
from andabata.ros.dds_discovery import EndpointWatch, NodeDirectory
from andabata.ros.dds_qos import publisher_profile, subscriber_profiles
from andabata.ros.dds_subscription import Subscription
from andabata.ros.dds_types import raw_sample, raw_type
from andabata.ros.endpoint_check import EndpointCheck
from andabata.ros.graph import RosError, TopicNames
from andabata.ros.graph_clock import GraphClock, SimulatedClock, WallClock

CLOCK = Topic("/clock", "/clock", "rosgraph_msgs/msg/Clock", None)

_DISCOVERY_PERIOD = 0.2
"""Time between two looks at who is there [s]."""

_NAME_PERIODS = 5
"""Number of such looks in which nodes of our own name are searched for before we begin."""

_LEASE_PERIODS = 65
"""Number of looks after which a process that was killed is no longer announced: 13 s."""


class Ros2Graph:
    """Node of this process: publishes written messages and passes received ones on, by DDS."""

    ros: Ros = 2

    def __init__(
        self,
        name: str,
        names: TopicNames | None = None,
        use_sim_time: bool = False,
        status: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Join the domain and announce the node.

        Args:
            name: Name of the node.
            names: Names of the topics; None for our own.
            use_sim_time: True to take the time of ``/clock``.
            status: Function called with a line of text for the user.

        Raises:
            RosError: If DDS is not installed or its configuration is broken, or another node has
                the same name.
        """
        self._names, self._status = names or TopicNames(2), status
        self._full_name = f"{self._names.namespace}/{name}"
        self._participant = _join(os.environ)
        self._watch = EndpointWatch(self._participant)
        self._nodes = NodeDirectory(
            self._participant, (self._names.namespace, name), dict(os.environ)
        )
        self._wait_for_our_name()
        self._check = EndpointCheck(self._nodes, status)
        self._writers: dict[Topic, tuple[Any, Any]] = {}
        self._latched: dict[Topic, bool] = {}
        self._subscriptions: list[Subscription] = []
        self._lock, self._closed = threading.RLock(), threading.Event()
        self._announced: tuple[int, int] = (-1, -1)
        self.dropped = 0
        self._clock: GraphClock = WallClock()
        if use_sim_time:
            self._clock = clock = SimulatedClock()
            self.subscribe(CLOCK, lambda _, message: clock.set(_nanoseconds(message.clock)))
        self._discovery = threading.Thread(target=self._discover, daemon=True)
        self._discovery.start()

    def _wait_for_our_name(self) -> None:
        """Wait until no other node has our name; one that was killed is forgotten after a while.

        Raises:
            RosError: If another node keeps it.
        """
        for k in range(_NAME_PERIODS + _LEASE_PERIODS):
            time.sleep(_DISCOVERY_PERIOD)
            self._watch.poll()
            self._nodes.poll()
            owners = self._watch.participants & set(self._nodes.owners(self._full_name))
            if not owners and k >= _NAME_PERIODS:
                return
            if owners and k == _NAME_PERIODS:
                self._status(f"node {self._full_name} is on the graph already: waiting for its end")
        raise RosError(
            f"{self._full_name}: expected no other node of this name, got one in domain "
            f"{domain_id(os.environ)}; end it, or give --namespace or another ROS_DOMAIN_ID"
        )

    def _discover(self) -> None:
        """Follow who comes and goes until the end."""
        while not self._closed.wait(_DISCOVERY_PERIOD):
            with self._lock:
                self._watch.poll()
                self._nodes.poll()
                for subscription in self._subscriptions:
                    subscription.adopt_types(self._watch.publishers.values())
                self._check.poll(self._watch, self._subscriptions, self._latched, self._names)
                self._announce()

    def _announce(self) -> None:
        """Announce our endpoints if there are new ones."""
        readers = [gid for each in self._subscriptions for gid in each.gids]
        writers = [writer.guid.bytes for writer, _ in self._writers.values()]
        if (len(readers), len(writers)) != self._announced:
            self._announced = len(readers), len(writers)
            self._nodes.announce(readers, writers)

    def now_ns(self) -> int:
        """Return the graph's time [ns]; see ``Graph``."""
        return self._clock.now_ns()

    def wait_for_clock(self) -> None:
        """Wait until the graph has a time; see ``Graph``."""
        waited = 0
        while not self.now_ns():
            time.sleep(0.01)
            waited += 1
            if waited == 500:
                self._status("waiting for /clock: play with `ros2 bag play --clock`")

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time of the graph; see ``Graph``."""
        self._clock.sleep_until(stamp_ns)

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Publish a message; one that no subscriber could take in time is dropped and counted."""
        from cyclonedds.core import DDSException

        if topic not in self._writers:
            self.advertise(topic)
        writer, raw = self._writers[topic]
        data = bytes(message_types(2).serialize_cdr(message, topic.type_name(2)))
        try:
            writer.write(raw_sample(raw, data))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise RosError(
                    f"{self._names.of(topic)}: expected to publish, got {error}"
                ) from error
            self.dropped += 1

    def advertise(self, topic: Topic, latch: bool = False) -> None:
        """Create the publisher of a topic; see ``Graph``."""
        from cyclonedds.pub import DataWriter

        name, raw = self._names.of(topic), raw_type(topic.type_name(2), message_types(2))
        with self._lock:
            entity = _topic(self._participant, name, raw)
            profile = publisher_profile(topic, latch)
            self._latched[topic] = latch
            self._writers[topic] = DataWriter(self._participant, entity, profile.dds()), raw

    def subscribe(self, topic: Topic, take: Callable[[Topic, RosMessage], None]) -> None:
        """Call a function with each message of a topic; see ``Graph``.

        Messages of any type that the topic is accepted in are taken.
        """
        store = message_types(2)
        kinds = tuple(kind for kind in accepted_types(topic) if kind in store.fielddefs)
        with self._lock:
            self._subscriptions.append(
                Subscription(
                    self._participant,
                    topic,
                    self._names.of(topic),
                    kinds,
                    subscriber_profiles(topic),
                    take,
                )
            )

    @property
    def is_shutdown(self) -> bool:
        """True if the node was closed."""
        return self._closed.is_set()

    def close(self) -> None:
        """Leave the graph."""
        self._closed.set()
        self._discovery.join()
        for subscription in self._subscriptions:
            subscription.close()
        self._participant._delete(self._participant._ref)


def _join(environment: Any) -> Any:  # noqa: ANN401 - cyclonedds' type.
    """Return a participant of the domain that the environment asks for.

    Raises:
        RosError: If DDS is not installed or its configuration is broken.
    """
    try:
        from cyclonedds.core import DDSException
        from cyclonedds.domain import DomainParticipant
        from cyclonedds.qos import Policy, Qos
    except ImportError as error:
        raise RosError(
            f"cyclonedds: expected DDS, got {error}; install it with `{install_extra('ros2')}`"
        ) from error
    number, text = domain_id(environment), configuration(environment)
    try:
        _domain(number, text)
        # Nodes of ROS 2 look for it to tell participants of ROS from others.
        return DomainParticipant(number, Qos(Policy.Userdata(b"enclave=/;")))
    except DDSException as error:
        user = environment.get("CYCLONEDDS_URI")
        cause = f"CYCLONEDDS_URI={user}" if user else "the network's interfaces"
        step = "mend the file or unset CYCLONEDDS_URI" if user else "check `ip address`"
        raise RosError(
            f"DDS: expected to join domain {number}, got a refusal with {cause}, whose reason "
            f"Cyclone DDS has printed; {step}"
        ) from error


@cache
def _domain(number: int, text: str) -> Any:  # noqa: ANN401 - cyclonedds' type.
    """Return the domain of a number, configured; a process has one of each."""
    from cyclonedds.domain import Domain

    return Domain(number, text)


def _topic(participant: Any, name: str, raw: Any) -> Any:  # noqa: ANN401 - cyclonedds' types.
    """Return DDS's topic of a name of ROS 2."""
    from cyclonedds.topic import Topic as DdsTopic

    return DdsTopic(participant, f"rt{name}", raw)


def _nanoseconds(stamp: RosMessage) -> int:
    """Return a time of a message [ns]."""
    return int(stamp.sec) * NS + int(stamp.nanosec)
