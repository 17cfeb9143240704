"""Recorded drives moved to another place on Earth, as of another robot."""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.machine.geo_reference import GeoReference
from andabata.machine.magnetic_model import magnetic_field
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.messages import header_ns, pose_of
from andabata.replay.result import RecordedComparison

YEAR = 2023.87
"""Year of our recordings' stamps."""

SENSORS = {
    t.ros1: t for t in (topics.IMU, topics.ENCODERS, topics.MAG, topics.FIX, topics.LASER_CLOUD)
}


def place(latitude, longitude, altitude):
    """Return a datum with the model's field."""
    field = magnetic_field(latitude, longitude, altitude, YEAR)
    return GeoReference(
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude=altitude,
        declination_deg=field.declination_deg,
        inclination_deg=field.inclination_deg,
        field=field.flux_density,
    )


def copied(source: Path, target: Path, edit: Callable = lambda topic, message: message) -> Path:
    """Copy the sensors' messages of a recording.

    Args:
        source: Our recording.
        target: New ROS 1 bag.
        edit: Function of topic and message that returns the message to write, None for none.
    """
    writer = open_writer(target)
    with Bag(source) as bag:
        for message in bag.messages(tuple(SENSORS)):
            topic = SENSORS[message.topic]
            content = edit(topic, message.content)
            if content is not None:
                writer.write(topic, message.stamp_ns, content)
    writer.close()
    return target


def moved(source: Path, target: Path, there: GeoReference) -> Path:
    """Copy a drive to another place: its fixes, and the magnetic field there."""
    here = GeoReference()
    with Bag(source) as bag:
        truths = [m.content for m in bag.messages((topics.GROUND_TRUTH.ros1,))]
    stamps = np.array([header_ns(m) for m in truths])
    middle = np.array([pose_of(m.pose.pose).position for m in truths]).mean(axis=0) * [1, 1, 0]
    change = (there.flux - here.flux) * 1e-6

    def edit(topic, message):
        if topic is topics.FIX and message.status.status >= 0:
            fix = np.array([[message.latitude, message.longitude, message.altitude]])
            latitude, longitude, altitude = there.to_geodetic(here.to_map(fix) - middle)[0]
            return replace(message, latitude=latitude, longitude=longitude, altitude=altitude)
        if topic is topics.MAG:
            nearest = truths[np.abs(stamps - header_ns(message)).argmin()]
            turn = Rotation.from_quat(pose_of(nearest.pose.pose).quaternion).inv()
            x, y, z = turn.apply(change)
            old = message.magnetic_field
            field = replace(old, x=old.x + x, y=old.y + y, z=old.z + z)
            return replace(message, magnetic_field=field)
        return message

    return copied(source, target, edit)


@contextmanager
def watched(monkeypatch):
    """Yield a list that fills with the virtual scans of a replay, None where there is none."""
    found, add = [], RecordedComparison.add

    def watch(self, period, step):
        found.append(None if step.scan is None else step.scan.ranges.copy())
        add(self, period, step)

    with monkeypatch.context() as patch:
        patch.setattr(RecordedComparison, "add", watch)
        yield found


def differing(scans, others):
    """Return how many sectors of two replays differ."""
    assert [s is None for s in scans] == [s is None for s in others]
    pairs = [(a, b) for a, b in zip(scans, others, strict=True) if a is not None]
    return sum(int(((a != b) & ~(np.isnan(a) & np.isnan(b))).sum()) for a, b in pairs)
