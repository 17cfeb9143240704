"""Recordings computed from formulas: a winding drive between walls.

Messages are made in order, may be edited one by one, and are written as a ROS 1 bag. So another
robot's recording differs from them only in what a test changes.
"""

from dataclasses import dataclass, replace

import numpy as np
from rosbags.rosbag1 import Writer

from andabata.machine.geo_reference import GeoReference
from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import message_types
from traversability.cloud import PointCloud

EPOCH = 1_700_000_000 * NS
SPEED = 0.3
TYPES = message_types(1)

NAMES = {
    "/imu": "sensor_msgs/msg/Imu",
    "/encoder_data": "andabata_msgs/msg/Wheels_speed",
    "/mag_orientation": "sensor_msgs/msg/MagneticField",
    "/fix": "sensor_msgs/msg/NavSatFix",
    "/laser_cloud": "sensor_msgs/msg/PointCloud2",
}


@dataclass
class Row:
    """Message for a bag: topic, type, time of recording [ns], content."""

    topic: str
    kind: str
    stamp_ns: int
    content: object


def drive(seconds=10.0, seed=0, turning=0.4, speed=SPEED):
    """Return the messages of a drive, by the recorder's time."""
    rng, builder = np.random.default_rng(seed), MessageBuilder(1)
    geo_reference, kinematics = GeoReference(), SkidSteer(RobotModel())
    times = np.arange(1, round(seconds * 100) + 1) / 100
    rates = turning * np.sin(0.6 * times)
    yaws = np.cumsum(rates) / 100
    x, y = (np.cumsum(speed * part) / 100 for part in (np.cos(yaws), np.sin(yaws)))
    rows = []
    for k, t in enumerate(times):
        noise = rng.standard_normal(10)
        sine, cosine = np.sin(yaws[k]), np.cos(yaws[k])
        east, north, up = geo_reference.flux * 1e-6
        field = np.array([cosine * east + sine * north, cosine * north - sine * east, up])
        wheels = kinematics.unlimited_wheel_speeds(speed, rates[k])
        imu = np.array([t, *(1e-3 * noise[:3]), 0.0, speed * rates[k], 9.81])
        imu[3] += rates[k]
        imu[4:] += 0.02 * noise[3:6]
        stamp = builder.stamp_ns(t)
        for topic, content in (
            ("/imu", builder.imu(imu)),
            ("/encoder_data", builder.wheels("Wheels_speed", t, wheels.left, wheels.right)),
            ("/mag_orientation", builder.field(np.array([t, *(field + 3e-7 * noise[6:9])]))),
        ):
            rows.append(Row(topic, NAMES[topic], stamp, content))
        if (k + 1) % 100 == 0:
            place = geo_reference.to_geodetic(np.array([[x[k], y[k], 0.0]]))[0]
            fix = builder.fix(np.array([t, *place, 0.25]))
            rows.append(Row("/fix", NAMES["/fix"], stamp, fix))
        if (k + 1) % 10 == 0:
            cloud = builder.frame(surroundings(t - 0.1))
            rows.append(Row("/laser_cloud", NAMES["/laser_cloud"], stamp, cloud))
    return rows


def surroundings(begin):
    """Return a cloud of level ground with a wall around it, measured in a tenth of a second.

    No laser measures the same twice: a noise of a tenth of a millimetre tells the clouds apart.
    """
    angles = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    rings = [(r, -0.72) for r in (1.2, 1.6, 2.1, 2.8, 3.8, 5.0)]
    rings += [(6.0, z) for z in (-0.6, -0.4, -0.2, 0.0)]
    points = np.concatenate(
        [
            np.column_stack([r * np.cos(angles), r * np.sin(angles), np.full(360, z)])
            for r, z in rings
        ]
    )
    noise = np.random.default_rng(round(abs(begin) * 1000)).standard_normal(points.shape)
    points = (points + 1e-4 * noise).astype(np.float32)
    stamps = np.tile(begin + np.arange(360) / 3600, len(rings))
    return PointCloud(points, "sensor", stamps)


def write(path, rows):
    """Write rows as a ROS 1 bag, in the order of their stamps."""
    path.unlink(missing_ok=True)
    with Writer(path) as writer:
        made = {}
        for row in sorted(rows, key=lambda row: row.stamp_ns):
            key = (row.topic, row.kind)
            if key not in made:
                made[key] = writer.add_connection(row.topic, row.kind, typestore=TYPES)
            writer.write(made[key], row.stamp_ns, TYPES.serialize_ros1(row.content, row.kind))
    return path


def restamped(row, header_ns):
    """Return a row with another stamp [ns] in its header."""
    second, rest = divmod(header_ns, NS)
    header = row.content.header
    stamp = replace(header.stamp, sec=int(second), nanosec=int(rest))
    return replace(row, content=replace(row.content, header=replace(header, stamp=stamp)))


def stamp_of(row):
    """Return the stamp of a row's header [ns]."""
    stamp = row.content.header.stamp
    return stamp.sec * NS + stamp.nanosec


def new(kind, **fields):
    """Return a message of ROS 1."""
    return TYPES.types[kind](**fields)
