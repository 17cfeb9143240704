"""Replays of other recorders' bags: units, clocks and types that differ, and their reports."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.models import shipped_policy
from andabata.records.messages import NS
from rl.policy import with_info
from tests.support import computed_bags
from tests.support.computed_bags import EPOCH, Row, new, restamped, stamp_of, write

JUMP = EPOCH + 5 * NS


@pytest.fixture(scope="module")
def rows():
    """Messages of a drive of eight seconds."""
    return computed_bags.drive(8.0)


def replay(capsys, path, *words):
    """Replay a recording; return exit code, output and errors."""
    capsys.readouterr()
    code = main(["bag", "replay", str(path), "--controller", "reactive", "--quiet", *words])
    out, err = capsys.readouterr()
    return code, out, err


def replay_json(capsys, path, *words):
    """Replay a recording; return exit code, JSON and errors."""
    code, out, err = replay(capsys, path, "--json", *words)
    return code, json.loads(out) if out else None, err


def outcome(data):
    """Return what a replay makes, without its remarks."""
    return {
        k: data[k] for k in ("periods", "scans", "health", "counts", "unknown_share", "refused")
    }


def scaled(row):
    """Return a row of another robot: g, deg/s, gauss and m/s."""
    m = row.content
    if row.topic == "/imu":
        w, a = m.angular_velocity, m.linear_acceleration
        w = replace(w, x=np.rad2deg(w.x), y=np.rad2deg(w.y), z=np.rad2deg(w.z))
        a = replace(a, x=a.x / 9.81, y=a.y / 9.81, z=a.z / 9.81)
        return replace(row, content=replace(m, angular_velocity=w, linear_acceleration=a))
    if row.topic == "/mag_orientation":
        f = m.magnetic_field
        f = replace(f, x=f.x * 1e4, y=f.y * 1e4, z=f.z * 1e4)
        kind = "geometry_msgs/msg/Vector3Stamped"
        return replace(row, kind=kind, content=new(kind, header=m.header, vector=f))
    if row.topic == "/encoder_data":
        return replace(row, content=replace(m, left=m.left / 10, right=m.right / 10))
    return row


def test_a_policy_that_the_recorded_controller_does_not_drive_by_is_refused(capsys, rows, tmp_path):
    """The next step names the option."""
    (tmp_path / "own").write_bytes(with_info(shipped_policy(), {"name": "own"}).to_bytes())
    path = write(tmp_path / "plain.bag", rows[:100])
    code, _, err = replay(capsys, path, "--policy", str(tmp_path / "own"))
    assert code == 1
    assert "got reactive; add `--controller policy+planner`, or leave --policy out" in err


def test_other_units_and_clocks_give_the_same_result(capsys, rows, tmp_path):
    """Other units and another clock change no scan, and each is remarked."""
    code, plain, _ = replay_json(capsys, write(tmp_path / "plain.bag", rows))
    assert code == 0
    assert plain["health"] == {"ok": plain["periods"]}
    assert plain["scans"] > 60
    assert plain["complaints"] == plain["refused_by_reason"] == {}
    assert plain["remarks"] == plain["left_out"] == []
    assert 0 <= plain["unknown_share"] < 0.1
    assert [piece["scans"] for piece in plain["pieces"]] == [plain["scans"]]

    code, data, _ = replay_json(capsys, write(tmp_path / "units.bag", map(scaled, rows)))
    assert code == 0
    assert outcome(data) == outcome(plain)
    texts = " ".join(data["remark_texts"])
    assert all(f"taken as {unit}" in texts for unit in ("g", "deg/s", "G", "m/s"))

    simulated = [restamped(row, stamp_of(row) - EPOCH + 50 * NS) for row in rows]
    code, data, _ = replay_json(capsys, write(tmp_path / "sim.bag", simulated))
    assert code == 0
    assert outcome(data) == outcome(plain)
    assert "before the recorder's clock: theirs is used" in data["remark_texts"][0]


@pytest.mark.parametrize("step", [8 * 3600 * NS, -8 * 3600 * NS, 8 * 365 * 86400 * NS])
def test_a_clock_that_jumps_is_replayed_in_pieces(capsys, rows, tmp_path, step):
    """Both sides of a clock's jump are replayed, each from its own start."""
    jumped = [
        replace(
            restamped(row, stamp_of(row) + (step if stamp_of(row) > JUMP else 0)),
            stamp_ns=row.stamp_ns + (step if row.stamp_ns > JUMP else 0),
        )
        for row in rows
    ]
    path = write(tmp_path / "jump.bag", jumped)
    code, data, _ = replay_json(capsys, path)
    assert code == 3
    assert data["periods"] < 80
    assert sorted(round(piece["seconds"]) for piece in data["pieces"]) == [3, 5]
    assert sum(piece["scans"] for piece in data["pieces"]) == data["scans"] > 50
    assert "2 pieces" in data["left_out"][0]
    if step == 8 * 3600 * NS:
        code, out, _ = replay(capsys, path)
        assert code == 3
        assert "health: ok 100 %" in out
        assert "pieces: 2" in out
        assert "remark: clock: 8.0 h without any reading" in out
        assert "unknown: " in out


