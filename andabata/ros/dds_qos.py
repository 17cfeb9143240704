"""Quality of service of topics in ROS 2, as far as it decides whether two endpoints match."""

from dataclasses import dataclass
from typing import Any

from andabata.records import topics
from andabata.records.topics import Topic

_DEPTH = 200
"""Number of messages that wait for a slow subscriber: two seconds of the fastest topic."""

_CLOUD_DEPTH = 20
"""Number of clouds that wait."""

_BLOCKING_TIME = 10_000_000
"""Longest time that a slow subscriber may block a publisher [ns]; then the message is dropped."""

EVENTS = frozenset({topics.GOAL, topics.GOAL_REACHED, topics.INITIAL_POSE, topics.TF_STATIC})
"""Topics that are sent once: none of their messages may be lost."""

_SENSORS = frozenset(
    {
        topics.SCAN,
        topics.HEAD_ANGLE,
        topics.ENCODERS,
        topics.IMU,
        topics.MAG,
        topics.FIX,
        topics.LASER_CLOUD,
    }
)
"""Topics that drivers publish with ROS 2's profile of sensor data."""


@dataclass(frozen=True)
class Profile:
    """Profile of an endpoint.

    Attributes:
        is_reliable: True if lost messages are sent again.
        is_latched: True if later subscribers get the last messages (transient local).
        depth: Number of messages that are kept.
    """

    is_reliable: bool
    is_latched: bool
    depth: int = _DEPTH

    def __str__(self) -> str:
        """Return the profile in the words of ``ros2 topic info -v``."""
        reliability = "RELIABLE" if self.is_reliable else "BEST_EFFORT"
        return f"{reliability}, {'TRANSIENT_LOCAL' if self.is_latched else 'VOLATILE'}"

    def can_serve(self, subscriber: "Profile") -> bool:
        """Return True if a publisher of this profile can serve a subscriber."""
        return self.is_reliable >= subscriber.is_reliable and (
            self.is_latched >= subscriber.is_latched
        )

    def dds(self) -> Any:  # noqa: ANN401 - cyclonedds' type.
        """Return the profile as cyclonedds' policies."""
        from cyclonedds.qos import Policy, Qos

        history = Policy.History.KeepLast(self.depth)
        policies = [
            Policy.Reliability.Reliable(_BLOCKING_TIME)
            if self.is_reliable
            else Policy.Reliability.BestEffort,
            Policy.Durability.TransientLocal if self.is_latched else Policy.Durability.Volatile,
            history,
            Policy.WriterDataLifecycle(autodispose=False),
            Policy.DataRepresentation(use_cdrv0_representation=True),
            Policy.IgnoreLocal.Participant,
        ]
        if self.is_latched:
            service = Policy.DurabilityService(
                cleanup_delay=0,
                history=history,
                max_samples=-1,
                max_instances=-1,
                max_samples_per_instance=-1,
            )
            policies.append(service)
        return Qos(*policies)

    @classmethod
    def of(cls, qos: Any) -> "Profile":  # noqa: ANN401 - cyclonedds' type.
        """Return the profile of discovered policies."""
        from cyclonedds.qos import Policy

        return cls(
            isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable),
            qos[Policy.Durability] is not Policy.Durability.Volatile,
        )


def publisher_profile(topic: Topic, latch: bool) -> Profile:
    """Return the profile with which a topic is published.

    Sensors have that of drivers. All else is reliable, which serves subscribers of either kind.

    Args:
        topic: The topic.
        latch: True to send the last message to later subscribers, too.
    """
    if latch:
        return Profile(is_reliable=True, is_latched=True, depth=1)
    depth = _CLOUD_DEPTH if topic.kind == topics.POINT_CLOUD else _DEPTH
    return Profile(is_reliable=topic not in _SENSORS, is_latched=False, depth=depth)


def subscriber_profiles(topic: Topic) -> tuple[Profile, ...]:
    """Return the profiles with which a topic is received.

    Best effort accepts every publisher. Events are received twice: from publishers that keep their
    last message, and from those that do not, which a subscriber cannot ask for both. So are paths,
    which a planner may send once.
    """
    if topic in EVENTS or topic.kind == topics.PATH:
        return Profile(True, True, 100), Profile(True, False, 100)
    return (Profile(is_reliable=False, is_latched=False),)
