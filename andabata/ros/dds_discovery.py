"""Discovery in a ROS 2 graph: names of the nodes, and endpoints that others have of our topics."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

from andabata.ros.dds_configuration import gid_size
from andabata.ros.dds_qos import Profile
from andabata.ros.dds_types import message_kind, raw_sample, raw_type

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

_INFO = "rmw_dds_common/msg/ParticipantEntitiesInfo"
_TOPIC = "ros_discovery_info"
_PREFIX = "rt/"
"""Beginning of the names of ROS 2's topics in DDS."""

_OLD_GID = 24
"""Size of an identifier before Iron [bytes]."""

_MOST = 1000
"""Number of messages that are taken at once."""


@dataclass(frozen=True)
class Endpoint:
    """Publisher or subscriber of another process.

    Attributes:
        gid: Its identifier.
        topic: Name of the topic, as ROS 2 has it.
        kind: Message type, as ``package/msg/Name``.
        profile: Quality of service that it offers or asks for.
    """

    gid: bytes
    topic: str
    kind: str
    profile: Profile


class EndpointWatch:
    """Publishers and subscribers of other processes.

    Attributes:
        publishers: Publishers by their identifier.
        subscribers: Subscribers by their identifier.
        participants: Identifiers of the processes that are there.
    """

    def __init__(self, participant: Any) -> None:  # noqa: ANN401 - cyclonedds' type.
        """Begin to watch, as a participant of a domain."""
        from cyclonedds.builtin import (
            BuiltinDataReader,
            BuiltinTopicDcpsParticipant,
            BuiltinTopicDcpsPublication,
            BuiltinTopicDcpsSubscription,
        )

        self._own = participant.guid.bytes
        self._readers = (
            BuiltinDataReader(participant, BuiltinTopicDcpsPublication),
            BuiltinDataReader(participant, BuiltinTopicDcpsSubscription),
        )
        self._processes = BuiltinDataReader(participant, BuiltinTopicDcpsParticipant)
        self.participants: set[bytes] = set()
        self.publishers: dict[bytes, Endpoint] = {}
        self.subscribers: dict[bytes, Endpoint] = {}

    def poll(self) -> None:
        """Take note of what came and went since the last call."""
        from cyclonedds.core import InstanceState

        for sample in self._processes.take(_MOST):
            is_alive = sample.sample_info.instance_state == InstanceState.Alive
            change = self.participants.add if is_alive else self.participants.discard
            change(sample.key.bytes)
        for reader, known in zip(self._readers, (self.publishers, self.subscribers), strict=True):
            for sample in reader.take(_MOST):
                gid = sample.key.bytes
                if sample.sample_info.instance_state != InstanceState.Alive:
                    known.pop(gid, None)
                elif sample.participant_key.bytes != self._own and sample.topic_name.startswith(
                    _PREFIX
                ):
                    known[gid] = Endpoint(
                        gid,
                        sample.topic_name.removeprefix("rt"),
                        message_kind(sample.type_name),
                        Profile.of(sample.qos),
                    )


class NodeDirectory:
    """Announces our node to the graph, and knows the nodes of others."""

    def __init__(
        self,
        participant: Any,  # noqa: ANN401 - cyclonedds' type.
        node: tuple[str, str],
        environment: Mapping[str, str],
    ) -> None:
        """Announce a node without endpoints.

        Args:
            participant: Participant of the domain.
            node: Namespace and name of the node.
            environment: Environment variables.
        """
        from cyclonedds.pub import DataWriter
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        self._size, self._node = gid_size(environment), node
        self._gid = participant.guid.bytes
        self._store = _definitions(self._size)
        self._raw = raw_type(_INFO, self._store)
        topic = Topic(participant, _TOPIC, self._raw)
        self._writer = DataWriter(participant, topic, Profile(True, True, 1).dds())
        self._reader = DataReader(participant, topic, Profile(True, True, _MOST).dds())
        self._names: dict[bytes, str] = {}
        self._nodes: dict[bytes, tuple[str, ...]] = {}

    def announce(self, readers: list[bytes], writers: list[bytes]) -> None:
        """Publish the identifiers of our endpoints."""
        types = self._store.types
        namespace, name = self._node
        entities = types["rmw_dds_common/msg/NodeEntitiesInfo"](
            node_namespace=namespace or "/",
            node_name=name,
            reader_gid_seq=[self._identifier(gid) for gid in readers],
            writer_gid_seq=[self._identifier(gid) for gid in writers],
        )
        info = types[_INFO](gid=self._identifier(self._gid), node_entities_info_seq=[entities])
        data = bytes(self._store.serialize_cdr(info, _INFO))
        self._writer.write(raw_sample(self._raw, data))

    def poll(self) -> None:
        """Take note of the nodes that were announced since the last call."""
        for sample in self._reader.take(_MOST):
            if not hasattr(sample, "data_bytes"):
                continue
            info: Any = self._store.deserialize_cdr(sample.data_bytes, _INFO)
            gid = bytes(info.gid.data)
            if gid[: len(self._gid)] == self._gid:
                continue
            nodes = [(_full_name(each), each) for each in info.node_entities_info_seq]
            self._nodes[gid] = tuple(name for name, _ in nodes)
            for name, each in nodes:
                for endpoint in (*each.reader_gid_seq, *each.writer_gid_seq):
                    self._names[bytes(endpoint.data)[: len(self._gid)]] = name

    def knows(self, endpoint: Endpoint) -> bool:
        """Return True if the node that has an endpoint is known."""
        return endpoint.gid in self._names

    def node_of(self, endpoint: Endpoint) -> str:
        """Return the node that has an endpoint, in words."""
        name = self._names.get(endpoint.gid)
        return "a process without a node" if name is None else f"node {name}"

    def owners(self, node: str) -> Iterator[bytes]:
        """Yield the participants that have announced a node of a full name."""
        return (gid[:16] for gid, names in self._nodes.items() if node in names)

    def _identifier(self, gid: bytes) -> Any:  # noqa: ANN401 - a message.
        """Return an identifier as a message."""
        import numpy as np

        data = np.frombuffer(gid.ljust(self._size, b"\0")[: self._size], dtype=np.uint8)
        return self._store.types["rmw_dds_common/msg/Gid"](data=data)


@cache
def _definitions(size: int) -> "Typestore":
    """Return the definitions of the announcements with identifiers of a size [bytes]."""
    from rosbags.typesys import Stores, get_typestore

    return get_typestore(Stores.ROS2_HUMBLE if size == _OLD_GID else Stores.ROS2_JAZZY)


def _full_name(node: Any) -> str:  # noqa: ANN401 - a message.
    """Return the name of an announced node with its namespace."""
    return f"{node.node_namespace.rstrip('/')}/{node.node_name}"
