"""Recordings hold the drive exactly, in every format, and survive kills and damage."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.localization.localizer import Health
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, Sweeps
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag, BagError
from andabata.records.drive_setup import DriveSetup, read_setup
from andabata.records.messages import MessageBuilder, header_ns
from andabata.records.recorder import MessageQueue, Recorder, queue_readings
from andabata.records.topics import TOPICS
from tests.support.planned_drives import GRID, PlannedDrive
from tests.support.played_graph import MemoryWriter

DRIVE = ["drive", "--world", "natural-test", "--seed", "4", "--controller", "reactive"]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive, recorded as a ROS 1 bag and as an MCAP file."""
    folder = tmp_path_factory.mktemp("records")
    options = ["--out", str(folder / "out"), "--set", "plant=kinematic", "--json"]
    limited = ["--time-limit", "12"]
    paths = {}
    for suffix in ("bag", "mcap", "db3"):
        paths[suffix] = folder / f"drive.{suffix}"
        assert main([*DRIVE, *options, *limited, "--record", str(paths[suffix])]) == 0
    return paths


def run(capsys, *words):
    """Run a command; return the exit code and its JSON."""
    capsys.readouterr()
    code = main([*words, "--json"])
    out = capsys.readouterr().out
    return code, json.loads(out) if out else None


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
def test_every_topic_is_there_at_its_rate(capsys, recorded, suffix):
    """A recording has all topics with their types and rates."""
    code, data = run(capsys, "bag", "info", str(recorded[suffix]))
    assert code == 0
    ros = 1 if suffix == "bag" else 2
    found = {row["topic"]: row for row in data["topics"]}
    # A controller without a planner has no map, and still something that it heads for.
    assert set(found) == {topic.name(ros) for topic in (*TOPICS, topics.HEADING_ERROR)}
    for topic in TOPICS:
        row = found[topic.name(ros)]
        assert row["type"] == topic.type_name(ros)
        if topic.rate_hz is None or topic in (topics.FIX, topics.CLOUD, topics.DIAGNOSTICS):
            continue  # Too few of them in twelve seconds.
        assert row["rate_hz"] == pytest.approx(topic.rate_hz, rel=0.02)


@pytest.mark.parametrize("suffix", ["bag", "mcap", "db3"])
def test_a_replay_makes_the_same_scans_and_commands(capsys, recorded, suffix):
    """A replay reproduces all recorded virtual scans and commands."""
    code, data = run(capsys, "bag", "replay", str(recorded[suffix]))
    assert code == 0
    assert data["periods"] > 100
    assert data["scans"] > 60
    assert data["differing_scans"] == 0
    assert data["differing_commands"] == 0
    assert data["same_models"] is True


def test_a_drive_with_a_map_replays_within_its_geofence(capsys, tmp_path):
    """The geofence is recorded, and a replay with the planner gives the same commands."""
    path = tmp_path / "drive.mcap"
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "policy+planner"]
    limits = ["--set", "plant=kinematic", "--time-limit", "10", "--out", str(tmp_path / "out")]
    fence = ["--set", "geofence=[-49.0, -49.0, 49.0, 49.0]"]
    assert main([*words, *limits, *fence, "--record", str(path), "--json"]) == 0
    with Bag(path) as bag:
        geofence = read_setup(bag, {}, {}).geofence
    assert geofence == (-49.0, -49.0, 49.0, 49.0)
    code, data = run(capsys, "bag", "replay", str(path))
    assert code == 0
    assert data["differing_commands"] == 0


@pytest.mark.parametrize("geofence", ["here", [0.0, 1.0], [None, 0.0, 1.0, 1.0]])
def test_an_invalid_geofence_is_refused(geofence):
    """A recorded geofence that is not four numbers raises a BagError."""
    pose = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
    with pytest.raises(BagError, match="geofence: expected x_min, y_min, x_max, y_max"):
        _ = DriveSetup(pose, 0, {"geofence": geofence}).geofence


def test_another_controller_gives_other_commands_from_the_same_scans(capsys, recorded):
    """Another controller changes the commands only; one that needs the truth is refused."""
    path = str(recorded["mcap"])
    code, data = run(capsys, "bag", "replay", path, "--controller", "straight")
    assert code == 0
    assert data["differing_scans"] == 0
    assert data["differing_commands"] > 0
    assert main(["bag", "replay", path, "--controller", "oracle"]) == 1


def test_a_recorded_cloud_can_be_classified(capsys, recorded, tmp_path):
    """A cloud of a recording gives cells; a topic without clouds is an error."""
    picture = str(tmp_path / "scan.png")
    words = ["--topic", "/points_relative", "--number", "-1", "--picture", picture]
    code, data = run(capsys, "scan", str(recorded["mcap"]), *words)
    assert code == 0
    assert data["cells"]["green"] > 20
    assert data["points"] > 5000
    assert main(["scan", str(recorded["mcap"]), "--topic", "/imu/data"]) == 1


