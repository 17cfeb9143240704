"""SensorReadings from a recording: what the robot's navigator is given, period by period."""

import itertools
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.datum import (
    Datum,
    consistent_fixes,
    datum_of_heading,
    make_datum,
    refused_fixes,
)
from andabata.localization.fix_check import check_fixes
from andabata.localization.initial_pose import initial_pose
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.records import topics
from andabata.records.bag_pieces import Survey
from andabata.records.bags import Bag, BagError
from andabata.records.frames import FrameError
from andabata.records.messages import NS, header_ns, pose_of
from andabata.records.mounts import Mounts
from andabata.records.recorder import DATUM, SETUP
from andabata.records.remarks import Remarks
from andabata.records.sense_decoding import OLD_POINT_CLOUD, MessageDecoder, accepted_types
from andabata.records.sensor_decoder import SWEEPS, SensorDecoder, frame_of
from andabata.records.topics import POINT_CLOUD, TOPICS, Topic
from worlds.world import Geofence

CONTROL_HZ = 10
"""Control periods of a second where no recorded command ends them."""

_FIRST_FIXES = 30.0
"""Span of the first fixes, which have to fit each other [s]."""

_FIRST_WORDS = 100
"""Number of diagnostics in which a recording of ours says what its datum is."""


@dataclass(frozen=True)
class Setup:
    """How a recorded drive began.

    Attributes:
        start: Where the robot believed to be.
        epoch_ns: Stamp of that [ns]; times are counted from there.
        settings: The drive's settings, empty in a recording that is not ours.
        rough: Whether the start is only what the first senses tell.
        datum: Datum of the map, None where the settings name it, or nothing does.
        refused: Number of fixes before the start that could not be used, by reason.
    """

    start: Pose
    epoch_ns: int
    settings: dict[str, Any]
    rough: bool = False
    datum: Datum | None = None
    refused: Mapping[str, int] = field(default_factory=dict)

    @property
    def geofence(self) -> Geofence | None:
        """Where the robot was allowed to be; None is everywhere.

        Raises:
            BagError: If the recording says it in another way.
        """
        geofence = self.settings.get("geofence")
        if geofence is None:
            return None
        try:
            x_min, y_min, x_max, y_max = map(float, geofence)
        except (TypeError, ValueError):
            raise BagError(
                f"geofence: expected x_min, y_min, x_max, y_max [m], got {geofence!r}; record it again"
            ) from None
        return x_min, y_min, x_max, y_max


@dataclass(frozen=True)
class Period:
    """A recorded control period.

    Attributes:
        readings: What was sensed in it.
        goal: The goal at its end, None before the first [m], shape (2,).
        ranges: The virtual scan that was made then, None without one.
        wheels: The wheel speeds that were commanded then, None without.
    """

    readings: SensorReadings
    goal: NDArray[np.float64] | None
    ranges: NDArray[np.float32] | None
    wheels: WheelSpeeds | None


def choose_cloud(bag: Bag, name: str | None) -> Topic | None:
    """Return the 3D laser's topic to replay, None for the turning laser's own two.

    Args:
        bag: The recording.
        name: As the user says; None for the turning laser, or, where it is missing, the only
            cloud in the laser's or the base's frame.

    Raises:
        BagError: If the recording lacks it, or holds several to choose from.
    """
    clouds = sorted(
        n for n, (kind, _) in bag.topics.items() if _typed(kind) in (POINT_CLOUD, OLD_POINT_CLOUD)
    )
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
        found = ", ".join(clouds) or "no cloud"
        kind = f" of {bag.topics[name][0]}" if name in bag.topics else ""
        raise BagError(f"--cloud: expected one of {found}, got {name}{kind}")
    return Topic(name, name, POINT_CLOUD, None)


Renamed = Mapping[str, str]
"""The names that a recording uses, by ours of ROS 1."""


LEFT_OUT = "(left out)"
"""The name of a topic that is not read: no recording has it."""


