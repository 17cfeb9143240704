"""Every step that a replay advises leads to the right drive when it is followed."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.records.messages import NS
from tests.support import computed_bags
from tests.support.computed_bags import Row, new, write
from tests.support.edited_bags import moved_cloud, reframed, turn, turned, turned_imu

IMU, WHEELS, FIELD, FIX, CLOUD = (
    "/imu",
    "/encoder_data",
    "/mag_orientation",
    "/fix",
    "/laser_cloud",
)
_FIRST_CLOUD = 7
"""Time of the first cloud of the straight drive [s]: fixes have to spread, clouds take time."""

HANGING = turn((180, 0, 0))


@pytest.fixture(scope="module")
def drives():
    """Messages of a winding and of a straight drive."""
    straight = computed_bags.drive(10.0, turning=0.0, speed=1.2)
    first = straight[0].stamp_ns + _FIRST_CLOUD * NS
    straight = [row for row in straight if row.topic != CLOUD or row.stamp_ns > first]
    return {"winding": computed_bags.drive(7.0), "straight": straight}


@pytest.fixture
def replay(capsys, tmp_path):
    """Replay of rows: exit code, result, and all that was said."""

    def run(rows, words=(), path=None):
        path = path or write(tmp_path / "edited.bag", rows)
        capsys.readouterr()
        code = main(
            ["bag", "replay", str(path), "--controller", "straight", "--quiet", "--json", *words]
        )
        out, err = capsys.readouterr()
        data = json.loads(out) if out else {"scans": 0, "health": {}, "remark_texts": []}
        return code, data, " ".join([err, *data["remark_texts"]])

    return run


def edited(topic, edit):
    """Return a function that edits the messages of a topic."""

    def change(rows):
        return [
            replace(row, content=edit(row.content)) if row.topic == topic else row for row in rows
        ]

    return change


def scaled(topic, **factors):
    """Return a function that multiplies vectors or numbers of a topic's messages."""

    def edit(message):
        fields = {}
        for name, factor in factors.items():
            value = getattr(message, name)
            if hasattr(value, "x"):
                value = replace(value, x=factor * value.x, y=factor * value.y, z=factor * value.z)
            else:
                value = factor * value
            fields[name] = value
        return replace(message, **fields)

    return edited(topic, edit)


def renamed(topic, name, spare: Callable | None = None):
    """Return a function that renames a topic, with edited messages under its old name if given."""

    def change(rows):
        found = [replace(row, topic=name) if row.topic == topic else row for row in rows]
        return found + ([] if spare is None else spare([r for r in rows if r.topic == topic]))

    return change


def arm(rows):
    """Return joint states of an arm instead of wheel speeds."""
    fields = {"position": np.zeros(2), "velocity": np.zeros(2), "effort": np.zeros(0)}
    kind = "sensor_msgs/msg/JointState"
    return [
        Row(
            r.topic,
            kind,
            r.stamp_ns,
            new(kind, header=r.content.header, name=["elbow", "hand"], **fields),
        )
        for r in rows
    ]


def with_status(rows):
    """Return fixes whose status says that there is none."""
    return [
        replace(r, content=replace(r.content, status=replace(r.content.status, status=-1)))
        for r in rows
    ]


def standing(rows):
    """Return wheel speeds of wheels that stand."""
    return [replace(r, content=replace(r.content, left=0.0, right=0.0)) for r in rows]


def as_string(rows):
    """Return messages of a type without readings."""
    kind = "std_msgs/msg/String"
    return [Row(r.topic, kind, r.stamp_ns, new(kind, data="")) for r in rows]


def hanging(message):
    """Return a laser's cloud as of one that hangs upside down at its height."""
    return moved_cloud(message, lambda points, _: HANGING.inv().apply(points), "sensor")


def higher(message):
    """Return a cloud as of a laser that is mounted half a metre higher."""
    return moved_cloud(message, lambda points, _: points - np.array([0, 0, 0.5]), "sensor")


@dataclass(frozen=True)
class Case:
    """Input, the advice that it gets, and the step that follows it.

    Attributes:
        change: Function of the rows of a sound drive.
        advice: Text of the advice, as it is printed.
        step: Options to type: where the advice is a concrete option, just this one.
        drive: Name of the drive.
    """

    change: Callable
    advice: str
    step: tuple[str, ...]
    drive: str = "winding"


def given(text, *step, drive="winding"):
    """Return a function from a change to a case; the advice itself is the step without another."""
    return lambda change: Case(change, text, step or tuple(text.split()), drive)