def test_export_gives_clouds_and_tables(capsys, recorded, tmp_path):
    """Clouds are exported as PLY, other topics as CSV; an unknown topic is an error."""
    words = ["--out", str(tmp_path / "x"), "--topic", "/points", "--topic", "/imu/data"]
    code, data = run(capsys, "bag", "export", str(recorded["mcap"]), *words)
    assert code == 0
    names = {path.rsplit("/", 1)[-1] for path in data["files"]}
    assert "imu_data.csv" in names
    assert "points_00000.ply" in names
    lines = (tmp_path / "x" / "imu_data.csv").read_text().splitlines()
    assert "angular_velocity.z" in lines[0]
    assert len(lines) > 1000
    assert main(["bag", "export", str(recorded["mcap"]), "--out", "y", "--topic", "/nix"]) == 1


@pytest.mark.parametrize("suffix", ["bag", "mcap"])
def test_most_of_a_killed_recording_is_salvaged(capsys, recorded, tmp_path, suffix):
    """Of nine tenths of a file more than three quarters of the messages are salvaged."""
    data = recorded[suffix].read_bytes()
    cut = tmp_path / f"cut.{suffix}"
    cut.write_bytes(data[: int(len(data) * 0.9)])
    code, seen = run(capsys, "bag", "info", str(cut))
    assert code == 3
    assert seen["left_out"][0]["topic"] is None
    with Bag(recorded[suffix]) as bag:
        whole = sum(n for _, n in bag.topics.values())
    code, found = run(
        capsys, "bag", "salvage", str(cut), "--out", str(tmp_path / f"whole.{suffix}")
    )
    assert code == 3
    assert found["lost"] is True
    assert 0.75 * whole < found["messages"] < whole
    assert found["messages"] == sum(row["messages"] for row in seen["topics"])
    code, info = run(capsys, "bag", "info", str(tmp_path / f"whole.{suffix}"))
    assert code == 0
    assert sum(row["messages"] for row in info["topics"]) == found["messages"]


@pytest.mark.parametrize("suffix", ["bag", "mcap"])
def test_a_whole_recording_is_salvaged_whole(capsys, recorded, tmp_path, suffix):
    """Salvage of an undamaged recording loses no message."""
    out = tmp_path / f"same.{suffix}"
    code, found = run(capsys, "bag", "salvage", str(recorded[suffix]), "--out", str(out))
    assert code == 0
    with Bag(recorded[suffix]) as bag:
        assert found["messages"] == sum(n for _, n in bag.topics.values())


@pytest.mark.parametrize("suffix", ["bag", "mcap"])
def test_damage_is_one_clear_error(capsys, recorded, tmp_path, suffix):
    """Flipped bits and cut files give an error message or a replay, never a traceback."""
    rng, data = np.random.default_rng(0), recorded[suffix].read_bytes()
    path = tmp_path / f"bad.{suffix}"
    for _ in range(12):
        spoilt = bytearray(data)
        for place in rng.integers(0, len(data), 200):
            spoilt[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(spoilt))
        code = main(["bag", "replay", str(path), "--json"])
        assert code in (0, 1, 3)  # 3: some messages were left out, and the replay says so.
        assert "Traceback" not in capsys.readouterr().err
    for cut in (0, 10, 100, 5000):
        path.write_bytes(data[:cut])
        assert main(["bag", "info", str(path)]) == 1
        assert "expected" in capsys.readouterr().err


def test_missing_topics_are_named(capsys, tmp_path):
    """A replay names missing and found topics."""
    path = tmp_path / "other.bag"
    writer, builder = open_writer(path), MessageBuilder(1)
    writer.write(topics.TWIST, builder.stamp_ns(0.0), builder.twist(0.3, 0.1))
    writer.close()
    assert main(["bag", "replay", str(path)]) == 1
    error = capsys.readouterr().err
    assert "/2D_scan" in error
    assert "/cmd_vel" in error


def test_messages_leave_by_time_and_then_by_arrival():
    """A queue writes its messages once, sorted by stamp; equal stamps keep their order."""
    writer, builder = MemoryWriter(), MessageBuilder(1, 0)
    queue = MessageQueue(writer, builder)
    for seconds, name in ((0.2, "a"), (0.1, "b"), (0.2, "c"), (0.1, "d")):
        queue.add(seconds, topics.TWIST, name)
    queue.flush()
    queue.flush()
    assert [name for _, _, name in writer.messages] == ["b", "d", "a", "c"]
    assert [stamp for stamp, _, _ in writer.messages] == [10**8, 10**8, 2 * 10**8, 2 * 10**8]


def test_true_places_of_walkers_are_recorded_while_they_are_there():
    """In the map, at the feet; one of radius 0 is nowhere. Without walkers there is no topic."""
    writer, builder = MemoryWriter(), MessageBuilder(2, 0)
    queue = MessageQueue(writer, builder)
    rows = np.array([[1.0, 2.0, 0.5, 0.25, 1.7], [3.0, 4.0, 0.5, 0.0, 1.7]])
    queue_readings(queue, SensorReadings(1.1, walkers=rows))
    queue_readings(queue, SensorReadings(1.2))
    queue.flush()
    ((stamp, topic, message),) = writer.messages
    assert (stamp, topic, message.header.frame_id) == (1_100_000_000, topics.WALKERS, "map")
    (pose,) = message.poses
    assert (pose.position.x, pose.position.y, pose.position.z) == (1.0, 2.0, 0.5)