def test_a_piece_without_a_start_is_left_out_and_reported(capsys, rows, tmp_path):
    """A piece without a fix is left out with a reason."""
    later = 60 * NS
    paused = [
        replace(restamped(row, stamp_of(row) + later), stamp_ns=row.stamp_ns + later)
        if row.stamp_ns > JUMP
        else row
        for row in rows
        if row.topic != "/fix" or row.stamp_ns < JUMP
    ]
    code, data, _ = replay_json(capsys, write(tmp_path / "pause.bag", paused))
    assert code == 3
    assert [piece["reason"] is None for piece in data["pieces"]] == [True, False]
    assert any("no start is known" in text for text in data["left_out"])


def test_refused_rows_are_counted_by_reason(capsys, rows, tmp_path):
    """Refused readings are counted and give exit code 3."""
    nothing = new("geometry_msgs/msg/Vector3", x=np.nan, y=0.0, z=0.0)
    spoilt = [
        replace(row, content=replace(row.content, angular_velocity=nothing))
        if row.topic == "/imu" and k % 20 < 4
        else row
        for k, row in enumerate(rows)
    ]
    path = write(tmp_path / "nan.bag", spoilt)
    code, data, _ = replay_json(capsys, path)
    assert code == 3
    (count,) = data["refused_by_reason"]["/imu"].values()
    assert count == data["refused"] > 20
    code, out, _ = replay(capsys, path)
    assert f"left out: /imu: {count} of 800 messages refused" in out


def test_without_a_scan_it_fails_with_the_reason(capsys, rows, tmp_path):
    """A replay without any scan fails and names the reason."""
    flat = [
        replace(row, content=replace(row.content, fields=row.content.fields[:2]))
        if row.topic == "/laser_cloud"
        else row
        for row in rows
    ]
    code, data, err = replay_json(capsys, write(tmp_path / "flat.bag", flat))
    assert code == 1
    assert data["scans"] == 0
    assert "expected at least one virtual scan" in err
    assert "expected x, y and z, got x, y" in err


def test_other_types_missing_names_and_wrong_units_are_one_line(capsys, rows, tmp_path):
    """Wrong topics, types and units are errors of one line."""
    path = write(tmp_path / "plain.bag", rows)
    for words, code, texts in (
        (("--map", "/mag_orientation=/imu"), 1, ("MagneticField", "sensor_msgs/msg/Imu")),
        (("--map", "/fix=/nix"), 1, ("--map /fix", "/nix")),
        (("--cloud", "/imu"), 1, ("/laser_cloud", "sensor_msgs/msg/Imu")),
        (("--unit", "wheels=knots"), 2, ("rad/s", "knots")),
    ):
        found, _, err = replay(capsys, path, *words)
        assert found == code
        assert err.count("\n") == 1
        assert all(text in err for text in texts)
    silent = [row for row in rows if row.topic != "/encoder_data"]
    arm = new(
        "sensor_msgs/msg/JointState",
        header=rows[0].content.header,
        name=["elbow"],
        position=np.zeros(1),
        velocity=np.zeros(1),
        effort=np.zeros(0),
    )
    silent.append(Row("/joint_states", "sensor_msgs/msg/JointState", EPOCH + NS, arm))
    path = write(tmp_path / "arm.bag", silent)
    code, _, err = replay(capsys, path, "--map", "/encoder_data=/joint_states")
    assert code == 1
    assert "elbow" in err
    assert "defect" not in err


def test_of_two_names_one_is_read_and_another_type_under_a_spare_name_is_left_out(
    capsys, rows, tmp_path
):
    """Of a topic's two names one is read, and a wrong type is skipped, both with a remark."""
    more = [replace(row, topic="/imu/data") for row in rows if row.topic == "/imu"]
    more += [replace(row, topic="/odometry/filtered") for row in rows if row.topic == "/imu"]
    code, data, _ = replay_json(capsys, write(tmp_path / "two.bag", [*rows, *more]))
    assert code == 0
    texts = " ".join(data["remark_texts"])
    assert "/imu/data: /imu is read instead" in texts
    assert "/odometry/filtered: expected nav_msgs/msg/Odometry" in texts
    assert data["counts"]["imu"][0] < 800


def test_commands_of_a_joystick_neither_end_the_replay_nor_stretch_a_period(capsys, rows, tmp_path):
    """Fast commands and their end do not change the length of control periods."""
    still = new("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    twist = new("geometry_msgs/msg/Twist", linear=still, angular=still)
    burst = [
        Row("/cmd_vel", "geometry_msgs/msg/Twist", EPOCH + 3 * NS + k * NS // 50, twist)
        for k in range(50)
    ]
    code, data, _ = replay_json(capsys, write(tmp_path / "joy.bag", [*rows, *burst]))
    assert code == 0
    assert 70 < data["periods"] < 95
    assert data["health"] == {"ok": data["periods"]}