CASES = {
    "accelerations in ft/s2": given(
        "--unit acceleration=g or a number", "--unit", "acceleration=0.3048"
    )(scaled(IMU, linear_acceleration=3.28084)),
    "gyro in mrad/s": given(
        "--unit angular_velocity=deg/s or a number", "--unit", "angular_velocity=0.001"
    )(scaled(IMU, angular_velocity=1000.0)),
    "gyro of the wrong sign": given("--unit angular_velocity=-1")(
        scaled(IMU, angular_velocity=-1.0)
    ),
    "accelerations of the wrong sign": given("--unit acceleration=-1", drive="straight")(
        scaled(IMU, linear_acceleration=-1.0)
    ),
    "wheels in counts": given("--unit wheels=rpm or a number", "--unit", "wheels=0.0005")(
        scaled(WHEELS, left=2000.0, right=2000.0)
    ),
    "wheels backwards": given("--unit wheels=-1", drive="straight")(
        scaled(WHEELS, left=-1.0, right=-1.0)
    ),
    "wheels in m/s": given("--unit wheels=m/s", drive="straight")(
        scaled(WHEELS, left=0.1, right=0.1)
    ),
    "wheels in another unit": given(
        "--unit wheels=m/s or a factor", "--unit", "wheels=5", drive="straight"
    )(scaled(WHEELS, left=0.2, right=0.2)),
    "larger wheels": given(
        "--set robot.wheel_radius=...", "--set", "robot.wheel_radius=0.4", drive="straight"
    )(scaled(WHEELS, left=0.25, right=0.25)),
    "wheels that are not driven": given(
        "--map /encoder_data=...", "--map", "/encoder_data=/driven", drive="straight"
    )(renamed(WHEELS, "/driven", standing)),
    "joints of an arm": given(
        "--map /encoder_data names another topic", "--map", "/encoder_data=/w"
    )(renamed(WHEELS, "/w", arm)),
    "another type": given("--map names another topic for /imu", "--map", "/imu=/my/imu")(
        renamed(IMU, "/my/imu", as_string)
    ),
    "another name": given("--map gives their names in the recording", "--map", "/imu=/my/imu")(
        renamed(IMU, "/my/imu")
    ),
    "a receiver without a signal": given(
        "--map /fix=TOPIC names another receiver", "--map", "/fix=/rtk"
    )(renamed(FIX, "/rtk", with_status)),
    "two names": given("--map /imu=/imu/data")(
        lambda rows: [*rows, *(replace(row, topic="/imu/data") for row in rows if row.topic == IMU)]
    ),
    "a frame that nobody knows": given(
        "--mounting imu=X,Y,Z,ROLL,PITCH,YAW", "--mounting", "imu=0,0,0,0,0,0"
    )(edited(IMU, lambda m: reframed(m, "imu_link"))),
    "an IMU upside down": given(
        "--mounting imu=0,0,0,180,0,YAW", "--mounting", "imu=0,0,0,180,0,0"
    )(edited(IMU, lambda m: turned_imu(m, HANGING, m.header.frame_id))),
    "an IMU on its side": given("--mounting imu=0,0,0,90,0,YAW", "--mounting", "imu=0,0,0,90,0,0")(
        edited(IMU, lambda m: turned_imu(m, turn((-90, 0, 0)), m.header.frame_id))
    ),
    "a compass upside down": given(
        "--mounting compass=X,Y,Z,ROLL,PITCH,YAW", "--mounting", "compass=0,0,0,180,0,0"
    )(edited(FIELD, lambda m: replace(m, magnetic_field=turned(m.magnetic_field, HANGING)))),
    "a laser upside down": given("--mounting laser=0,0,0.72,180,0,0")(edited(CLOUD, hanging)),
    "a laser half a metre higher": given(
        "the laser is 1.22 m above it, not 0.72 m", "--sensor-height", "1.22"
    )(edited(CLOUD, higher)),
    "a datum far away": given("give --datum", "--datum", "36.715,-4.478")(
        lambda rows: (rows, ("--datum", "40,3"))
    ),
    "half a datum": given("--datum LAT,LON gives both", "--datum", "36.715,-4.478")(
        lambda rows: (rows, ("--set", "sensing.geo_reference.latitude_deg=36.715"))
    ),
}


@pytest.fixture(scope="module")
def scans():
    """Numbers of scans of the sound drives, by name, once they are known."""
    return {}


@pytest.mark.parametrize("name", CASES)
def test_the_advised_step_leads_to_the_sound_drive(replay, drives, scans, name):
    """The step ends the advice, with all scans, and nothing but ok."""
    case = CASES[name]
    if case.drive not in scans:
        scans[case.drive] = replay(drives[case.drive])[1]["scans"]
    rows, words = case.change(drives[case.drive]), ()
    if isinstance(rows, tuple):
        rows, words = rows
    _, _, said = replay(rows, words)
    assert case.advice in said
    code, data, said = replay(rows, case.step)
    assert code == 0, said
    assert case.advice not in said
    assert data["scans"] == scans[case.drive]
    assert data["health"] == {"ok": data["periods"]}, said


def test_each_of_two_clouds_that_are_named_can_be_chosen(replay, drives):
    """The error names both as the option takes them."""
    rows = renamed(CLOUD, "/front")(drives["winding"])
    rows += [replace(row, topic="/rear") for row in rows if row.topic == "/front"]
    code, _, said = replay(rows)
    assert code == 1
    names = re.search(r"--cloud: expected one of (\S+), (\S+), got none; choose one", said).groups()
    assert set(names) == {"/front", "/rear"}
    for cloud in names:
        code, data, _ = replay(rows, ("--cloud", cloud))
        assert code == 0
        assert data["scans"] > 50


def test_the_advised_salvage_gives_a_recording_that_replays(
    replay, drives, tmp_path, monkeypatch, capsys
):
    """The line that a damaged recording's error names is typed as it is, with a new name."""
    path = write(tmp_path / "cut.bag", drives["winding"])
    path.write_bytes(path.read_bytes()[: 3 * path.stat().st_size // 4])
    code, _, said = replay((), path=path)
    assert code == 1
    (line,) = re.findall(r"`andabata (bag salvage \S+ --out NEW)`", said)
    monkeypatch.chdir(tmp_path)
    assert main([*line.replace("NEW", "new.bag").split(), "--quiet"]) == 3
    code, data, _ = replay((), path=tmp_path / "new.bag")
    assert code == 0
    assert data["scans"] > 20
