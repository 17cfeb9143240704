"""Replays of recordings whose sources contradict each other, and of the steps that are advised."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.records.messages import NS, MessageBuilder
from tests.support import computed_bags
from tests.support.computed_bags import Row, new, restamped, stamp_of, write
from tests.support.edited_bags import reframed, stamped

JOINT_STATE, TF = "sensor_msgs/msg/JointState", "tf2_msgs/msg/TFMessage"
NAMES = ("fl_wheel", "rl_wheel", "fr_wheel", "rr_wheel")
JOINTS = ("--map", "/encoder_data=/joint_states")


@pytest.fixture(scope="module")
def rows():
    """Messages of a drive of 7 seconds."""
    return computed_bags.drive(7.0)


@pytest.fixture(scope="module")
def long_rows():
    """Messages of a drive of 13 seconds, whose fixes spread far enough to judge the wheels."""
    return computed_bags.drive(13.0)


@pytest.fixture
def replay(capsys, tmp_path):
    """Replay of rows: exit code, result and error."""

    def run(rows, *words):
        path = write(tmp_path / "edited.bag", rows)
        capsys.readouterr()
        code = main(
            ["bag", "replay", str(path), "--controller", "reactive", "--quiet", "--json", *words]
        )
        out, err = capsys.readouterr()
        return code, json.loads(out) if out else None, err

    return run


@pytest.fixture(scope="module")
def results():
    """Results of sound drives, once a test has asked."""
    return {}


@pytest.fixture
def plain(replay, rows, results):
    """Result of the drive itself."""
    if "plain" not in results:
        results["plain"] = replay(rows)[1]
    return results["plain"]


@pytest.fixture
def plain_joints(replay, long_rows, results):
    """Result of the long drive with joint states for wheel speeds."""
    if "joints" not in results:
        results["joints"] = replay(with_joints(long_rows), *JOINTS)[1]
    return results["joints"]


def outcome(data):
    """Return what the navigator made of a recording."""
    return data["scans"], data["unknown_share"], data["counts"]


def edited(rows, topic, edit):
    """Return rows with the messages of a topic edited, each by its number."""
    found, k = [], 0
    for row in rows:
        found.append(edit(row, k) if row.topic == topic else row)
        k += row.topic == topic
    return found


def with_joints(rows, signs=(1, 1, 1, 1), zeros=None, positions_alone=False):
    """Return rows whose wheel speeds are joint states, with zeros of a second node in between."""
    found, angles, header = [], np.zeros(4), None
    for row in rows:
        if row.topic != "/encoder_data":
            found.append(row)
            continue
        speeds = np.array([row.content.left] * 2 + [row.content.right] * 2) * signs
        angles, header = angles + speeds / 100, row.content.header
        velocity = np.zeros(0) if positions_alone else speeds
        found.append(joints(row.stamp_ns, header, NAMES, angles, velocity))
        if zeros is not None:
            names, velocity = zeros
            found.append(joints(row.stamp_ns + NS // 1000, header, names, np.zeros(4), velocity))
    return found


def joints(stamp_ns, header, names, positions, velocities):
    """Return a row of a joint state."""
    fields = {"position": positions, "velocity": np.array(velocities), "effort": np.zeros(0)}
    content = new(JOINT_STATE, header=header, name=list(names), **fields)
    return Row("/joint_states", JOINT_STATE, stamp_ns, content)


@pytest.mark.parametrize(
    "signs", [(1, 1, 1, 1), (1, 1, -1, -1), (-1, -1, 1, 1), (-1, -1, -1, -1), (1, -1, 1, 1)]
)
def test_wheels_that_turn_backwards_are_reversed(replay, long_rows, plain_joints, signs):
    """A side, both sides or one joint: the drive is the same, and it is said."""
    code, data, _ = replay(with_joints(long_rows, signs), *JOINTS)
    assert code == 0
    assert outcome(data) == outcome(plain_joints)
    assert data["health"] == {"ok": data["periods"]}
    assert ("reversed" in " ".join(data["remark_texts"])) == (min(signs) < 0)


@pytest.mark.parametrize(
    ("zeros", "positions_alone"),
    [
        ((NAMES[::-1], ()), False),
        ((NAMES, ()), False),
        ((NAMES, [0.0] * 4), False),
        ((NAMES, ()), True),
    ],
)
def test_joint_states_of_a_second_node_are_left_out(replay, rows, zeros, positions_alone):
    """Zeros in between are counted, named, and make health and exit code not ok."""
    code, data, _ = replay(with_joints(rows, (1,) * 4, zeros, positions_alone), *JOINTS)
    assert code == 3
    assert set(data["health"]) == {"degraded"}
    assert sum(data["refused_by_reason"]["/encoder_data"].values()) > 590
    assert any("got two: messages of one that stands still" in t for t in data["remark_texts"])
    assert data["scans"] > 50


def test_wheel_speeds_of_zero_in_between_are_left_out(replay, rows):
    """Zeros in the paper's own type have no positions that would tell."""
    more = [
        replace(
            restamped(row, stamp_of(row) + NS // 1000),
            stamp_ns=row.stamp_ns + NS // 1000,
        )
        for row in rows
        if row.topic == "/encoder_data"
    ]
    more = [replace(row, content=replace(row.content, left=0.0, right=0.0)) for row in more]
    code, data, _ = replay([*rows, *more])
    assert code == 3
    assert set(data["health"]) == {"degraded"}
    assert sum(data["refused_by_reason"]["/encoder_data"].values()) > 590


@pytest.mark.parametrize("size", [4, 10, 25])
def test_bursts_of_an_imu_are_spread(replay, rows, plain, size):
    """Readings that arrive together are put back to their times, and it is said."""

    def arrived(row, k):
        late = (size - 1 - k % size) * (NS // 100 - NS // 10_000)
        return replace(restamped(row, stamp_of(row) + late), stamp_ns=row.stamp_ns + late)

    code, data, _ = replay(edited(rows, "/imu", arrived))
    assert code == 0
    assert data["scans"] == plain["scans"]
    assert data["unknown_share"] == pytest.approx(plain["unknown_share"], abs=1e-3)
    (text,) = data["remark_texts"]
    assert text.startswith("/imu: readings come in bursts of ")
    assert "100 a second" in text


def negated(row, _):
    """Return an inertial row with gravity instead of specific force."""
    force = row.content.linear_acceleration
    force = replace(force, x=-force.x, y=-force.y, z=-force.z)
    return replace(row, content=replace(row.content, linear_acceleration=force))


def test_accelerations_of_the_wrong_sign_are_reversed(replay, rows, plain):
    """The gyro agrees with the wheels only about the other vertical; the option says the same."""
    wrong = edited(rows, "/imu", negated)
    code, data, _ = replay(wrong)
    assert code == 0
    assert outcome(data) == outcome(plain)
    assert "accelerations have the wrong sign" in " ".join(data["remark_texts"])
    _, given, _ = replay(wrong, "--unit", "acceleration=-1")
    assert outcome(given) == outcome(plain)
    assert given["remark_texts"] == []


def test_without_a_turn_both_causes_of_a_force_downwards_are_named(replay):
    """The sign's option gives the same drive; the mounting's is for an IMU upside down."""
    straight = computed_bags.drive(8.0, turning=0.0)
    _, plain, _ = replay(straight)
    code, _, err = replay(edited(straight, "/imu", negated))
    assert code == 1
    assert "--mounting imu=0,0,0,180,0,YAW" in err
    assert "--unit acceleration=-1" in err
    code, data, _ = replay(edited(straight, "/imu", negated), "--unit", "acceleration=-1")
    assert code == 0
    assert outcome(data) == outcome(plain)


def test_fixes_whose_status_was_never_set_are_used(replay, rows, plain):
    """They count by their numbers, with a remark."""

    def unset(row, _, status=-2):
        message = row.content
        return replace(row, content=replace(message, status=replace(message.status, status=status)))

    code, data, _ = replay(edited(rows, "/fix", unset))
    assert code == 0
    assert outcome(data) == outcome(plain)
    assert data["health"] == plain["health"]
    assert "/fix: 6: the status was never set (-2)" in " ".join(data["remark_texts"])
    code, _, err = replay(edited(rows, "/fix", lambda row, k: unset(row, k, -1)))
    assert code == 1
    assert "7 fixes whose status says that there is none" in err


def placed(rows, *sources):
    """Return rows with the laser in a frame of its own, and its transforms by topic."""
    builder = MessageBuilder(1)
    found = edited(
        rows,
        "/laser_cloud",
        lambda row, _: replace(row, content=reframed(row.content, "lidar_link")),
    )
    for topic, parent, degrees in sources:
        stamps = [rows[0].stamp_ns] if topic == "/tf_static" else [r.stamp_ns for r in rows[::30]]
        place = (parent, "lidar_link", (0, 0, 0.72), (0, 0, degrees))
        found += [
            Row(topic, TF, at, new(TF, transforms=[stamped(builder, place, at)])) for at in stamps
        ]
    return found


@pytest.mark.parametrize("topics", [("/tf_static", "/tf"), ("/tf_static", "/tf_static")])
def test_a_laser_with_two_poses_is_refused_and_the_option_chooses(replay, rows, topics):
    """Both poses are in the message as the option takes them; the right one gives the scans."""
    _, right, _ = replay(placed(rows, ("/tf_static", "base_link", 0)))
    base = [(topic, "base_link", degrees) for topic, degrees in zip(topics, (90, 0), strict=True)]
    both = placed(rows, *base)
    code, _, err = replay(both)
    assert code == 1
    assert "0,0,0.72,0,0,90 by" in err
    assert "0,0,0.72,0,0,0 by" in err
    assert "--mounting laser=" in err
    code, data, _ = replay(both, "--mounting", "laser=0,0,0.72,0,0,0")
    assert code == 0
    assert outcome(data) == outcome(right)
    assert "contradict each other" in " ".join(data["remark_texts"])


def test_two_sources_of_one_pose_are_said_and_selves_ignored(replay, rows):
    """Both are remarks, and the drive is the same."""
    sources = [("/tf_static", "lidar_link", 0), ("/tf_static", "base_link", 0)]
    _, right, _ = replay(placed(rows, sources[1]))
    code, data, _ = replay(placed(rows, *sources, ("/tf", "base_link", 1)))
    assert code == 0
    assert outcome(data) == outcome(right)
    texts = " ".join(data["remark_texts"])
    assert "agree within 5 cm and 3 degrees: lidar_link" in texts
    assert "frame to itself are ignored: lidar_link" in texts


def second(rows, topic, frame, edit):
    """Return rows with edited copies of a topic's messages 2 ms later, of a second source."""
    more = [
        replace(
            restamped(edit(row, k), stamp_of(row) + NS // 500), stamp_ns=row.stamp_ns + NS // 500
        )
        for k, row in enumerate(row for row in rows if row.topic == topic)
    ]
    return [*rows, *(replace(row, content=reframed(row.content, frame)) for row in more)]


def moved_north(row, _):
    """Return a fix 22 m further north."""
    return replace(row, content=replace(row.content, latitude=row.content.latitude + 2e-4))


def faster(row, _):
    """Return wheel speeds of a driver that counts in another unit."""
    m = row.content
    return replace(row, content=replace(m, left=9.55 * m.left, right=9.55 * m.right))


@pytest.mark.parametrize(
    ("topic", "edit"),
    [("/imu", negated), ("/fix", moved_north), ("/encoder_data", faster)],
)
def test_a_second_source_on_the_topic_is_refused_and_the_option_chooses(
    replay, rows, plain, topic, edit
):
    """Each step that is advised is right: with the true source the drive is the same."""
    both = second(rows, topic, "second", edit)
    code, _, err = replay(both)
    assert code == 1
    assert err.startswith(f"error: {topic}: expected")
    choices = re.findall(r"--source (\S+)", err)
    assert len(choices) == 2
    first = next(choice for choice in choices if choice != f"{topic}=second")
    code, data, _ = replay(both, "--source", first)
    assert code == 0
    assert outcome(data) == outcome(plain)
    (text,) = data["remark_texts"]
    assert f"messages of other sources than {first.partition('=')[2]} are not read" in text


def test_sources_that_agree_are_both_used_and_said(replay, rows):
    """One remark names both, and nothing is refused."""
    code, data, _ = replay(second(rows, "/imu", "imu2_link", lambda row, _: row))
    assert code == 0
    texts = [text for text in data["remark_texts"] if text.startswith("/imu: ")]
    assert len(texts) == 1
    assert "readings come from two sources, frame " in texts[0]
    assert set(data["health"]) == {"ok"}


def test_a_source_that_no_message_has_is_refused(replay, rows):
    """The error names those that there are."""
    code, _, err = replay(rows, "--source", "/imu=elsewhere")
    assert code == 1
    assert "--source /imu: expected one of frame base_link, got elsewhere" in err
    code, _, err = replay(rows, "--source", "/gyro=a")
    assert code == 1
    assert "--source: expected one of /" in err


def test_wheels_of_another_unit_on_a_straight_drive_contradict_the_fixes(replay):
    """Without a turn the fixes alone tell; the unit that is advised mends it."""
    straight = computed_bags.drive(20.0, turning=0.0, speed=0.6)

    def slow(row, _):
        m = row.content
        return replace(row, content=replace(m, left=m.left / 10, right=m.right / 10))

    wrong = edited(straight, "/encoder_data", slow)
    code, data, _ = replay(wrong)
    assert code == 0
    assert "ok" not in data["health"]
    assert any("of the way that the wheels report" in text for text in data["remark_texts"])
    _, mended, _ = replay(wrong, "--unit", "wheels=m/s")
    assert mended["health"] == {"ok": mended["periods"]}
    assert mended["remark_texts"] == []


def test_a_gyro_of_the_wrong_sign_contradicts_the_wheels(replay, rows, plain):
    """The failed check names the option, and with it the drive is the same."""

    def turned_round(row, _):
        rate = row.content.angular_velocity
        rate = replace(rate, x=-rate.x, y=-rate.y, z=-rate.z)
        return replace(row, content=replace(row.content, angular_velocity=rate))

    wrong = edited(rows, "/imu", turned_round)
    _, data, _ = replay(wrong)
    assert "ok" not in data["health"]
    assert any("--unit angular_velocity=-1" in text for text in data["remark_texts"])
    code, mended, _ = replay(wrong, "--unit", "angular_velocity=-1")
    assert code == 0
    assert outcome(mended) == outcome(plain)
    assert mended["remark_texts"] == []


def moved(row, shift):
    """Return a row that is stamped and recorded later [ns]."""
    return replace(restamped(row, stamp_of(row) + shift), stamp_ns=row.stamp_ns + shift)


@pytest.mark.parametrize(
    ("topic", "seconds"),
    [("/imu", 0.2), ("/mag_orientation", -0.2), ("/encoder_data", 0.2), ("/imu", 0.089)],
)
def test_stamps_of_one_sensor_that_are_late_are_said_and_the_option_mends_them(
    replay, rows, topic, seconds
):
    """Each option that is advised leads to a replay without a remark."""
    late = edited(rows, topic, lambda row, _: moved(row, round(seconds * NS)))
    code, data, _ = replay(late)
    assert code == 0
    (text,) = data["remark_texts"]
    options = re.findall(r"--time-offset (\S+)=(\S+)", text)
    assert options[0][0] == topic
    assert float(options[0][1]) == pytest.approx(-seconds, abs=0.02)
    for name, value in options:
        code, data, _ = replay(late, "--time-offset", f"{name}={value}")
        assert code == 0
        assert data["remark_texts"] == []
        assert data["health"] == {"ok": data["periods"]}


def test_a_time_offset_is_that_of_the_stamps(replay, rows, plain):
    """Stamps that are moved by a time and back give the same drive."""
    late = edited(rows, "/imu", lambda row, _: moved(row, NS // 5))
    code, data, _ = replay(late, "--time-offset", "/imu=-0.2")
    assert code == 0
    assert outcome(data) == outcome(plain)
