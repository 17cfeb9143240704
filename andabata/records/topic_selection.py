"""Selection of the topics to read from a recording, by names, types and frames."""

from collections import Counter
from collections.abc import Mapping

from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.records.decoding.accepted_types import OLD_POINT_CLOUD, accepted_types, full_type
from andabata.records.decoding.sensor_decoder import SWEEPS, SensorDecoder, frame_of
from andabata.records.decoding.source_choice import ReadingSource
from andabata.records.frames.names import FrameError
from andabata.records.remarks import Remarks
from andabata.records.topics import POINT_CLOUD, TOPICS, Topic

Remapping = Mapping[str, str]
"""Names that a recording uses, by our names of ROS 1."""

LEFT_OUT = "(left out)"
"""Name of a topic that is not read: no recording has it."""

_OPTIONAL = (
    topics.INITIAL_POSE,
    topics.FILTERED_ODOMETRY,
    topics.DIAGNOSTICS,
    topics.VIRTUAL_SCAN,
    topics.WHEEL_COMMAND,
)
"""Topics that are read where they are recorded, besides the sensors'."""


def topic_names(selected: tuple[Topic, ...], remapping: Remapping) -> dict[str, Topic]:
    """Return topics by their remapped name, or by both of their own.

    Args:
        selected: Topics to read.
        remapping: Names that the recording uses.
    """
    return {
        name: topic
        for topic in selected
        for name in (
            (remapping[topic.ros1],) if topic.ros1 in remapping else (topic.ros1, topic.ros2)
        )
    }


def choose_cloud(bag: Bag, name: str | None) -> Topic | None:
    """Return the 3D laser's topic to replay, None for the rotating laser's own two.

    Args:
        bag: Recording to read.
        name: Name that the user gives; None for the rotating laser, or, where it is missing, the
            only cloud in the laser's or the base's frame.

    Raises:
        BagError: If the recording lacks it, or holds several to choose from.
    """
    accepted = (POINT_CLOUD, OLD_POINT_CLOUD)
    clouds = sorted(n for n, (kind, _) in bag.topics.items() if full_type(kind) in accepted)
    if name is None:
        if all({t.ros1, t.ros2} & set(bag.topics) for t in SWEEPS):
            return None
        names = [
            n for n in clouds if n in (topics.LASER_CLOUD.ros1, topics.LASER_CLOUD.ros2)
        ] or clouds
        if not names:
            return None
        if len(names) > 1:
            raise BagError(f"--cloud: expected one of {', '.join(names)}, got none; choose one")
        name = names[0]
    if name not in clouds:
        listed = ", ".join(clouds) or "no cloud"
        kind = f" of {bag.topics[name][0]}" if name in bag.topics else ""
        raise BagError(f"--cloud: expected one of {listed}, got {name}{kind}")
    return Topic(name, name, POINT_CLOUD, None)


def select_topics(bag: Bag, sensor_decoder: SensorDecoder, remapping: Remapping) -> Remapping:
    """Return the names to read: the remapping, and a choice where a topic has both of its names.

    Args:
        bag: Recording to read.
        sensor_decoder: Decoder of the wanted topics, whose remarks name what is left out or
            missing.
        remapping: Names that the user gives.

    Raises:
        BagError: If sensors are missing, with the topics that were found, or have a type that is
            not accepted.
    """
    recorded = bag.topics
    unknown = sorted(set(remapping) - {topic.ros1 for topic in TOPICS})
    if unknown:
        known = ", ".join(topic.ros1 for topic in TOPICS)
        raise BagError(f"--map: expected one of {known} before the sign, got {unknown[0]}")
    needed = [t for t in sensor_decoder.wanted if t not in (topics.FIX, topics.GOAL)]
    missing = [t.ros1 for t in needed if not set(topic_names((t,), remapping)) & set(recorded)]
    if missing:
        listed = ", ".join(f"{name} ({kind})" for name, (kind, _) in sorted(recorded.items()))
        raise BagError(
            f"{bag.path}: expected the topics {', '.join(missing)}, got {listed or 'none'}; --map "
            "gives their names in the recording, and `andabata scan --topic` evaluates a single "
            "cloud"
        )
    selected = dict(remapping)
    for topic in (*sensor_decoder.wanted, *_OPTIONAL):
        name = _choose_name(bag, topic, topic in needed, remapping, sensor_decoder.remarks)
        if name is not None:
            selected[topic.ros1] = name
    if not set(topic_names((topics.FIX,), selected)) & set(recorded):
        text = "missing: positions are counted from the start"
        sensor_decoder.remarks.note(topics.FIX.ros1, text)
    return selected


