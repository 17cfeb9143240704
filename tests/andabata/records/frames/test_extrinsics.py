"""Poses of sensors, applied to clouds, rows and the head."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.records.frames.extrinsics import Extrinsics, PendingTransformError
from andabata.records.frames.names import FrameError, rotation_by_name
from andabata.records.frames.sensor_pose import UNNAMED, GivenMounting
from andabata.records.frames.transform_tree import TransformTree
from andabata.records.messages import NS
from tests.support.edited_bags import stamped, turn
from tests.support.frame_trees import COMPOSE, NONE, tree_of
from traversability.cloud import PointCloud


def cloud(points, frame, stamps=None):
    """Return a cloud with a time of 0 for each point, or with stamps."""
    points = np.array(points, dtype=np.float32)
    return PointCloud(points, frame, np.zeros(len(points)) if stamps is None else stamps)


@pytest.mark.parametrize("frame", ["base_link", "/base_link", "husky1/base_footprint"])
def test_a_cloud_in_the_bodys_frame_stays_to_the_bit(frame):
    """A frame of the body changes no point."""
    given = cloud([[1, 2, 3]], frame)
    found = Extrinsics().transform_cloud(given, 0.0)
    assert found.frame == "base_link"
    assert found.points is given.points


@pytest.mark.parametrize("frame", ["lidar", "velodyne", "", "sensor"])
def test_a_cloud_in_an_unknown_frame_is_the_sensors_own(frame):
    """Any other frame is level at the laser height, with a remark unless it is ours."""
    given = cloud([[1, 2, 3]], frame)
    extrinsics = Extrinsics()
    found = extrinsics.transform_cloud(given, 0.0)
    assert found.frame == "sensor"
    assert found.points is given.points
    assert any("velodyne" in text for text in extrinsics.remarks) == (frame == "velodyne")
    shown = extrinsics.as_dict(0.72)["laser"]
    assert shown == {"frame": frame, "transform": [0, 0, 0.72, 0, 0, 0], "source": "assumed"}


@pytest.mark.parametrize(
    ("frame", "ahead"),
    [("os_lidar", [-1, 0, 0]), ("camera_depth_optical_frame", [0, 0, 1]), ("imu_ned", [1, 0, 0])],
)
def test_names_that_imply_a_rotation_are_applied(frame, ahead):
    """A conventional name rotates the cloud, with a remark."""
    rotation, _ = rotation_by_name(f"/robot/{frame}")
    np.testing.assert_allclose(rotation.apply(ahead), [1, 0, 0], atol=1e-12)
    extrinsics = Extrinsics()
    found = extrinsics.transform_cloud(cloud([ahead], frame), 0.0)
    np.testing.assert_allclose(found.points, [[1, 0, 0]], atol=1e-6)
    assert found.frame == "sensor"
    assert "as its name says" in extrinsics.remarks[0]


def test_transforms_outrank_names_and_options_outrank_both():
    """An option outranks /tf, which outranks the name; the contradiction is remarked on."""
    tree = tree_of(("base_link", "os_lidar", (0.3, 0, 0.9), (0, 0, 90)))
    extrinsics = Extrinsics(tree=tree)
    found = extrinsics.transform_cloud(cloud([[1, 0, 0]], "os_lidar"), 0.0)
    np.testing.assert_allclose(found.points, [[0.3, 1, 0.9]], atol=1e-6)
    assert found.frame == "base_link"
    assert extrinsics.as_dict(0.72)["laser"]["source"] == "tf_static"
    given = GivenMounting(0.1, 0.0, None, turn((0, 0, 180)))
    for key in (UNNAMED, "laser"):
        extrinsics = Extrinsics({key: given}, tree)
        found = extrinsics.transform_cloud(cloud([[1, 0, 0]], "os_lidar"), 0.0)
        np.testing.assert_allclose(found.points, [[-0.9, 0, 0]], atol=1e-6)
        assert found.frame == "sensor"  # At robot.lidar_height.
        assert "/tf_static puts frame os_lidar at 0.3,0,0.9,0,0,90" in extrinsics.remarks[0]


def test_only_a_named_option_moves_a_cloud_in_the_bodys_frame():
    """The bare option leaves clouds of the base as they are."""
    given = GivenMounting(0.0, 0.0, 0.5, Rotation.identity())
    bare = Extrinsics({UNNAMED: given}).transform_cloud(cloud([[1, 0, 0]], "base_link"), 0.0)
    np.testing.assert_allclose(bare.points, [[1, 0, 0]])
    named = Extrinsics({"laser": given}).transform_cloud(cloud([[1, 0, 0]], "base_link"), 0.0)
    np.testing.assert_allclose(named.points, [[1, 0, 0.5]])
    assert named.frame == "base_link"


def test_points_of_a_moving_frame_are_placed_by_their_own_stamps():
    """Each point gets the transform of its instant; later ones wait."""
    tree = tree_of(
        moving=[(5.0 + k / 10, ("base_link", "head", (0, 0, 1), (0, 0, 9 * k))) for k in range(11)]
    )
    extrinsics = Extrinsics(tree=tree)
    stamps = np.array([0.0, 0.5, 1.0])
    found = extrinsics.transform_cloud(cloud([[1, 0, 0]] * 3, "head", stamps), 5.0)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(found.points, [[1, 0, 1], [half, half, 1], [0, 1, 1]], atol=1e-6)
    assert extrinsics.as_dict(0.7)["laser"]["transform"] is None
    with pytest.raises(PendingTransformError, match=r"until 6\.000 s"):
        extrinsics.transform_cloud(cloud([[1, 0, 0]], "head", np.array([1.5])), 5.0)


def test_a_levelled_footprint_differs_from_a_fixed_one():
    """A base_footprint that moves against base_link is levelled; the body keeps its height."""
    fixed = tree_of(("base_footprint", "base_link", (0, 0, 0.2), NONE))
    assert (
        Extrinsics(tree=fixed).transform_cloud(cloud([[1, 0, 0]], "base_footprint"), 0.0).frame
        == "base_link"
    )
    level = tree_of(
        ("base_link", "laser", (0, 0, 0.5), NONE),
        moving=[(t, ("base_footprint", "base_link", (0, 0, 0.2), (0, t, 0))) for t in range(9)],
    )
    extrinsics = Extrinsics(tree=level)
    assert (
        extrinsics.transform_cloud(cloud([[1, 0, 0]], "base_footprint"), 0.0).frame
        == "base_footprint"
    )
    # What is fixed to the body stays so: the filter tells the tilt.
    for frame, height in (("laser", 0.7), ("base_link", 0.2)):
        found = extrinsics.transform_cloud(cloud([[1, 0, 0]], frame), 0.0)
        assert found.frame == "base_link"
        np.testing.assert_allclose(found.points, [[1, 0, height]], atol=1e-6)


def test_a_frame_of_the_world_needs_transforms():
    """A frame fixed to the world is refused without /tf."""
    with pytest.raises(FrameError, match="fixed to the world"):
        Extrinsics().transform_cloud(cloud([[1, 0, 0]], "odom"), 0.0)
    tree = tree_of(moving=[(t, ("odom", "base_link", (t, 0, 0), NONE)) for t in range(3)])
    found = Extrinsics(tree=tree).transform_cloud(cloud([[5, 0, 0]], "odom", np.array([1.0])), 0.0)
    np.testing.assert_allclose(found.points, [[4, 0, 0]], atol=1e-6)


def test_gyro_force_and_field_are_rotated():
    """Vectors are rotated, fixes are not; the antenna is the offset of its frame."""
    tree = tree_of(("base_link", "imu_link", (1, 2, 3), (180, 0, 0)))
    extrinsics = Extrinsics(tree=tree)
    found = extrinsics.transform_row("imu", "/imu_link", [1, 2, 3, 4, 5, -9.8])
    np.testing.assert_allclose(found, [1, -2, -3, 4, -5, 9.8], atol=1e-12)
    np.testing.assert_allclose(
        extrinsics.transform_row("compass", "imu_link", [1, 2, 3]), [1, -2, -3]
    )
    assert extrinsics.transform_row("imu", "base_link", [1, 2, 3, 4, 5, 6]) == [1, 2, 3, 4, 5, 6]
    assert extrinsics.antenna is None
    fix = [36.7, -4.4, 60.0, 1.0]
    assert extrinsics.transform_row("gnss", "base_footprint", fix) == fix
    assert extrinsics.antenna is None
    assert extrinsics.transform_row("gnss", "imu_link", fix) == fix
    np.testing.assert_allclose(extrinsics.antenna, [1, 2, 3])


def test_an_imu_on_a_moving_frame_is_refused():
    """Only a laser may move against the base."""
    tree = tree_of(moving=[(t, ("base_link", "head", NONE, (0, 0, t))) for t in range(3)])
    extrinsics = Extrinsics(tree=tree)
    with pytest.raises(FrameError, match="that /tf moves"):
        extrinsics.transform_row("imu", "head", [0] * 6)
    assert extrinsics.remarks[0].startswith("imu: frame head: expected one that is fixed")


def test_a_frame_that_does_not_move_on_tf_is_static():
    """Equal transforms on /tf make a fixed pose."""
    same = ("base_link", "laser", (0.1, 0, 0.5), NONE)
    tree = tree_of(moving=[(float(k), same) for k in range(5)])
    assert tree.moving("laser", "base_link") == ()
    mount = Extrinsics(tree=tree).pose_of("laser", "laser")
    assert mount.source == "tf"
    np.testing.assert_allclose(mount.transform.translation, [0.1, 0, 0.5])


def test_a_frame_that_begins_to_move_is_noticed():
    """The first differing transform makes the pose a moving one."""
    tree = tree_of(moving=[(0.0, ("base_link", "head", NONE, NONE))])
    extrinsics = Extrinsics(tree=tree)
    assert extrinsics.pose_of("laser", "head").moving is None
    tree.add([stamped(COMPOSE, ("base_link", "head", NONE, (0, 0, 9)), NS)], static=False)
    assert extrinsics.pose_of("laser", "head").moving == ("head", "base_link")


def test_late_transforms_hold_from_then_on():
    """A transform that comes late replaces the assumption and its remark."""
    tree = TransformTree()
    extrinsics = Extrinsics(tree=tree)
    assert extrinsics.transform_row("imu", "imu_link", [0, 0, 1, 0, 0, 9.8])[2] == 1
    assert "the pose of frame imu_link is unknown" in extrinsics.remarks[0]
    tree.add([stamped(COMPOSE, ("base_link", "imu_link", NONE, (180, 0, 0)))], static=True)
    assert extrinsics.transform_row("imu", "imu_link", [0, 0, 1, 0, 0, -9.8])[2] == -1
    assert extrinsics.remarks == []


def test_sensors_settle_when_no_transform_is_missing():
    """All three sensors need data and a known pose."""
    tree = TransformTree()
    extrinsics = Extrinsics(tree=tree)
    assert not extrinsics.is_settled
    extrinsics.transform_cloud(cloud([[1, 0, 0]], "velodyne"), 0.0)
    extrinsics.transform_row("imu", "base_link", [0] * 6)
    extrinsics.transform_row("compass", "base_link", [0] * 3)
    assert not extrinsics.is_settled
    tree.add([stamped(COMPOSE, ("base_link", "velodyne", NONE, NONE))], static=True)
    assert extrinsics.is_settled


def test_the_head_is_placed_by_the_tree():
    """The head is at its joint; a base frame says nothing of the optical centre."""
    assert Extrinsics().head_pose("lidar") == (None, "sensor")
    assert Extrinsics().head_pose("base_link") == (None, "sensor")
    tree = tree_of(("base_link", "laser", (0.1, 0, 0.6), (0, 0, 90)))
    pose, frame = Extrinsics(tree=tree).head_pose("laser")
    np.testing.assert_allclose(pose, [0.1, 0, 0.6, 0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-12)
    assert frame == "base_link"
    turning = tree_of(
        ("base_link", "post", (0.2, 0, 0.5), NONE),
        moving=[(t, ("post", "head", (0, 0, 0.1), (0, 0, t))) for t in range(3)],
    )
    pose, _ = Extrinsics(tree=turning).head_pose("head")
    np.testing.assert_allclose(pose[:3], [0.2, 0, 0.5])