def check_topics(bag: Bag, sensor_decoder: SensorDecoder, renamed: Renamed) -> Renamed:
    """Refuse a recording without the robot's senses, or with other types under their names.

    Args:
        bag: The recording.
        sensor_decoder: Its remarks say what is left out, or missing and not needed.
        renamed: What the user says of names.

    Returns:
        What to read: ``renamed``, and a choice where both of a topic's names are there.

    Raises:
        BagError: If some are missing; the message names them and what was found. Or if one has a
            type that tells nothing of it.
    """
    there = bag.topics
    unknown = sorted(set(renamed) - {topic.ros1 for topic in TOPICS})
    if unknown:
        known = ", ".join(topic.ros1 for topic in TOPICS)
        raise BagError(f"--map: expected one of {known} before the sign, got {unknown[0]}")
    needed = [t for t in sensor_decoder.wanted if t not in (topics.FIX, topics.GOAL)]
    missing = [t.ros1 for t in needed if not set(_names((t,), renamed)) & set(there)]
    if missing:
        found = ", ".join(f"{name} ({kind})" for name, (kind, _) in sorted(there.items())) or "none"
        raise BagError(
            f"{bag.path}: expected the topics {', '.join(missing)}, got {found}; --map names those "
            "that are called otherwise, and `andabata scan --topic` judges a single cloud"
        )
    chosen = dict(renamed)
    for topic in (*sensor_decoder.wanted, *_TYPED):
        name = _choose_name(bag, topic, topic in needed, renamed, sensor_decoder.remarks)
        if name is not None:
            chosen[topic.ros1] = name
    if not set(_names((topics.FIX,), chosen)) & set(there):
        sensor_decoder.remarks.note(
            topics.FIX.ros1, "missing: positions are counted from the start"
        )
    return chosen


def check_frames(bag: Bag, sensor_decoder: SensorDecoder, renamed: Renamed) -> None:
    """Refuse a recording of whose senses one sits nobody knows where.

    Raises:
        FrameError: If so, by the frames of each sense's first message; the message names the sense
            and the option that tells.
    """
    for topic in sensor_decoder.wanted:
        sense = sensor_decoder.sense_of(topic)
        names = tuple(_names((topic,), renamed)) if sense is not None else ()
        first = next(bag.messages(names), None) if names else None
        if sense is None or first is None or not hasattr(first.content, "header"):
            continue
        try:
            sensor_decoder.mounts.mount(sense, frame_of(first.content))
        except FrameError as error:
            option = f"--mounting {sense}=X,Y,Z,ROLL,PITCH,YAW tells where it sits"
            raise FrameError(f"{sense}: {error}; {option}") from error


_TYPED = (
    topics.INITIAL_POSE,
    topics.FILTERED_ODOMETRY,
    topics.DIAGNOSTICS,
    topics.VIRTUAL_SCAN,
    topics.WHEEL_COMMAND,
)
"""Topics that are read where they are there, besides what is sensed."""


def _choose_name(
    bag: Bag, topic: Topic, needed: bool, renamed: Renamed, remarks: Remarks
) -> str | None:
    """Return by which name to read a topic, None where nothing has to be chosen.

    Raises:
        BagError: If it is needed, or named by the user, and has another type.
    """
    there, accepted = bag.topics, accepted_types(topic)
    names = [name for name in _names((topic,), renamed) if name in there]
    if not names:
        if topic.ros1 in renamed:
            found = ", ".join(sorted(there)) or "none"
            raise BagError(
                f"--map {topic.ros1}: expected one of {found}, got {renamed[topic.ros1]}"
            )
        return None
    fitting = [name for name in names if _typed(there[name][0]) in accepted]
    if not fitting:
        text = f"expected {' or '.join(accepted)}, got {there[names[0]][0]}"
        if needed or topic.ros1 in renamed:
            raise BagError(f"{names[0]}: {text}; --map names the topic that tells {topic.ros1}")
        remarks.note(names[0], f"{text}: left out")
        return LEFT_OUT
    filled = [name for name in fitting if there[name][1]] or fitting
    for other in names:
        if other != filled[0]:
            remarks.note(other, f"{filled[0]} is read instead; --map {topic.ros1}={other} tells")
    return filled[0] if len(names) > 1 else None


def _typed(kind: str) -> str:
    """Return a type as ``package/msg/Name``, however it is written."""
    return kind if "/msg/" in kind else kind.replace("/", "/msg/", 1)


def survey(bag: Bag, cloud: Topic | None, renamed: Renamed, decoder: MessageDecoder) -> Survey:
    """Look a recording through for its clocks, its units and the drive's settings.

    Args:
        bag: The recording.
        cloud: A 3D laser's topic, None for the turning laser's two.
        renamed: What its topics are called.
        decoder: Reads what its units are judged by.

    Raises:
        BagError: If a sense that is needed says nothing.
    """
    wanted = [topic for topic in SensorDecoder(0, cloud).wanted if topic is not topics.GOAL]
    names = {n: t for n, t in _names(tuple(wanted), renamed).items() if n in bag.topics}
    found = Survey(bag, names, decoder, cloud, tuple(_names((topics.DIAGNOSTICS,), renamed)))
    silent = [n for n, count in found.counts.items() if not count and names[n] != topics.FIX]
    if silent:
        raise BagError(
            f"{bag.path}: expected messages of {', '.join(silent)}, got none; --map names another "
            "topic that tells the same"
        )
    for topic in (topics.IMU, topics.ENCODERS, topics.MAG):
        if not found.history.rows(topic):
            raise BagError(f"{bag.path}: {found.why_none(topic)}")
    return found