def _choose_name(
    bag: Bag, topic: Topic, needed: bool, remapping: Remapping, remarks: Remarks
) -> str | None:
    """Return the name by which a topic is read, None without a choice.

    Raises:
        BagError: If it is needed, or named by the user, and has another type.
    """
    recorded, accepted = bag.topics, accepted_types(topic)
    names = [name for name in topic_names((topic,), remapping) if name in recorded]
    if not names:
        if topic.ros1 in remapping:
            listed = ", ".join(sorted(recorded)) or "none"
            raise BagError(
                f"--map {topic.ros1}: expected one of {listed}, got {remapping[topic.ros1]}"
            )
        return None
    fitting = [name for name in names if full_type(recorded[name][0]) in accepted]
    if not fitting:
        text = f"expected {' or '.join(accepted)}, got {recorded[names[0]][0]}"
        if needed or topic.ros1 in remapping:
            raise BagError(f"{names[0]}: {text}; --map names another topic for {topic.ros1}")
        remarks.note(names[0], f"{text}: left out")
        return LEFT_OUT
    filled = [name for name in fitting if recorded[name][1]] or fitting
    for other in names:
        if other != filled[0]:
            text = f"{filled[0]} is read instead; --map {topic.ros1}={other} reads this one"
            remarks.note(other, text)
    return filled[0] if len(names) > 1 else None


def choose_sources(
    bag: Bag, chosen: Mapping[str, str], remapping: Remapping, remarks: Remarks
) -> None:
    """Let a recording read one source alone of topics on which several publish.

    Args:
        bag: Recording to read, whose ``sources`` are set.
        chosen: Frame, node or joints of the source that the user gives, by our names of topics.
        remapping: Names that the recording uses.
        remarks: Destination of remarks.

    Raises:
        BagError: If there is no such topic, or it has no such source.
    """
    unknown = sorted(set(chosen) - {topic.ros1 for topic in TOPICS})
    if unknown:
        known = ", ".join(topic.ros1 for topic in TOPICS)
        raise BagError(f"--source: expected one of {known} before the sign, got {unknown[0]}")
    for topic in TOPICS:
        if topic.ros1 not in chosen:
            continue
        name = chosen[topic.ros1]
        names = [n for n in topic_names((topic,), remapping) if n in bag.topics]
        counts = Counter(
            ReadingSource.of(message.content, message.publisher)
            for message in (bag.messages(tuple(names)) if names else ())
        )
        if not any(source.is_called(name) for source in counts):
            listed = ", ".join(str(source) for source in counts) or "no messages"
            raise BagError(f"--source {topic.ros1}: expected one of {listed}, got {name}")
        left_out = sum(n for source, n in counts.items() if not source.is_called(name))
        if left_out:
            text = f"{left_out} messages of other sources than {name} are not read (--source)"
            remarks.note(topic.ros1, text)
        bag.sources |= dict.fromkeys(names, name)


def check_frames(bag: Bag, sensor_decoder: SensorDecoder, remapping: Remapping) -> None:
    """Check that the pose of each sensor is known, by the frame of its first message.

    Args:
        bag: Recording to read.
        sensor_decoder: Decoder with the extrinsics.
        remapping: Names that the recording uses.

    Raises:
        FrameError: If one is unknown; the message names the sensor and the option to give.
    """
    for topic in sensor_decoder.wanted:
        sensor = sensor_decoder.sensor_of(topic)
        names = tuple(topic_names((topic,), remapping)) if sensor is not None else ()
        first = next(bag.messages(names), None) if names else None
        if sensor is None or first is None or not hasattr(first.content, "header"):
            continue
        try:
            sensor_decoder.extrinsics.pose_of(sensor, frame_of(first.content))
        except FrameError as error:
            option = f"--mounting {sensor}=X,Y,Z,ROLL,PITCH,YAW gives its pose"
            raise FrameError(f"{sensor}: {error}; {option}") from error
