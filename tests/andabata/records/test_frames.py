"""Frames: names, the tree of transforms, and where senses sit by them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.app.mountings import laser_mounting, read_mountings
from andabata.app.usage import UsageError
from andabata.records import topics
from andabata.records.bags import Bag, open_writer
from andabata.records.frames import FrameError, is_base, is_world, local, prefix, rotation_by_name
from andabata.records.messages import NS, MessageBuilder
from andabata.records.mounts import BARE, GivenMounting, Mounts, PendingTransformError
from andabata.records.topics import Topic
from andabata.records.transform_tree import Transform, TransformTree, read_transforms
from tests.edited_bags import stamped, transforms, turn
from traversability.cloud import PointCloud

BUILDER = MessageBuilder(1)
NONE = (0, 0, 0)


def tree_of(*placed, moving=()):
    """Return a tree of static transforms, and of moving ones with their stamps [s]."""
    tree = TransformTree()
    tree.add([stamped(BUILDER, each) for each in placed], static=True)
    tree.add([stamped(BUILDER, each, round(at * NS)) for at, each in moving], static=False)
    return tree


def place(tree, name):
    found = tree.find(name)
    return tree.lookup(found, tree.base_of(found))


@pytest.mark.parametrize(
    ("name", "tail", "robot"),
    [
        ("base_link", "base_link", ""),
        ("/base_link", "base_link", ""),
        ("base_footprint/", "base_footprint", ""),
        ("husky1/base_footprint", "base_footprint", "husky1"),
        ("/fleet/husky1/base_link", "base_link", "fleet/husky1"),
        (" base_link ", "base_link", ""),
    ],
)
def test_slashes_and_prefixes_change_no_meaning(name, tail, robot):
    assert local(name) == tail
    assert prefix(name) == robot
    assert is_base(name)


def test_other_names_are_no_base():
    assert not any(map(is_base, ("Base_Link", "camera_base_link", "lidar", "", "base")))
    assert all(map(is_world, ("map", "/odom", "husky1/odom", "camera_init", "odom_combined")))
    assert not any(map(is_world, ("lidar_map", "base_link", "os_lidar")))


def test_a_chain_of_transforms_leads_to_the_base():
    tree = tree_of(
        ("base_footprint", "base_link", (0, 0, 0.13), NONE),
        ("base_link", "mast", (0.2, 0, 0.5), (0, 0, 90)),
        ("mast", "velodyne", (0.1, 0, 0.1), (180, 0, 0)),
    )
    found = place(tree, "/velodyne")
    np.testing.assert_allclose(found.translation, [0.2, 0.1, 0.73], atol=1e-12)
    # x of the laser is the mast's x, which is the robot's y; its y is flipped.
    np.testing.assert_allclose(found.rotation.apply([1, 0, 0]), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(found.rotation.apply([0, 1, 0]), [1, 0, 0], atol=1e-12)
    point = np.array([[1.0, 2.0, 3.0]])
    np.testing.assert_allclose(found.inverse.apply(found.apply(point)), point, atol=1e-12)


def test_a_base_that_hangs_below_the_link_is_found():
    tree = tree_of(
        ("base_link", "base_footprint", (0, 0, -0.2), NONE),
        ("base_link", "imu", (0, 0.1, 0.3), NONE),
    )
    np.testing.assert_allclose(place(tree, "imu").translation, [0, 0.1, 0.5], atol=1e-12)


def test_a_prefix_is_found_and_the_own_robots_base_is_taken():
    tree = tree_of(
        ("map", "a/base_link", (5, 0, 0), NONE),
        ("map", "b/base_link", (9, 0, 0), NONE),
        ("a/base_link", "a/laser", (0.1, 0, 0), NONE),
        ("b/base_link", "b/laser", (0.2, 0, 0), NONE),
        ("b/base_link", "b/imu", (0.3, 0, 0), NONE),
    )
    assert tree.find("laser") is None  # Whose?
    assert tree.find("imu") == "b/imu"
    assert tree.base_of("b/imu") == "b/base_link"
    np.testing.assert_allclose(place(tree, "a/laser").translation, [0.1, 0, 0])


def test_transforms_in_between_are_interpolated():
    tree = tree_of(
        moving=[
            (10.0, ("base_link", "head", (0, 0, 0.5), (0, 0, 170))),
            (10.1, ("base_link", "head", (0.1, 0, 0.5), (0, 0, -170))),  # On through 180 degrees.
            (10.2, ("base_link", "head", (0.1, 0, 0.5), (0, 0, -150))),
        ]
    )
    assert tree.moving("head", "base_link") == ("head",)
    found = tree.lookup("head", "base_link", np.array([10.0, 10.05, 10.15, 10.25]))
    yaw = np.rad2deg(found.rotation.as_euler("ZYX")[:, 0]) % 360
    np.testing.assert_allclose(yaw, [170, 180, 200, 210], atol=1e-6)
    np.testing.assert_allclose(found.translation[:, 0], [0, 0.05, 0.1, 0.1], atol=1e-6)
    with pytest.raises(FrameError, match=r"expected transforms from head to base_link at"):
        tree.lookup("head", "base_link", np.array([10.5]))
    with pytest.raises(FrameError, match=r"got them from 10\.000 to 10\.200"):
        tree.lookup("head", "base_link", np.array([9.0]))


def test_what_comes_out_of_order_or_twice_is_put_in_order():
    rows = [(1.0, 0.0), (3.0, 2.0), (2.0, 1.0), (2.0, 1.5)]
    tree = tree_of(moving=[(at, ("base_link", "arm", (x, 0, 0), NONE)) for at, x in rows])
    found = tree.lookup("arm", "base_link", np.array([1.0, 2.0, 2.5]))
    np.testing.assert_allclose(found.translation[:, 0], [0.0, 1.5, 1.75])


def test_a_frame_that_does_not_move_on_tf_is_static():
    same = ("base_link", "laser", (0.1, 0, 0.5), NONE)
    tree = tree_of(moving=[(float(k), same) for k in range(5)])
    assert tree.moving("laser", "base_link") == ()
    mount = Mounts(tree=tree).mount("laser", "laser")
    assert mount.source == "tf"
    np.testing.assert_allclose(mount.transform.translation, [0.1, 0, 0.5])


def test_a_frame_that_begins_to_move_is_noticed():
    tree = tree_of(moving=[(0.0, ("base_link", "head", NONE, NONE))])
    mounts = Mounts(tree=tree)
    assert mounts.mount("laser", "head").moving is None
    tree.add([stamped(BUILDER, ("base_link", "head", NONE, (0, 0, 9)), NS)], static=False)
    assert mounts.mount("laser", "head").moving == ("head", "base_link")


def test_old_transforms_are_forgotten_and_new_ones_hold():
    tree = tree_of(moving=[(t / 10, ("base_link", "head", NONE, (0, 0, t))) for t in range(1000)])
    tree.forget(10.0)
    found = tree.lookup("head", "base_link", np.array([99.0]))
    assert found.rotation.as_euler("ZYX", degrees=True)[0, 0] % 360 == pytest.approx(270, abs=1e-6)
    with pytest.raises(FrameError, match=r"got them from 89\.900"):
        tree.lookup("head", "base_link", np.array([50.0]))


def test_loops_and_two_parents_are_refused_by_name():
    loop = tree_of(
        ("base_link", "base_footprint", NONE, NONE), ("base_footprint", "base_link", NONE, NONE)
    )
    with pytest.raises(FrameError, match="a loop: base_link -> base_footprint -> base_link"):
        loop.base_of("base_link")
    itself = tree_of(("laser", "laser", NONE, NONE))
    with pytest.raises(FrameError, match="a loop: laser -> laser"):
        itself.base_of("laser")
    two = tree_of(
        ("base_link", "mast", NONE, NONE),
        ("pole", "mast", NONE, NONE),
        ("mast", "laser", NONE, NONE),
        ("base_link", "imu", NONE, NONE),
    )
    with pytest.raises(FrameError, match="mast: expected one parent, got two: base_link and pole"):
        two.base_of("laser")
    assert two.base_of("imu") == "base_link"  # What is not on its way is not its matter.


def test_the_world_is_no_second_parent_of_the_base():
    for order in (1, -1):
        placed = [
            ("odom", "base_link", (7, 0, 0), NONE),
            ("base_footprint", "base_link", (0, 0, 0.2), NONE),
        ]
        tree = tree_of(*placed[::order], ("base_link", "imu", NONE, NONE))
        np.testing.assert_allclose(place(tree, "imu").translation, [0, 0, 0.2])


@pytest.mark.parametrize(
    ("quaternion", "words"),
    [
        ((0, 0, 0, 0), "quaternion of length 1, got 0"),
        ((0, 0, 0, 2), "quaternion of length 1, got 2"),
        ((0, 0, np.nan, 1), "finite numbers"),
    ],
)
def test_rotations_that_are_none_are_refused_by_name(quaternion, words):
    bad = stamped(BUILDER, ("base_link", "laser", NONE, NONE), quaternion=quaternion)
    tree = TransformTree()
    tree.add([bad], static=True)
    with pytest.raises(FrameError, match=f"from laser to base_link: expected.*{words}"):
        tree.base_of(tree.find("laser"))
    with pytest.raises(FrameError, match=words):
        Mounts(tree=tree).mount("laser", "laser")
    tree.add([stamped(BUILDER, ("base_link", "laser", (1, 0, 0), NONE))], static=True)
    assert place(tree, "laser").translation[0] == 1  # A good one of another publisher holds.


def test_rounded_rotations_are_taken():
    tree = TransformTree()
    tree.add(
        [stamped(BUILDER, ("base_link", "imu", NONE, NONE), quaternion=(0, 0, 0.707, 0.707))],
        static=True,
    )
    found = place(tree, "imu").rotation
    assert found.as_euler("ZYX", degrees=True)[0] == pytest.approx(90, abs=0.01)


def test_static_transforms_that_differ_are_said():
    one, other = ("base_link", "imu", (0, 0, 0.5), NONE), ("base_link", "imu", (0, 0, 1), NONE)
    tree = tree_of(one, one)
    assert tree.conflicts == []
    tree = tree_of(one, other)
    assert "from imu to base_link was published twice and differs" in tree.conflicts[0]
    assert Mounts(tree=tree).remarks[0].startswith("/tf: ")


def test_transforms_multiply_as_matrices_do():
    rng = np.random.default_rng(0)
    parts = [Transform(Rotation.random(random_state=k), rng.normal(size=3)) for k in range(2)]
    points = rng.normal(size=(5, 3))
    both = (parts[0] @ parts[1]).apply(points)
    np.testing.assert_allclose(both, parts[0].apply(parts[1].apply(points)), atol=1e-12)


# Where senses sit.


def cloud(points, frame, stamps=None):
    points = np.array(points, dtype=np.float32)
    return PointCloud(points, frame, np.zeros(len(points)) if stamps is None else stamps)


@pytest.mark.parametrize("frame", ["base_link", "/base_link", "husky1/base_footprint"])
def test_a_cloud_in_the_bodys_frame_stays_to_the_bit(frame):
    given = cloud([[1, 2, 3]], frame)
    found = Mounts().cloud(given, 0.0)
    assert found.frame == "base_link"
    assert found.points is given.points


@pytest.mark.parametrize("frame", ["lidar", "velodyne", "", "sensor"])
def test_a_cloud_in_an_unknown_frame_is_the_sensors_own(frame):
    given = cloud([[1, 2, 3]], frame)
    mounts = Mounts()
    found = mounts.cloud(given, 0.0)
    assert found.frame == "sensor"
    assert found.points is given.points
    assert any("velodyne" in text for text in mounts.remarks) == (frame == "velodyne")
    shown = mounts.as_dict(0.72)["laser"]
    assert shown == {"frame": frame, "transform": [0, 0, 0.72, 0, 0, 0], "source": "assumed"}


@pytest.mark.parametrize(
    ("frame", "ahead"),
    [("os_lidar", [-1, 0, 0]), ("camera_depth_optical_frame", [0, 0, 1]), ("imu_ned", [1, 0, 0])],
)
def test_names_that_tell_a_rotation_are_heeded_and_said(frame, ahead):
    rotation, _ = rotation_by_name(f"/robot/{frame}")
    np.testing.assert_allclose(rotation.apply(ahead), [1, 0, 0], atol=1e-12)
    mounts = Mounts()
    found = mounts.cloud(cloud([ahead], frame), 0.0)
    np.testing.assert_allclose(found.points, [[1, 0, 0]], atol=1e-6)
    assert found.frame == "sensor"
    assert "as its name says" in mounts.remarks[0]


def test_optical_and_ned_axes_point_left_and_down():
    optical, ned = rotation_by_name("x_optical_frame")[0], rotation_by_name("x_ned")[0]
    np.testing.assert_allclose(optical.apply([-1, 0, 0]), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(ned.apply([0, -1, 0]), [0, 1, 0], atol=1e-12)
    assert rotation_by_name("os_sensor") is None


def test_transforms_come_before_names_and_options_before_both():
    tree = tree_of(("base_link", "os_lidar", (0.3, 0, 0.9), (0, 0, 90)))
    mounts = Mounts(tree=tree)
    found = mounts.cloud(cloud([[1, 0, 0]], "os_lidar"), 0.0)
    np.testing.assert_allclose(found.points, [[0.3, 1, 0.9]], atol=1e-6)
    assert found.frame == "base_link"
    assert mounts.as_dict(0.72)["laser"]["source"] == "tf_static"
    told = GivenMounting(0.1, 0.0, None, turn((0, 0, 180)))
    for key in (BARE, "laser"):
        mounts = Mounts({key: told}, tree)
        found = mounts.cloud(cloud([[1, 0, 0]], "os_lidar"), 0.0)
        np.testing.assert_allclose(found.points, [[-0.9, 0, 0]], atol=1e-6)
        assert found.frame == "sensor"  # At robot.lidar_height.
        assert "/tf_static puts frame os_lidar at 0.3,0,0.9,0,0,90" in mounts.remarks[0]


def test_only_a_named_option_moves_what_is_in_the_bodys_frame():
    told = GivenMounting(0.0, 0.0, 0.5, Rotation.identity())
    bare = Mounts({BARE: told}).cloud(cloud([[1, 0, 0]], "base_link"), 0.0)
    np.testing.assert_allclose(bare.points, [[1, 0, 0]])
    named = Mounts({"laser": told}).cloud(cloud([[1, 0, 0]], "base_link"), 0.0)
    np.testing.assert_allclose(named.points, [[1, 0, 0.5]])
    assert named.frame == "base_link"


def test_points_of_a_turning_frame_are_placed_by_their_own_instants():
    tree = tree_of(
        moving=[(5.0 + k / 10, ("base_link", "head", (0, 0, 1), (0, 0, 9 * k))) for k in range(11)]
    )
    mounts = Mounts(tree=tree)
    stamps = np.array([0.0, 0.5, 1.0])
    found = mounts.cloud(cloud([[1, 0, 0]] * 3, "head", stamps), 5.0)
    half = np.sqrt(0.5)
    np.testing.assert_allclose(found.points, [[1, 0, 1], [half, half, 1], [0, 1, 1]], atol=1e-6)
    assert mounts.as_dict(0.7)["laser"]["transform"] is None
    with pytest.raises(PendingTransformError, match=r"until 6\.000 s"):
        mounts.cloud(cloud([[1, 0, 0]], "head", np.array([1.5])), 5.0)


def test_a_levelled_footprint_is_told_from_one_that_is_fixed():
    fixed = tree_of(("base_footprint", "base_link", (0, 0, 0.2), NONE))
    assert Mounts(tree=fixed).cloud(cloud([[1, 0, 0]], "base_footprint"), 0.0).frame == "base_link"
    level = tree_of(
        ("base_link", "laser", (0, 0, 0.5), NONE),
        moving=[(t, ("base_footprint", "base_link", (0, 0, 0.2), (0, t, 0))) for t in range(9)],
    )
    mounts = Mounts(tree=level)
    assert mounts.cloud(cloud([[1, 0, 0]], "base_footprint"), 0.0).frame == "base_footprint"
    # What is fixed to the body stays so: the filter tells the tilt.
    for frame, height in (("laser", 0.7), ("base_link", 0.2)):
        found = mounts.cloud(cloud([[1, 0, 0]], frame), 0.0)
        assert found.frame == "base_link"
        np.testing.assert_allclose(found.points, [[1, 0, height]], atol=1e-6)


def test_a_frame_of_the_world_needs_transforms():
    with pytest.raises(FrameError, match="fixed to the world"):
        Mounts().cloud(cloud([[1, 0, 0]], "odom"), 0.0)
    tree = tree_of(moving=[(t, ("odom", "base_link", (t, 0, 0), NONE)) for t in range(3)])
    found = Mounts(tree=tree).cloud(cloud([[5, 0, 0]], "odom", np.array([1.0])), 0.0)
    np.testing.assert_allclose(found.points, [[4, 0, 0]], atol=1e-6)


def test_gyro_and_force_are_turned_and_the_field_too():
    tree = tree_of(("base_link", "imu_link", (1, 2, 3), (180, 0, 0)))
    mounts = Mounts(tree=tree)
    found = mounts.row("imu", "/imu_link", [1, 2, 3, 4, 5, -9.8])
    np.testing.assert_allclose(found, [1, -2, -3, 4, -5, 9.8], atol=1e-12)
    np.testing.assert_allclose(mounts.row("compass", "imu_link", [1, 2, 3]), [1, -2, -3])
    assert mounts.row("imu", "base_link", [1, 2, 3, 4, 5, 6]) == [1, 2, 3, 4, 5, 6]
    assert mounts.antenna is None
    fix = [36.7, -4.4, 60.0, 1.0]
    assert mounts.row("gnss", "base_footprint", fix) == fix
    assert mounts.antenna is None
    assert mounts.row("gnss", "imu_link", fix) == fix
    np.testing.assert_allclose(mounts.antenna, [1, 2, 3])


def test_an_imu_on_a_turning_frame_is_refused():
    tree = tree_of(moving=[(t, ("base_link", "head", NONE, (0, 0, t))) for t in range(3)])
    mounts = Mounts(tree=tree)
    with pytest.raises(FrameError, match="that /tf moves"):
        mounts.row("imu", "head", [0] * 6)
    assert mounts.remarks[0].startswith("imu: frame head: expected one that is fixed")


def test_transforms_that_come_late_hold_from_then_on():
    tree = TransformTree()
    mounts = Mounts(tree=tree)
    assert mounts.row("imu", "imu_link", [0, 0, 1, 0, 0, 9.8])[2] == 1
    assert "nothing tells where frame imu_link is" in mounts.remarks[0]
    tree.add([stamped(BUILDER, ("base_link", "imu_link", NONE, (180, 0, 0)))], static=True)
    assert mounts.row("imu", "imu_link", [0, 0, 1, 0, 0, -9.8])[2] == -1
    assert mounts.remarks == []


def test_senses_settle_when_no_transform_is_missing():
    tree = TransformTree()
    mounts = Mounts(tree=tree)
    assert not mounts.is_settled
    mounts.cloud(cloud([[1, 0, 0]], "velodyne"), 0.0)
    mounts.row("imu", "base_link", [0] * 6)
    mounts.row("compass", "base_link", [0] * 3)
    assert not mounts.is_settled
    tree.add([stamped(BUILDER, ("base_link", "velodyne", NONE, NONE))], static=True)
    assert mounts.is_settled


def test_the_turning_lasers_head_sits_where_the_tree_says():
    assert Mounts().head("lidar") == (None, "sensor")
    assert Mounts().head("base_link") == (None, "sensor")
    tree = tree_of(("base_link", "laser", (0.1, 0, 0.6), (0, 0, 90)))
    pose, frame = Mounts(tree=tree).head("laser")
    np.testing.assert_allclose(pose, [0.1, 0, 0.6, 0, 0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-12)
    assert frame == "base_link"
    turning = tree_of(
        ("base_link", "post", (0.2, 0, 0.5), NONE),
        moving=[(t, ("post", "head", (0, 0, 0.1), (0, 0, t))) for t in range(3)],
    )
    pose, _ = Mounts(tree=turning).head("head")
    np.testing.assert_allclose(pose[:3], [0.2, 0, 0.5])


def test_a_recordings_transforms_are_read_from_every_topic_of_theirs(tmp_path):
    """Namespaced topics, several publishers, and a ROS 2 recording."""
    path, builder = tmp_path / "x.mcap", MessageBuilder(2)
    writer = open_writer(path)
    for k, (name, placed) in enumerate(
        [
            ("/tf_static", ("base_link", "mast", (0, 0, 1), NONE)),
            ("/husky1/tf_static", ("mast", "laser", (0, 0, 1), NONE)),
            ("/tf", ("base_footprint", "base_link", (0, 0, 0.25), NONE)),
        ]
    ):
        topic = Topic(name, name, topics.TF_STATIC.kind, None)
        message = transforms(builder, topics.TF_STATIC.kind, placed)
        writer.write(topic, builder.stamp_ns(k), message)
    writer.close()
    with Bag(path) as bag:
        tree = read_transforms(bag)
    assert tree.base_of("laser") == "base_footprint"
    assert not tree.is_static("laser", "base_footprint")
    np.testing.assert_allclose(place(tree, "laser").translation, [0, 0, 2.25])


@pytest.mark.parametrize("pitch", [90, -90])
def test_options_that_stand_upright_are_no_matter(pitch):
    given = read_mountings([f"laser=0.1,0.2,0.3,30,{pitch},40"])
    found = laser_mounting(given, 0.72)
    apart = found.rotation.inv() * turn((30, pitch, 40))
    assert apart.magnitude() == pytest.approx(0, abs=1e-6)
    assert (found.x, found.y, found.z) == (0.1, 0.2, 0.3)


def test_a_turn_over_half_is_the_other_way_round():
    (given,) = read_mountings(["0,0,0,0,270"]).values()
    assert given.z is None
    assert given.rotation.as_euler("ZYX", degrees=True)[0] == pytest.approx(-90)
    with pytest.raises(UsageError, match="yaw within 360 degrees, got 400"):
        read_mountings(["0,0,0,0,400"])