def read_setup(
    bag: Bag,
    given: Mapping[str, float],
    renamed: Renamed,
    decoder: MessageDecoder | None = None,
    mounts: Mounts | None = None,
) -> Setup:
    """Return how a recorded drive began: as it was told then, else as its first senses tell.

    Args:
        bag: The recording.
        given: Fields of ``GeoReference`` that the user gives, for a recording that is not ours.
        renamed: What its topics are called.
        decoder: Reads the first senses; None for one that judges their units as they come.
        mounts: Where its senses sit; None for what the frames' names say.

    Raises:
        BagError: If the recording tells no start.
        DatumError: If its fixes lie far from the datum that is given.
    """
    told = _read_told(bag, renamed)
    if told is not None and (told.settings or told.datum is not None):
        return told
    fixes, epoch_ns = read_first_fixes(bag, renamed, mounts)
    year = decimal_year(epoch_ns)
    if told is not None:
        first = _first_second(bag, told.epoch_ns, renamed, decoder, mounts)
        found = make_datum(given, fixes, year, told.start.position)
        found = found or datum_of_heading(first, told.start.yaw)
        return replace(told, datum=found.with_compass(first))
    datum = make_datum(given, fixes, year)
    setup = None if datum is None else _setup_by_senses(bag, datum, fixes, renamed, decoder, mounts)
    if setup is not None:
        return setup
    refused = refused_fixes(fixes)
    reasons = ", ".join(f"{n} fixes {reason}" for reason, n in refused.items())
    raise BagError(
        f"{bag.path}: expected {topics.INITIAL_POSE.ros1} or {topics.FILTERED_ODOMETRY.ros1} to "
        f"tell where the drive began, or {topics.IMU.ros1}, {topics.MAG.ros1} and "
        f"{topics.FIX.ros1} to find out, got neither{f' ({reasons})' if reasons else ''}"
    )


def _read_told(bag: Bag, renamed: Renamed) -> Setup | None:
    """Return the start, the settings and the datum that a recording tells, None without a start.

    A pose in a frame other than ``map`` tells no start: where that frame lies is known to nobody.
    """
    names = _names((topics.INITIAL_POSE, topics.FILTERED_ODOMETRY, topics.DIAGNOSTICS), renamed)
    start: Pose | None = None
    epoch, words, settings, datum = 0, 0, None, None
    for message in bag.messages(tuple(names)):
        topic, content = names[message.topic], message.content
        if topic in (topics.INITIAL_POSE, topics.FILTERED_ODOMETRY) and start is None:
            if str(content.header.frame_id).strip("/").rpartition("/")[2] == "map":
                start, epoch = pose_of(content.pose.pose), header_ns(content)
        elif topic is topics.DIAGNOSTICS:
            words += 1
            values = {v.key: v.value for s in content.status for v in s.values}
            if SETUP in values:
                settings = json.loads(values[SETUP])
            if DATUM in values and values[DATUM].startswith("{"):
                datum = Datum.from_dict(json.loads(values[DATUM]))
        if start is not None and (settings or datum or words > _FIRST_WORDS):
            break
    if start is None:
        return None
    source = None if datum is None else replace(datum, source="the recording")
    return Setup(start, epoch, settings or {}, datum=source)


def read_first_fixes(
    bag: Bag, renamed: Renamed, mounts: Mounts | None = None
) -> tuple[NDArray[np.float64], int]:
    """Return the first half minute of fixes, and the stamp of the first good one [ns].

    Fixes are rows as in ``SensorReadings.gnss``, shape (k, 5), with stamps since 1970.
    """
    sensor_decoder, begin, rows = SensorDecoder(0, mounts=mounts), 0, []
    names = _names((topics.FIX,), renamed)
    for message in bag.messages(tuple(names)):
        if begin and message.stamp_ns > begin + _FIRST_FIXES * NS:
            break
        sensor_decoder.add(names[message.topic], message.content, message.stamp_ns)
        found = sensor_decoder.readings(0.0).gnss
        if found is None:
            continue
        rows.append(found)
        if not begin and check_fixes(found).good.any():
            begin = message.stamp_ns
    return np.concatenate(rows) if rows else np.empty((0, 5)), begin