def test_a_goal_that_is_declared_reached_is_recorded_once():
    """Its place in the map, in the step of the word; the next goal has a message of its own."""
    drive, writer = PlannedDrive(), MemoryWriter()
    queue = MessageQueue(writer, MessageBuilder(1, 0))
    recorder = Recorder(queue, drive.localizer, None, GRID.bearings)
    step = drive.navigator.step(SensorReadings(0.1))
    for arrived, goal in ((False, 8.0), (True, 8.0), (True, 8.0), (False, 3.0), (True, 3.0)):
        recorder.queue_commands(step._replace(has_arrived=arrived, goal=np.array([goal, 0.5])))
    queue.flush()
    found = [m for _, topic, m in writer.messages if topic is topics.GOAL_REACHED]
    assert [m.pose.position.x for m in found] == [8.0, 3.0]
    assert {m.header.frame_id for m in found} == {"map"}


def test_a_sweep_leaves_at_its_end_and_a_fix_with_its_period():
    """A sweep is recorded after its last beam, with its own stamp in the header."""
    writer, builder = MemoryWriter(), MessageBuilder(1, 0)
    queue = MessageQueue(writer, builder)
    elevations = np.zeros(11, dtype=np.float32)
    sweeps = Sweeps(np.array([1.0]), np.zeros(1), 1.0, 0.001, elevations, np.ones((1, 11), "f4"))
    fix = np.array([[1.05, 36.7, -4.4, 60.0, 0.5]])
    queue_readings(queue, SensorReadings(1.1, sweeps, gnss=fix))
    queue.flush()
    assert [(stamp, topic) for stamp, topic, _ in writer.messages] == [
        (1_010_000_000, topics.SCAN),
        (1_010_000_000, topics.HEAD_ANGLE),
        (1_100_000_000, topics.FIX),
    ]
    assert [header_ns(m) for _, _, m in writer.messages] == [10**9, 10**9, 1_050_000_000]


def test_diagnostics_are_not_ok_where_a_check_failed():
    """The level is a warning at least, and the message names each check that failed."""
    drive, levels = PlannedDrive(), []
    drive.localizer.health = Health.OK
    for failures in ((), ("wheels: backwards", "imu: gyro"), ()):
        writer = MemoryWriter()
        queue = MessageQueue(writer, MessageBuilder(1))
        recorder = Recorder(queue, drive.localizer, None, GRID.bearings)
        recorder.failures = failures
        recorder.queue_state(0.0)
        queue.flush()
        (status,) = (m.status[0] for _, topic, m in writer.messages if topic is topics.DIAGNOSTICS)
        levels.append((status.level, status.message))
    assert levels == [(0, "ok"), (1, "degraded; wheels: backwards; imu: gyro"), (0, "ok")]


def test_a_recording_holds_what_the_robot_believes():
    """Covariance in odometry and pose; health, cause, sigmas and unused readings by key."""
    drive, writer = PlannedDrive(), MemoryWriter()
    drive.localizer.health = Health.DEGRADED
    drive.localizer.causes = ("gnss: not accepted for 9.0 s",)
    drive.localizer.unused = {"compass": {"beyond the gate": 12, "invalid": 3}}
    queue = MessageQueue(writer, MessageBuilder(1))
    recorder = Recorder(queue, drive.localizer, None, GRID.bearings)
    recorder.queue_state(0.0)
    queue.flush()
    found = {topic: message for _, topic, message in writer.messages}
    expected = drive.localizer.status.covariance.ravel()
    for topic in (topics.FILTERED_ODOMETRY, topics.ESTIMATED_POSE):
        np.testing.assert_array_equal(found[topic].pose.covariance, expected)
        assert found[topic].pose.pose.position.x == drive.localizer.pose.position[0]
    (status,) = found[topics.DIAGNOSTICS].status
    assert status.message == "degraded; gnss: not accepted for 9.0 s"
    assert {pair.key: pair.value for pair in status.values} == {
        "health": "degraded",
        "cause": "gnss: not accepted for 9.0 s",
        "position sigma [m]": "0.300",
        "heading sigma [deg]": "5.73",
        "not used: compass, beyond the gate": "12",
        "not used: compass, invalid": "3",
    }


def test_a_check_that_fails_is_published_at_once():
    """Between the seconds a change of the failed checks is a message of its own."""
    drive, writer = PlannedDrive(), MemoryWriter()
    queue = MessageQueue(writer, MessageBuilder(1))
    recorder = Recorder(queue, drive.localizer, None, GRID.bearings)
    for k in range(1, 6):
        recorder.failures = ("imu: gyro",) if k > 2 else ()
        recorder.queue_state(k / 10)
    queue.flush()
    stamps = [stamp for stamp, topic, _ in writer.messages if topic is topics.DIAGNOSTICS]
    assert len(stamps) == 2
