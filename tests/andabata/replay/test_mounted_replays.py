"""Recordings of robots with other sensor mountings replay as ours do."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.app.cli import main
from andabata.records.messages import NS, MessageBuilder
from andabata.replay.result import RecordedComparison
from tests.support.edited_bags import (
    copy_bag,
    moved_cloud,
    reframed,
    stamped,
    turn,
    turned,
    turned_imu,
)

HEIGHT = 0.72
BUILDER = MessageBuilder(1)
CLOUD, IMU, FIELD = "/laser_cloud", "/imu", "/mag_orientation"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short drive with a 3D laser."""
    path = tmp_path_factory.mktemp("mounted") / "drive.bag"
    words = ["drive", "--world", "natural-test", "--seed", "3", "--controller", "reactive"]
    words += ["--out", str(path.parent / "out"), "--set", "plant=kinematic", "--no-clouds"]
    words += ["--sensor", "vlp-16", "--time-limit", "6", "--record", str(path)]
    assert main([*words, "--json", "--quiet"]) == 0
    return path


@pytest.fixture
def replay(recorded, capsys, monkeypatch):
    """Return a function that edits the drive and replays it: exit code, result or error, ranges."""
    add, seen = RecordedComparison.add, []

    def keep(self, period, step):
        seen.append(None if step.scan is None else step.scan.finite().copy())
        add(self, period, step)

    monkeypatch.setattr(RecordedComparison, "add", keep)

    def run(*options, **edits):
        path = recorded.with_name("edited.bag")
        copy_bag(recorded, path, **edits)
        seen.clear()
        capsys.readouterr()
        words = ["bag", "replay", str(path), "--controller", "reactive", "--json", "--quiet"]
        code = main([*words, *options])
        out, err = capsys.readouterr()
        scans = np.array([scan for scan in seen if scan is not None])
        return code, json.loads(out) if out else err, scans

    return run


@pytest.fixture(scope="module")
def plain(recorded):
    """The ranges of the unchanged copy, kept by the first test that asks."""
    return {}


@pytest.fixture
def same(replay, plain):
    """Return a function that replays an edited drive and compares it with the unchanged copy."""
    if "ranges" not in plain:
        code, data, plain["ranges"] = replay()
        assert code == 0
        assert not data["remark_texts"]

    def run(*options, code=0, **edits):
        found, data, ranges = replay(*options, **edits)
        assert found == code, data
        assert ranges.shape == plain["ranges"].shape
        assert (ranges > plain["ranges"] + 1).sum() == 0
        assert np.mean(ranges != plain["ranges"]) < 0.02  # Rounding moves a point over an edge.
        return data

    return run


def of_laser(rotation, shift, frame):
    """Return an edit: the laser's points in a frame that lies so in ``base_footprint``."""

    def move(points, _):
        return rotation.inv().apply(points - np.array(shift) + np.array([0, 0, HEIGHT]))

    def edit(topic, message):
        return moved_cloud(message, move, frame) if topic == CLOUD else message

    return edit


@pytest.mark.parametrize("frame", ["base_link", "/base_link", "husky1/base_footprint"])
def test_clouds_in_the_base_frame_are_not_lifted(same, frame):
    """Clouds in the base's frame are used without the laser's height."""
    data = same(edit=of_laser(Rotation.identity(), (0, 0, 0), frame))
    assert data["frames"]["laser"]["source"] == "name"
    assert not data["remark_texts"]


def test_a_laser_is_mounted_by_tf_static(same):
    """A laser's mounting is taken from static transforms."""
    degrees, shift = (180, 20, 130), (0.2, -0.1, 1.1)
    data = same(
        edit=of_laser(turn(degrees), shift, "velodyne"),
        static=[
            ("base_footprint", "base_link", (0, 0, 0.2), (0, 0, 0)),
            ("base_link", "velodyne", (0.2, -0.1, 0.9), degrees),
        ],
        static_after=3.0,  # Late: a recording is read as a whole.
    )
    assert data["frames"]["laser"]["source"] == "tf_static"
    found = data["frames"]["laser"]["transform"]
    np.testing.assert_allclose(found[:3], shift, atol=1e-6)