def _setup_by_senses(
    bag: Bag,
    datum: Datum,
    fixes: NDArray[np.float64],
    renamed: Renamed,
    decoder: MessageDecoder | None,
    mounts: Mounts | None,
) -> Setup | None:
    """Return a start at the first fix that fits, with the compass's heading and gravity's tilt.

    None if one of the three is missing.
    """
    first = fixes[consistent_fixes(fixes)]
    last, fitting = fixes[:, 0].max(initial=-np.inf), set(first[:, 0].tolist())
    names = _names((topics.IMU, topics.MAG, topics.FIX), renamed)
    sensor_decoder = SensorDecoder(0, decoder=decoder, mounts=mounts)
    for message in bag.messages(tuple(names)):
        topic = names[message.topic]
        sensor_decoder.add(topic, message.content, message.stamp_ns)
        if topic is not topics.FIX:
            continue
        readings = sensor_decoder.readings(0.0)
        rows = np.empty((0, 5)) if readings.gnss is None else readings.gnss
        kept = [row[0] > last or float(row[0]) in fitting for row in rows]
        readings = replace(readings, gnss=rows[np.array(kept, dtype=bool)])
        pose = initial_pose(readings, datum.reference)
        if pose is not None:
            return Setup(
                pose,
                message.stamp_ns + 1,
                {},
                rough=True,
                datum=datum.with_compass(readings),
                refused=refused_fixes(fixes, float(rows[-1, 0])),
            )
    return None


def _first_second(
    bag: Bag,
    epoch_ns: int,
    renamed: Renamed,
    decoder: MessageDecoder | None,
    mounts: Mounts | None,
) -> SensorReadings:
    """Return what inertial unit and compass sensed in the first second of a drive."""
    names = _names((topics.IMU, topics.MAG), renamed)
    sensor_decoder = SensorDecoder(epoch_ns, decoder=decoder, mounts=mounts)
    for message in bag.messages(tuple(names)):
        if message.stamp_ns > epoch_ns + NS:
            break
        if message.stamp_ns >= epoch_ns:
            sensor_decoder.add(names[message.topic], message.content, message.stamp_ns)
    return sensor_decoder.readings(1.0)


def read_periods(bag: Bag, sensor_decoder: SensorDecoder, renamed: Renamed) -> Iterator[Period]:
    """Yield the control periods of a recording, by the time at which its messages came in.

    Periods end with the recorded commands, and ten times a second where there are none. The period
    of the start itself comes first, without anything sensed.

    Args:
        bag: The recording.
        sensor_decoder: Empty, counting from the drive's begin.
        renamed: What its topics are called.
    """
    names = _names((*sensor_decoder.wanted, topics.VIRTUAL_SCAN, topics.WHEEL_COMMAND), renamed)
    ends = _period_ends(bag, sensor_decoder.epoch_ns, renamed)
    end = next(ends)
    for message in bag.messages(tuple(names)):
        while message.stamp_ns > end:
            yield _period(sensor_decoder, end)
            end = next(ends)
        if message.stamp_ns >= sensor_decoder.epoch_ns:
            sensor_decoder.add(names[message.topic], message.content, message.stamp_ns)
    yield _period(sensor_decoder, end)


_SHORT, _LONG = NS // 20, NS // 2
"""Commands closer than the first, as of a joystick, do not all end a period; where none comes for
longer than the second, as of one that was put down, the clock ends periods [ns]."""


def _period_ends(bag: Bag, epoch_ns: int, renamed: Renamed) -> Iterator[int]:
    """Yield when the control periods end [ns], without end."""
    names, end = tuple(_names((topics.TWIST,), renamed)), None
    for command in [m.stamp_ns for m in bag.messages(names) if m.stamp_ns >= epoch_ns]:
        if end is not None and command - end < _SHORT:
            continue
        start = epoch_ns - NS // CONTROL_HZ if end is None else end
        if command - start > _LONG:
            yield from range(start + NS // CONTROL_HZ, command - _SHORT, NS // CONTROL_HZ)
        end = command
        yield end
    start = epoch_ns if end is None else end + NS // CONTROL_HZ
    yield from itertools.count(start, NS // CONTROL_HZ)


def _period(sensor_decoder: SensorDecoder, end_ns: int) -> Period:
    """Return the period that ends now."""
    goal, ranges, wheels = sensor_decoder.goal, sensor_decoder.ranges, sensor_decoder.wheels
    return Period(sensor_decoder.readings(sensor_decoder.seconds(end_ns)), goal, ranges, wheels)


def _names(chosen: tuple[Topic, ...], renamed: Renamed) -> dict[str, Topic]:
    """Return topics by the name that was told, or by both of their own."""
    return {
        name: topic
        for topic in chosen
        for name in ((renamed[topic.ros1],) if topic.ros1 in renamed else (topic.ros1, topic.ros2))
    }
