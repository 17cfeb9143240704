"""Setup of a recorded drive: start pose, epoch, settings and datum."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.datum import (
    Datum,
    consistent_fixes,
    datum_from_heading,
    make_datum,
    rejected_fixes,
)
from andabata.localization.fix_check import check_fixes
from andabata.localization.initial_pose import initial_pose
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records import topics
from andabata.records.bags import Bag, BagError
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.frames.names import local_name
from andabata.records.messages import NS, header_ns, pose_of
from andabata.records.recorded_settings import diagnostic_values, parse_settings
from andabata.records.recorder import DATUM
from andabata.records.topic_selection import Remapping, topic_names
from worlds.world import Geofence

_FIRST_FIXES = 30.0
"""Time span of the first fixes, which have to agree with each other [s]."""

_FIRST_DIAGNOSTICS = 100
"""Number of diagnostics in which our recordings hold their datum."""


@dataclass(frozen=True)
class DriveSetup:
    """Setup of a recorded drive.

    Attributes:
        start: Pose at which the robot believed to start.
        epoch_ns: Stamp of that pose [ns]; times are counted from there.
        settings: Settings of the drive, empty in a recording that is not ours.
        is_rough: True if the start is estimated from the first readings alone.
        datum: Datum of the map, None where the settings hold it, or nothing does.
        refused: Number of fixes before the start that could not be used, by reason.
    """

    start: Pose
    epoch_ns: int
    settings: dict[str, Any]
    is_rough: bool = False
    datum: Datum | None = None
    refused: Mapping[str, int] = field(default_factory=dict)

    @property
    def geofence(self) -> Geofence | None:
        """Rectangle that the robot had to stay in [m], None without one.

        Raises:
            BagError: If the recorded geofence is no rectangle.
        """
        geofence = self.settings.get("geofence")
        if geofence is None:
            return None
        try:
            x_min, y_min, x_max, y_max = map(float, geofence)
        except (TypeError, ValueError):
            raise BagError(
                f"geofence: expected x_min, y_min, x_max, y_max [m], got {geofence!r}; record it "
                "again"
            ) from None
        return x_min, y_min, x_max, y_max


def read_setup(
    bag: Bag,
    given: Mapping[str, float],
    remapping: Remapping,
    decoder: MessageDecoder | None = None,
    extrinsics: Extrinsics | None = None,
) -> DriveSetup:
    """Return the setup of a recorded drive: as recorded, else estimated from the first readings.

    Args:
        bag: Recording to read.
        given: Fields of ``GeoReference`` that the user gives, for a recording that is not ours.
        remapping: Names that the recording uses.
        decoder: Decoder of the first readings; None for one that infers their units as they come.
        extrinsics: Poses of the sensors; None for those that the frames' names imply.

    Raises:
        BagError: If the recording holds neither a start nor the readings to estimate one.
        DatumError: If its fixes lie far from the datum that is given.
    """
    recorded = _read_recorded(bag, remapping)
    if recorded is not None and (recorded.settings or recorded.datum is not None):
        return recorded
    fixes, epoch_ns = read_first_fixes(bag, remapping, extrinsics)
    year = decimal_year(epoch_ns)
    if recorded is not None:
        readings = _first_second(bag, recorded.epoch_ns, remapping, decoder, extrinsics)
        reference = make_datum(given, fixes, year, recorded.start.position)
        reference = reference or datum_from_heading(readings, recorded.start.yaw)
        return replace(recorded, datum=reference.with_compass(readings))
    datum = make_datum(given, fixes, year)
    if datum is not None:
        setup = _estimate_setup(bag, datum, fixes, remapping, decoder, extrinsics)
        if setup is not None:
            return setup
    refused = rejected_fixes(fixes)
    if without := int(np.isinf(fixes[:, 4]).sum()):
        refused["whose status says that there is none"] += without
    reasons = ", ".join(f"{n} fixes {reason}" for reason, n in refused.items())
    got = f"no fix that can be used ({reasons})" if reasons else "neither; --map gives their names"
    raise BagError(
        f"{bag.path}: expected {topics.INITIAL_POSE.ros1} or {topics.FILTERED_ODOMETRY.ros1} "
        f"with the start pose of the drive, or {topics.IMU.ros1}, {topics.MAG.ros1} and "
        f"{topics.FIX.ros1} to estimate it, got {got}"
        f"{'; --map /fix=TOPIC names another receiver' if reasons else ''}"
    )


def _read_recorded(bag: Bag, remapping: Remapping) -> DriveSetup | None:
    """Return the start, the settings and the datum that a recording holds, None without a start.

    A pose in a frame other than ``map`` is no start: the pose of that frame is unknown.
    """
    names = topic_names(
        (topics.INITIAL_POSE, topics.FILTERED_ODOMETRY, topics.DIAGNOSTICS), remapping
    )
    start: Pose | None = None
    epoch, diagnostics, datum = 0, 0, None
    settings: dict[str, Any] = {}
    for message in bag.messages(tuple(names)):
        topic, content = names[message.topic], message.content
        if topic in (topics.INITIAL_POSE, topics.FILTERED_ODOMETRY) and start is None:
            if local_name(str(content.header.frame_id)) == "map":
                start, epoch = pose_of(content.pose.pose), header_ns(content)
        elif topic is topics.DIAGNOSTICS:
            diagnostics += 1
            settings = parse_settings(content) or settings
            text = diagnostic_values(content).get(DATUM, "")
            if text.startswith("{"):
                datum = Datum.from_dict(json.loads(text))
        if start is not None and (settings or datum or diagnostics > _FIRST_DIAGNOSTICS):
            break
    if start is None:
        return None
    source = None if datum is None else replace(datum, source="the recording")
    return DriveSetup(start, epoch, settings, datum=source)


def read_first_fixes(
    bag: Bag, remapping: Remapping, extrinsics: Extrinsics | None = None
) -> tuple[NDArray[np.float64], int]:
    """Return the fixes of the first half minute, and the stamp of the first good one.

    Args:
        bag: Recording to read.
        remapping: Names that the recording uses.
        extrinsics: Poses of the sensors; None for those that the frames' names imply.

    Returns:
        Rows as in ``SensorReadings.gnss`` with stamps since 1970, shape (k, 5), and the stamp [ns],
        0 without a good fix.
    """
    sensor_decoder, begin, rows = SensorDecoder(0, extrinsics=extrinsics), 0, []
    names = topic_names((topics.FIX,), remapping)
    for message in bag.messages(tuple(names)):
        if begin and message.stamp_ns > begin + _FIRST_FIXES * NS:
            break
        sensor_decoder.add(names[message.topic], message.content, message.stamp_ns)
        fixes_of_period = sensor_decoder.readings(0.0).gnss
        if fixes_of_period is None:
            continue
        rows.append(fixes_of_period)
        if not begin and check_fixes(fixes_of_period).good.any():
            begin = message.stamp_ns
    return np.concatenate(rows) if rows else np.empty((0, 5)), begin


def _estimate_setup(
    bag: Bag,
    datum: Datum,
    fixes: NDArray[np.float64],
    remapping: Remapping,
    decoder: MessageDecoder | None,
    extrinsics: Extrinsics | None,
) -> DriveSetup | None:
    """Return a start at the first consistent fix, None if IMU, compass or fixes are missing.

    The compass gives the heading, gravity the tilt.
    """
    first = fixes[consistent_fixes(fixes)]
    last, fitting = fixes[:, 0].max(initial=-np.inf), set(first[:, 0].tolist())
    names = topic_names((topics.IMU, topics.MAG, topics.FIX), remapping)
    sensor_decoder = SensorDecoder(0, decoder=decoder, extrinsics=extrinsics)
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
            return DriveSetup(
                pose,
                message.stamp_ns + 1,
                {},
                is_rough=True,
                datum=datum.with_compass(readings),
                refused=rejected_fixes(fixes, float(rows[-1, 0])),
            )
    return None


def _first_second(
    bag: Bag,
    epoch_ns: int,
    remapping: Remapping,
    decoder: MessageDecoder | None,
    extrinsics: Extrinsics | None,
) -> SensorReadings:
    """Return the readings of IMU and compass in the first second of a drive."""
    names = topic_names((topics.IMU, topics.MAG), remapping)
    sensor_decoder = SensorDecoder(epoch_ns, decoder=decoder, extrinsics=extrinsics)
    for message in bag.messages(tuple(names)):
        if message.stamp_ns > epoch_ns + NS:
            break
        if message.stamp_ns >= epoch_ns:
            sensor_decoder.add(names[message.topic], message.content, message.stamp_ns)
    return sensor_decoder.readings(1.0)