def test_a_laser_is_mounted_by_the_option(same):
    """A laser's mounting is taken from the command line."""
    edit = of_laser(turn((0, 15, 180)), (0.1, 0, 0.9), "velodyne")
    data = same("--mounting", "0.1,0,0,15,180", "--sensor-height", "0.9", edit=edit)
    assert data["frames"]["laser"]["source"] == "option"
    same("--mounting", "laser=0.1,0,0.9,0,15,180", edit=edit)


def test_ousters_frame_points_backwards(same):
    """The half turn of Ouster's sensor frame is applied by its transforms."""
    data = same(edit=of_laser(turn((0, 0, 180)), (0, 0, HEIGHT), "os_lidar"))
    assert data["frames"]["laser"]["source"] == "name"
    assert "os_lidar" in data["remark_texts"][0]


def test_a_rotating_head_is_followed_by_tf(same):
    """Each point is turned by the moving transform at its own time."""
    rate = 1.0

    def yaw(stamps):
        return rate * ((stamps - BUILDER.epoch_ns) / NS)

    def move(points, stamps):
        lifted = points + np.array([0, 0, HEIGHT - 0.5])
        return Rotation.from_euler("Z", -yaw(stamps)[:, None]).apply(lifted)

    def head(stamp):
        degrees = (0, 0, float(np.rad2deg(yaw(stamp))))
        return [stamped(BUILDER, ("base_link", "head", (0, 0, 0.5), degrees), stamp)]

    data = same(
        edit=lambda topic, message: (
            moved_cloud(message, move, "head") if topic == CLOUD else message
        ),
        moving=head,
    )
    assert data["frames"]["laser"] == {"frame": "head", "transform": None, "source": "tf"}


@pytest.mark.parametrize("degrees", [(180, 0, 0), (0, -90, 180), (10, 20, 30)])
def test_imu_and_compass_are_turned_by_tf_static(same, degrees):
    """Inertial and magnetic readings are turned into the base's axes."""
    into = turn(degrees).inv()

    def edit(topic, message):
        if topic == IMU:
            return turned_imu(message, into, "imu_link")
        if topic == FIELD:
            found = reframed(message, "mag_link")
            return type(found)(
                found.header, turned(found.magnetic_field, into), found.magnetic_field_covariance
            )
        return message

    data = same(
        edit=edit,
        static=[
            ("base_link", "imu_link", (0.1, 0, 0.3), degrees),
            ("imu_link", "mag_link", (0, 0, 0.1), (0, 0, 0)),
        ],
    )
    assert data["frames"]["imu"]["source"] == data["frames"]["compass"]["source"] == "tf_static"
    assert not data["remark_texts"]


def upside_down(topic, message):
    """Return an IMU's message as of one that hangs upside down."""
    return turned_imu(message, turn((180, 0, 0)), "base_link") if topic == IMU else message


def test_an_imu_that_hangs_upside_down_without_a_transform_is_refused(replay, same):
    """Gravity from the wrong side is an error that names the option."""
    code, error, scans = replay(edit=upside_down)
    assert code == 1
    assert "gravity points down in the IMU's frame" in error
    assert "--mounting imu=0,0,0,180,0,YAW" in error
    assert not len(scans)
    data = same("--mounting", "imu=0,0,180,0,0", edit=upside_down)
    assert data["frames"]["imu"]["source"] == "option"


def test_a_laser_that_hangs_upside_down_is_refused(replay, same):
    """Ground above the laser is an error."""
    edit = of_laser(turn((180, 0, 0)), (0, 0, HEIGHT), "velodyne")
    code, error, _ = replay(edit=edit)
    assert code == 1
    assert "the ground is above the laser" in error
    same("--mounting", "0,0,180,0,0", edit=edit)


def test_a_wrong_height_is_remarked(replay):
    """Ground at another height than the laser's mounting gives a remark."""
    edit = of_laser(Rotation.identity(), (0, 0, 1.2), "velodyne")
    code, data, _ = replay(edit=edit)
    assert code == 0
    assert "m below where robot.lidar_height puts it" in " ".join(data["remark_texts"])
    assert "the pose of frame velodyne is unknown" in " ".join(data["remark_texts"])


