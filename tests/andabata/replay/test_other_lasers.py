"""Recordings with 3D lasers: ours bit by bit, others in their drivers' layouts."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.machine.beams import BeamTables, place_beams, place_points, sweeps_to_cloud
from andabata.machine.lidar import LidarConfig
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import Sweeps
from andabata.navigation.cloud_assembly import CloudAssembler, CloudAssemblyConfig
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.decoding.point_cloud2 import cloud_of
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.messages import MessageBuilder
from andabata.records.topics import POINT_CLOUD, Topic
from traversability.cloud import PointCloud

DRIVE = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
OUSTER = Topic("/ouster/points", "/ouster/points", POINT_CLOUD, None)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive with a 3D laser."""
    path = tmp_path_factory.mktemp("lasers") / "drive.bag"
    options = ["--out", str(path.parent / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words = [*options, "--sensor", "vlp-16", "--time-limit", "8", "--record", str(path)]
    assert main([*DRIVE, *words, "--json", "--quiet"]) == 0
    return path


def run(capsys, *words):
    """Run a command; return the exit code and its JSON."""
    capsys.readouterr()
    code = main([*words, "--json", "--quiet"])
    out, err = capsys.readouterr()
    return (code, json.loads(out)) if out else (code, err)


def test_a_recording_with_a_3d_laser_replays_exactly(capsys, recorded):
    """A replay of a drive with a 3D laser reproduces all scans and commands."""
    code, info = run(capsys, "bag", "info", str(recorded))
    found = {row["topic"]: row for row in info["topics"]}
    assert found["/laser_cloud"]["rate_hz"] == pytest.approx(10.0, rel=0.02)
    assert "/2D_scan" not in found
    code, data = run(capsys, "bag", "replay", str(recorded))
    assert code == 0
    assert data["laser"] == "/laser_cloud"
    assert data["compared_scans"] > 60
    assert data["differing_scans"] == data["differing_commands"] == 0


def spelt_otherwise(message):
    """Return a cloud as another driver would send it: big-endian, padded, with lost points."""
    cloud = cloud_of(message, None, 0.0)
    rows = np.zeros(
        len(cloud) + 3,
        dtype={
            "names": ["t", "z", "y", "x"],
            "formats": [">u4", ">f4", ">f8", ">f4"],
            "offsets": [1, 8, 12, 24],
            "itemsize": 40,
        },
    )
    for column, axis in enumerate("xyz"):
        rows[axis][:-3] = cloud.points[:, column]
        rows[axis][-3:] = np.nan
    rows["t"][:-3] = np.round((cloud.stamps - cloud.stamps.min()) * 1e9)
    kinds = {"t": 6, "z": 7, "y": 8, "x": 7}
    builder = MessageBuilder(1)
    return builder.new(
        POINT_CLOUD,
        header=replace(message.header, frame_id="os_lidar"),
        height=1,
        width=len(rows),
        fields=[
            builder.new(
                "sensor_msgs/msg/PointField",
                name=n,
                offset=rows.dtype.fields[n][1],
                datatype=k,
                count=1,
            )
            for n, k in kinds.items()
        ],
        is_bigendian=True,
        point_step=40,
        row_step=40 * len(rows),
        data=np.frombuffer(rows.tobytes(), dtype=np.uint8),
        is_dense=False,
    )


@pytest.fixture(scope="module")
def foreign(recorded):
    """The same drive as someone else would have recorded it: no commands, no start, no settings."""
    path = recorded.with_name("foreign.bag")
    writer = open_writer(path)
    kept = {t.ros1: t for t in (topics.IMU, topics.ENCODERS, topics.MAG, topics.FIX)}
    with Bag(recorded) as bag:
        for message in bag.messages():
            if message.topic in kept:
                writer.write(kept[message.topic], message.stamp_ns, message.content)
            elif message.topic == topics.LASER_CLOUD.ros1:
                writer.write(OUSTER, message.stamp_ns, spelt_otherwise(message.content))
    writer.close()
    return path


def test_a_bag_of_another_robot_is_replayed(capsys, foreign):
    """A bag with other topics, types and layouts gives the same scans."""
    code, data = run(capsys, "bag", "replay", str(foreign), "--controller", "reactive")
    assert code == 0
    assert data["laser"] == "/ouster/points"
    assert data["recorded_scans"] == 0
    assert data["scans"] > 40
    assert data["moving_periods"] > 40
    assert data["refused"] == 0
    assert data["counts"]["imu"][2] == 0
    code, error = run(capsys, "bag", "replay", str(foreign), "--cloud", "/velodyne_points")
    assert code == 1
    assert "/ouster/points" in error
    code, error = run(capsys, "bag", "replay", str(foreign), "--set", "robot.mass=-1")
    assert code == 2


def test_a_bag_of_a_husky_has_names_of_its_own(capsys, foreign):
    """Names and joint states as Clearpath's robots send them."""
    path, builder = foreign.with_name("husky.bag"), MessageBuilder(1)
    writer = open_writer(path)
    own = {"/imu": "/imu/data", "/mag_orientation": "/imu/mag", "/fix": "/navsat/fix"}
    kinds = {t.ros1: t.kind for t in (topics.IMU, topics.MAG, topics.FIX)}
    with Bag(foreign) as bag:
        for message in bag.messages():
            name, content, kind = message.topic, message.content, message.kind
            if name == "/encoder_data":
                name, kind = "/joint_states", "sensor_msgs/msg/JointState"
                content = joints(builder, content)
            elif name in own:
                name, kind = own[name], kinds[name]
            writer.write(Topic(name, name, kind, None), message.stamp_ns, content)
    writer.close()
    words = ["bag", "replay", str(path), "--controller", "reactive", "--robot", "husky"]
    code, error = run(capsys, *words)
    assert code == 1
    assert "/encoder_data" in error
    assert "--map" in error
    maps = ["--map", "/encoder_data=/joint_states", "--map", "/fix=/navsat/fix"]
    code, data = run(capsys, *words, *maps)
    assert code == 0
    assert data["scans"] > 40
    assert data["refused"] == 0
    assert data["counts"]["wheels"][0] > 500
    # All fixes reach the filter; with the wheels of another body it need not believe them all.
    assert sum(data["counts"]["gnss"]) > 3
    assert run(capsys, *words, "--map", "/encoder_data")[0] == 2
    assert run(capsys, *words, "--map", "/nix=/joint_states")[0] == 1


def joints(builder, wheels):
    """Return wheel speeds as joint states."""
    names = [f"{end}_{side}_wheel" for end in ("front", "rear") for side in ("left", "right")]
    return builder.new(
        "sensor_msgs/msg/JointState",
        header=wheels.header,
        name=names,
        position=np.zeros(4),
        velocity=np.array([wheels.left, wheels.right] * 2),
        effort=np.zeros(4),
    )


def test_another_drivers_cloud_holds_the_same_points(recorded, foreign):
    """A cloud in another driver's layout holds the same points and stamps."""
    with Bag(recorded) as ours, Bag(foreign) as theirs:
        first = next(ours.messages((topics.LASER_CLOUD.ros1,))).content
        second = next(theirs.messages((OUSTER.ros1,))).content
    before, after = cloud_of(first, None, 5.0), cloud_of(second, None, 5.0)
    np.testing.assert_array_equal(before.points, after.points)
    np.testing.assert_array_equal(before.stamps, after.stamps)
    assert before.stamps.max() - before.stamps.min() > 0.09


@pytest.mark.parametrize(
    ("name", "kind", "values", "expected"),
    [
        ("t", 6, [0, 50_000_000], [0.0, 0.05]),
        ("offset_time", 6, [0, 50_000_000], [0.0, 0.05]),
        ("time", 7, [-0.05, 0.0], [-0.05, 0.0]),
        ("timestamp", 8, [1_700_000_000.0, 1_700_000_000.05], [0.0, 0.05]),
        ("time", 7, [0.0, 1e6], [0.0, 0.0]),
        ("intensity", 7, [1.0, 2.0], [0.0, 0.0]),
    ],
)
def test_the_times_of_points_are_read_as_drivers_write_them(name, kind, values, expected):
    """Every driver's unit and field of point times is read."""
    formats = {6: "<u4", 7: "<f4", 8: "<f8"}
    rows = np.zeros(2, dtype=[("xyz", "<f4", 3), ("own", formats[kind])])
    rows["xyz"], rows["own"] = 1.0, values
    builder = MessageBuilder(2)
    fields = [("x", 0, 7), ("y", 4, 7), ("z", 8, 7), (name, 12, kind)]
    message = builder.new(
        POINT_CLOUD,
        header=builder.header(0.0, "lidar"),
        height=1,
        width=2,
        fields=[
            builder.new("sensor_msgs/msg/PointField", name=n, offset=o, datatype=t, count=1)
            for n, o, t in fields
        ],
        is_bigendian=False,
        point_step=rows.itemsize,
        row_step=2 * rows.itemsize,
        data=np.frombuffer(rows.tobytes(), dtype=np.uint8),
        is_dense=True,
    )
    np.testing.assert_allclose(cloud_of(message, None, 7.0).stamps - 7.0, expected, atol=1e-6)


def moving_track():
    """Return a track that drives and turns."""
    track = PoseTrack()
    for k in range(101):
        pose = Pose.from_euler(np.array([0.01 * k, 0.002 * k, 0.1]), 0.1, -0.05, 0.02 * k)
        track.append(k / 100, pose.position, pose.quaternion)
    return track


def test_points_and_beams_are_placed_alike():
    """A cloud of sweeps is placed where its beams are."""
    config, rng = LidarConfig(span_deg=(-15, 15), beams=16, sweep_hz=1000.0, head_rate=60.0), 0
    stamps = np.arange(100, 300) / 1000
    sweeps = Sweeps(
        stamps,
        stamps * config.head_rate,
        config.head_rate,
        config.beam_period,
        config.elevations(100, 300),
        np.random.default_rng(rng).uniform(1, 9, (200, 16)).astype(np.float32),
    )
    track = moving_track()
    points, times = place_beams(sweeps, track, 0.7, BeamTables())
    cloud = sweeps_to_cloud(sweeps, BeamTables())
    np.testing.assert_allclose(place_points(cloud, track, 0.7), points, atol=2e-5)
    np.testing.assert_allclose(cloud.stamps, times, atol=1e-9)


@pytest.mark.parametrize("frame", ["sensor", "base_link"])
def test_beams_of_a_mounted_head_leave_from_where_it_sits(frame):
    """As from a robot whose base is where the head is."""
    stamps, rng = np.arange(20, 30) / 40, np.random.default_rng(0)
    config = LidarConfig(beams=31)
    bare = Sweeps(
        stamps,
        stamps * config.head_rate,
        config.head_rate,
        config.beam_period,
        config.elevations(0, 10),
        rng.uniform(1, 9, (10, 31)).astype(np.float32),
    )
    track = moving_track()
    place = Pose.from_euler(np.array([0.3, -0.2, 0.5]), 0.1, 0.3, 1.2)
    pose = np.concatenate([place.position, place.quaternion])
    mounted = replace(bare, mounting=pose, frame=frame)
    lift = np.array([0, 0, 0.7 if frame == "sensor" else 0.0])
    points, times = place_beams(mounted, track, 0.7, BeamTables())
    in_head, _ = place_beams(bare, still_track(), 0.0, BeamTables())
    for k in range(0, len(points), 37):
        base = Pose(*np.split(track.at(times[k : k + 1])[0], [3])).matrix
        seen = place.matrix[:3, :3] @ in_head[k] + place.position + lift
        np.testing.assert_allclose(points[k], base[:3, :3] @ seen + base[:3, 3], atol=1e-5)


def still_track():
    """Return the track of a robot at rest."""
    track = PoseTrack(1)
    track.append(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    return track


def test_points_are_placed_by_their_frame():
    """Each frame adds its own part of the mounting; others are an error."""
    track, stamps = moving_track(), np.full(1, 0.5)
    point = np.array([[2.0, 1.0, 0.5]], dtype=np.float32)
    pose = Pose(*np.split(track.at(stamps)[0], [3]))
    body = pose.matrix[:3, :3] @ point[0] + pose.position
    found = place_points(PointCloud(point, "base_link", stamps), track, 0.7)
    np.testing.assert_allclose(found[0], body, atol=1e-5)
    raised = pose.matrix[:3, :3] @ (point[0] + [0, 0, 0.7]) + pose.position
    found = place_points(PointCloud(point, "sensor", stamps), track, 0.7)
    np.testing.assert_allclose(found[0], raised, atol=1e-5)
    level = Pose.from_euler(pose.position, 0.0, 0.0, pose.yaw).matrix
    found = place_points(PointCloud(point, "base_footprint", stamps), track, 0.7)
    np.testing.assert_allclose(found[0], level[:3, :3] @ point[0] + pose.position, atol=1e-2)
    with pytest.raises(ValueError, match="sensor, base_link or base_footprint"):
        place_points(PointCloud(point, "map", stamps), track, 0.7)
    with pytest.raises(ValueError, match="time of each point"):
        place_points(PointCloud(point, "sensor"), track, 0.7)


def frame(stamp, count=50):
    """Return a cloud of random points with one stamp [s]."""
    points = np.random.default_rng(0).uniform(1, 5, (count, 3)).astype(np.float32)
    return PointCloud(points, "sensor", np.full(count, stamp))


def test_frames_are_accumulated_over_the_span():
    """A cloud consists of the frames of one span; without a span, of the last one."""
    track = moving_track()
    assembler = CloudAssembler(CloudAssemblyConfig(accumulation_time=0.19, max_range=20), 0.7)
    assembler.add_frame(frame(0.1), track)
    assert assembler.cloud is None
    assembler.add_frame(frame(0.2), track)
    assembler.add_frame(frame(0.3), track)
    assert len(assembler.cloud) == 150
    assembler.add_frame(frame(0.4), track)
    assert len(assembler.cloud) == 150
    single = CloudAssembler(CloudAssemblyConfig(max_range=20), 0.7)
    for stamp in (0.1, 0.2):
        single.add_frame(frame(stamp), track)
        assert len(single.cloud) == 50
        assert single.cloud_age(0.5) == pytest.approx(0.5 - stamp)


def test_a_frame_of_another_time_is_refused():
    """Frames beyond the track's time are refused and counted."""
    track = moving_track()
    assembler = CloudAssembler(CloudAssemblyConfig(), 0.7)
    for stamp in (-5.0, 9.0, np.nan):
        assembler.add_frame(frame(stamp), track)
    assert assembler.cloud is None
    assert assembler.refused == 3


def test_a_sweep_waits_for_its_angle_and_keeps_its_order():
    """Sweeps come out in order, each once its head angle is known."""
    builder, sensor_decoder = MessageBuilder(1), SensorDecoder(1_700_000_000 * 10**9)
    config = LidarConfig(beams=11)
    stamps = np.arange(4) / 40
    sweeps = Sweeps(
        stamps, stamps, 1.0, config.beam_period, config.elevations(0, 4), np.ones((4, 11), "f4")
    )
    for k in range(4):
        sensor_decoder.add(topics.SCAN, builder.sweep(sweeps, k))
    for k in (0, 2, 3):
        sensor_decoder.add(topics.HEAD_ANGLE, builder.head(sweeps, k))
    assert sensor_decoder.readings(0.1).sweeps.stamps.tolist() == [0.0]
    sensor_decoder.add(topics.HEAD_ANGLE, builder.head(sweeps, 1))
    found = sensor_decoder.readings(0.2).sweeps
    np.testing.assert_allclose(found.stamps, stamps[1:])
    np.testing.assert_array_equal(found.elevations, config.elevations(0, 4))
    assert found.beam_period == config.beam_period
    assert sensor_decoder.readings(0.3).sweeps is None


def test_an_inconsistent_message_is_counted():
    """A cloud with a wrong size is refused and counted."""
    sensor_decoder = SensorDecoder(0, OUSTER)
    message = spelt_otherwise(MessageBuilder(1).frame(frame(0.1)))
    sensor_decoder.add(OUSTER, replace(message, width=1 << 20))
    assert sensor_decoder.refused == 1
    assert sensor_decoder.readings(0.1).frames == ()
