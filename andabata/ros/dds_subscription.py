"""Subscription of one topic in a ROS 2 graph, in all types that it is accepted in."""

import threading
from collections.abc import Callable, Iterable
from typing import Any

from andabata.records.topics import RosMessage, Topic, message_types
from andabata.ros.dds_discovery import Endpoint
from andabata.ros.dds_qos import Profile
from andabata.ros.dds_types import raw_type

_WAIT = 200_000_000
"""Time after which a waiting thread looks whether it is to end [ns]."""

_MOST = 100
"""Number of messages that are taken at once."""


class Subscription:
    """Readers of one topic, with a thread that passes their messages on.

    Attributes:
        topic: The topic.
        name: Its name in the graph.
        kinds: Message types that it is accepted in.
        profiles: Qualities of service that are asked of publishers: any of them is enough.
    """

    def __init__(
        self,
        participant: Any,  # noqa: ANN401 - cyclonedds' type.
        topic: Topic,
        name: str,
        kinds: tuple[str, ...],
        profiles: tuple[Profile, ...],
        take: Callable[[Topic, RosMessage], None],
    ) -> None:
        """Begin to receive messages of the first type.

        Args:
            participant: Participant of the domain.
            topic: The topic.
            name: Its name in the graph.
            kinds: Message types that it is accepted in, the likeliest first.
            profiles: Profiles of the readers.
            take: Function of the topic and a message.
        """
        from cyclonedds.core import WaitSet

        self.topic, self.name, self.kinds, self.profiles = topic, name, kinds, profiles
        self._participant, self._take, self._closed = participant, take, False
        self._readers: dict[str, list[Any]] = {}
        self._last: dict[int, int] = {}
        self._waitset = WaitSet(participant)
        self._lock = threading.Lock()
        self._open(kinds[0])
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def gids(self) -> list[bytes]:
        """Identifiers of the readers."""
        return [reader.guid.bytes for group in self._readers.values() for reader in group]

    def adopt_types(self, publishers: Iterable[Endpoint]) -> None:
        """Receive the other accepted types, too, that publishers of the topic have."""
        for publisher in publishers:
            is_new = publisher.kind in self.kinds and publisher.kind not in self._readers
            if publisher.topic == self.name and is_new:
                self._open(publisher.kind)

    def _open(self, kind: str) -> None:
        """Create the readers of a message type."""
        from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic as DdsTopic

        unread = SampleState.NotRead | ViewState.Any | InstanceState.Any
        topic = DdsTopic(self._participant, f"rt{self.name}", raw_type(kind, message_types(2)))
        readers = [DataReader(self._participant, topic, each.dds()) for each in self.profiles]
        with self._lock:
            self._readers[kind] = readers
            for reader in readers:
                condition = ReadCondition(reader, unread)
                reader.unread = condition
                self._waitset.attach(condition)

    def _run(self) -> None:
        """Pass messages on until the end."""
        while not self._closed:
            if self._waitset.wait(_WAIT):
                with self._lock:
                    groups = [
                        (kind, each) for kind, group in self._readers.items() for each in group
                    ]
                for kind, reader in groups:
                    self._pass_on(kind, reader)

    def _pass_on(self, kind: str, reader: Any) -> None:  # noqa: ANN401 - cyclonedds' type.
        """Pass the messages of a reader on; two readers get some messages both."""
        store = message_types(2)
        for sample in reader.take(_MOST):
            if not hasattr(sample, "data_bytes"):
                continue  # A publisher that left.
            info = sample.sample_info
            publisher, stamp = info.publication_handle, info.source_timestamp
            if len(self.profiles) > 1 and stamp <= self._last.get(publisher, -1):
                continue
            self._last[publisher] = stamp
            self._take(self.topic, store.deserialize_cdr(sample.data_bytes, kind))

    def close(self) -> None:
        """Stop receiving."""
        self._closed = True
        self._thread.join()