def test_sensors_without_a_known_mounting_are_refused_by_name(replay):
    """A frame without a transform is an error that names sensor and option."""
    code, error, _ = replay(edit=of_laser(Rotation.identity(), (0, 0, 0), "odom"))
    assert code == 1
    assert "laser: frame odom: expected a frame of the robot" in error
    assert "--mounting laser=" in error

    def turning(stamp):
        degrees = (0, 0, (stamp - BUILDER.epoch_ns) / NS * 10)
        return [stamped(BUILDER, ("base_link", "head", (0, 0, 0), degrees), stamp)]

    code, error, _ = replay(
        edit=lambda topic, message: reframed(message, "head") if topic == IMU else message,
        moving=turning,
    )
    assert code == 1
    assert "imu: frame head: expected one that is fixed to base_link" in error


def test_without_a_scan_the_exit_code_is_1(replay):
    """Clouds that come in a second frame, which is none of the robot's, after the first."""
    seen = []

    def edit(topic, message):
        seen.append(topic)
        strange = topic == CLOUD and seen.count(CLOUD) > 1
        return reframed(message, "odom") if strange else message

    code, data, _ = replay("--set", "assembly.accumulation_time=10", edit=edit)
    assert code == 1
    assert data["scans"] == 0
    assert data["refused"] > 30
    texts = " ".join(data["remark_texts"])
    assert "fixed to the world" in texts


def test_clouds_beyond_the_transforms_are_left_out_and_exit_3(replay):
    """Clouds outside of the time of the transforms are refused and counted."""
    begin = []

    def head(stamp):
        begin.append(stamp)
        if stamp > begin[0] + 4 * NS:
            return []
        place = ("base_link", "head", (0, 0, 0.72 + (stamp - begin[0]) / NS / 1e3), (0, 0, 0))
        return [stamped(BUILDER, place, stamp)]

    def edit(topic, message):
        return reframed(message, "head") if topic == CLOUD else message

    code, data, _ = replay(edit=edit, moving=head)
    assert code == 3
    assert data["scans"] > 10
    assert 5 < data["refused"] < 40
    assert "expected transforms from head to base_link until" in " ".join(data["remark_texts"])


def test_a_loop_of_frames_is_refused_by_name(replay):
    """Transforms in a loop are an error that names the frames."""
    edit = of_laser(Rotation.identity(), (0, 0, HEIGHT), "velodyne")
    loop = [
        ("base_link", "velodyne", (0, 0, 1), (0, 0, 0)),
        ("velodyne", "base_link", (0, 0, 1), (0, 0, 0)),
    ]
    code, error, _ = replay(edit=edit, static=loop)
    assert code == 1
    assert "got a loop" in error
    assert "--mounting laser=" in error or "--mounting imu=" in error


def test_the_antennas_lever_arm_is_taken_off(replay, recorded):
    """A fix of an antenna on a mast ahead is a fix of the robot, less the mast."""
    from andabata.localization.antenna import remove_lever_arm

    fixes = np.array([[1.0, 10.0, 20.0, 3.0, 0.5, 1.0]])
    north = turn((0, 0, 90)).as_quat()
    found = remove_lever_arm(fixes, north, np.array([2.0, 0.0, 1.0]))
    np.testing.assert_allclose(found, [[1.0, 10.0, 18.0, 2.0, 0.5, 1.0]], atol=1e-12)
    assert remove_lever_arm(fixes, north, None) is fixes
    code, data, _ = replay(
        edit=lambda topic, message: reframed(message, "gps") if topic == "/fix" else message,
        static=[("base_link", "gps", (0.5, 0, 1.0), (0, 0, 0))],
    )
    assert code == 0
    assert data["frames"]["gnss"]["transform"][:3] == [0.5, 0.0, 1.0]


@pytest.mark.parametrize(
    "option",
    ["1,2", "imu=0,0,0", "wheels=0,0,0,0,0", "0,0,x,0,0", "0,0,0,0,400", "nose=1,2,3,4,5,6"],
)
def test_an_invalid_mounting_is_a_usage_error(recorded, capsys, option):
    """Wrong numbers and unknown sensors are usage errors."""
    assert main(["bag", "replay", str(recorded), "--mounting", option]) == 2
    assert "expected" in capsys.readouterr().err


def test_a_sensor_is_mounted_once(recorded, capsys):
    """A second mounting of a sensor is a usage error."""
    twice = ["--mounting", "imu=0,0,0,0,0", "--mounting", "imu=0,0,0,0,1"]
    assert main(["bag", "replay", str(recorded), *twice]) == 2
    assert "expected imu once" in capsys.readouterr().err
