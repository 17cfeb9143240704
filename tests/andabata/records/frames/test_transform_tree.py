"""The tree of frames: paths, bases, interpolation in time, and faults by name."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.frames.names import FrameError
from andabata.records.frames.transform_tree import TransformTree, read_transforms
from andabata.records.messages import MessageBuilder
from andabata.records.topics import Topic
from tests.support.edited_bags import stamped, transforms
from tests.support.frame_trees import COMPOSE, NONE, place, tree_of


def test_a_chain_of_transforms_leads_to_the_base():
    """Transforms multiply along the path; the inverse leads back."""
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


def test_a_base_below_the_link_is_found():
    """A base_footprint that is a child of base_link is preferred, too."""
    tree = tree_of(
        ("base_link", "base_footprint", (0, 0, -0.2), NONE),
        ("base_link", "imu", (0, 0.1, 0.3), NONE),
    )
    np.testing.assert_allclose(place(tree, "imu").translation, [0, 0.1, 0.5], atol=1e-12)


def test_a_namespace_is_found_and_its_own_base_taken():
    """A name without a namespace is found if it is unique; the base is of the same robot."""
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


def test_transforms_are_interpolated_in_time():
    """Positions are interpolated linearly, rotations along the shorter arc; not beyond the ends."""
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


def test_transforms_out_of_order_are_sorted():
    """Late transforms are sorted in; of equal stamps the later message counts."""
    rows = [(1.0, 0.0), (3.0, 2.0), (2.0, 1.0), (2.0, 1.5)]
    tree = tree_of(moving=[(at, ("base_link", "arm", (x, 0, 0), NONE)) for at, x in rows])
    found = tree.lookup("arm", "base_link", np.array([1.0, 2.0, 2.5]))
    np.testing.assert_allclose(found.translation[:, 0], [0.0, 1.5, 1.75])


def test_old_transforms_are_pruned():
    """Pruning keeps the latest seconds and nothing before."""
    tree = tree_of(moving=[(t / 10, ("base_link", "head", NONE, (0, 0, t))) for t in range(1000)])
    tree.prune(10.0)
    found = tree.lookup("head", "base_link", np.array([99.0]))
    assert found.rotation.as_euler("ZYX", degrees=True)[0, 0] % 360 == pytest.approx(270, abs=1e-6)
    with pytest.raises(FrameError, match=r"got them from 89\.900"):
        tree.lookup("head", "base_link", np.array([50.0]))


def test_loops_and_two_parents_are_refused_by_name():
    """Loops and second parents are errors on their paths alone."""
    loop = tree_of(
        ("base_link", "base_footprint", NONE, NONE), ("base_footprint", "base_link", NONE, NONE)
    )
    with pytest.raises(FrameError, match="a loop: base_link -> base_footprint -> base_link"):
        loop.base_of("base_link")
    two = tree_of(
        ("base_link", "mast", NONE, NONE),
        ("pole", "mast", NONE, NONE),
        ("mast", "laser", NONE, NONE),
        ("base_link", "imu", NONE, NONE),
    )
    with pytest.raises(FrameError, match="mast: expected one parent, got two: base_link and pole"):
        two.base_of("laser")
    assert two.base_of("imu") == "base_link"  # What is not on its way is not its matter.


def test_a_transform_of_a_frame_to_itself_is_ignored():
    """It is said, as tf2 does, and the frame keeps its parent."""
    tree = tree_of(("laser", "/laser", NONE, NONE), ("base_link", "laser", (0, 0, 1), NONE))
    assert place(tree, "laser").translation[2] == 1
    assert tree.remarks == ["transforms of a frame to itself are ignored: laser"]


def test_the_world_is_no_second_parent_of_the_base():
    """A pose in odom is ignored for the body, whichever transform comes first."""
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
def test_invalid_rotations_are_refused_by_name(quaternion, words):
    """Quaternions of another length and NaN are refused; a valid transform still holds."""
    bad = stamped(COMPOSE, ("base_link", "laser", NONE, NONE), quaternion=quaternion)
    tree = TransformTree()
    tree.add([bad], static=True)
    with pytest.raises(FrameError, match=f"from laser to base_link: expected.*{words}"):
        tree.base_of(tree.find("laser"))
    with pytest.raises(FrameError, match=words):
        Extrinsics(tree=tree).pose_of("laser", "laser")
    tree.add([stamped(COMPOSE, ("base_link", "laser", (1, 0, 0), NONE))], static=True)
    assert place(tree, "laser").translation[0] == 1  # A good one of another publisher holds.


def test_rounded_rotations_are_normalised():
    """A quaternion with three digits is accepted."""
    tree = TransformTree()
    tree.add(
        [stamped(COMPOSE, ("base_link", "imu", NONE, NONE), quaternion=(0, 0, 0.707, 0.707))],
        static=True,
    )
    found = place(tree, "imu").rotation
    assert found.as_euler("ZYX", degrees=True)[0] == pytest.approx(90, abs=0.01)


ONE = ("base_link", "imu", (0, 0, 0.5), NONE)
NEAR = ("base_link", "imu", (0, 0, 0.52), (0, 0, 2))
OTHER = ("base_link", "imu", (0, 0, 0.5), (0, 0, 90))


def test_static_transforms_that_agree_are_used():
    """Equal repetitions are silent, near ones are remarked on, and the last is used."""
    assert tree_of(ONE, ONE).remarks == []
    tree = tree_of(ONE, NEAR)
    assert "expected" not in str(tree.remarks)
    assert place(tree, "imu").translation[2] == 0.52


def published(*sources):
    """Return a tree of transforms, each with True for /tf_static and the name of its node."""
    tree = TransformTree()
    for placed, static, node in sources:
        tree.add([stamped(COMPOSE, placed)], static, node)
    return tree


@pytest.mark.parametrize(
    "sources",
    [
        [(ONE, True, ""), (OTHER, True, "")],
        [(ONE, True, "/urdf"), (OTHER, True, "/driver")],
        [(ONE, True, ""), (OTHER, False, "")],
        [(OTHER, False, ""), (ONE, True, "")],
        [(ONE, False, "/urdf"), (OTHER, False, "/driver")],
    ],
)
def test_a_frame_with_two_poses_is_refused_with_both(sources):
    """Poses that differ by more than 5 cm or 3 degrees are refused, whichever came last."""
    tree = published(*sources)
    with pytest.raises(FrameError, match=r"imu: expected one pose on base_link, got two") as error:
        tree.base_of("imu")
    text = str(error.value)
    assert "0.00 m and 90 degrees" in text
    assert "0,0,0.5,0,0,0" in text
    assert "0,0,0.5,0,0,90" in text
    assert all(node in text for _, _, node in sources)


def test_a_node_may_correct_its_own_static_transform():
    """The last static transform of a named node is used, with a remark."""
    tree = published((ONE, True, "/urdf"), (OTHER, True, "/urdf"))
    assert place(tree, "imu").rotation.magnitude() == pytest.approx(np.pi / 2)
    assert "published twice and differs; the last is used" in tree.remarks[0]
    assert Extrinsics(tree=tree).remarks[0].startswith("/tf: ")


def test_a_static_transform_that_is_repeated_changes_nothing():
    """Callers that cache look-ups, and checks that collect readings, go on."""
    tree, other = TransformTree(), (0.5, 0, 0)
    versions = []
    for at in ((0.1, 0, 0), (0.1, 0, 0), other, other):
        tree.add([stamped(COMPOSE, ("base_link", "laser", at, NONE))], True, "/urdf")
        versions.append(tree.version)
    assert versions[0] == versions[1] < versions[2] == versions[3]
    np.testing.assert_allclose(place(tree, "laser").translation, other)


def test_two_sources_that_agree_are_reported_in_one_remark():
    """All frames of the same two sources share a remark."""
    mast = ("base_link", "mast", (0, 0, 0.5), NONE)
    tree = published(*[(each, static, "") for each in (ONE, mast) for static in (True, False)])
    (text,) = tree.remarks
    assert text == (
        "frames that come from /tf and /tf_static, which agree within 5 cm and 3 degrees: imu, mast"
    )
    assert tree.base_of("imu") == "base_link"


def test_a_joint_that_jumps_to_and_fro_has_two_publishers():
    """A frame with two poses in turn is refused; one that swings is not."""
    turns = [(k / 10, ("base_link", "head", NONE, (0, 0, 40 * (k % 2) + k))) for k in range(20)]
    with pytest.raises(FrameError, match=r"head: expected one pose on base_link, got two in turn"):
        tree_of(moving=turns).base_of("head")
    yaws = 60 * np.sin(np.arange(200) / 4)
    swing = [(k / 10, ("base_link", "head", NONE, (0, 0, yaw))) for k, yaw in enumerate(yaws)]
    assert tree_of(moving=swing).base_of("head") == "base_link"


def test_the_world_may_have_two_publishers():
    """Two nodes that place the robot in odom leave its frames as they are."""
    places = [(("odom", "base_link", (x, 0, 0), NONE), False, f"/node{x}") for x in (1, 2)]
    tree = published(*places, (ONE, True, ""))
    assert tree.base_of("imu") == "base_link"


def test_transforms_are_read_from_every_topic_of_their_type(tmp_path):
    """Namespaced topics of a ROS 2 recording join one tree."""
    path, compose = tmp_path / "x.mcap", MessageBuilder(2)
    writer = open_writer(path)
    for k, (name, placed) in enumerate(
        [
            ("/tf_static", ("base_link", "mast", (0, 0, 1), NONE)),
            ("/husky1/tf_static", ("mast", "laser", (0, 0, 1), NONE)),
            ("/tf", ("base_footprint", "base_link", (0, 0, 0.25), NONE)),
        ]
    ):
        topic = Topic(name, name, topics.TF_STATIC.kind, None)
        message = transforms(compose, topics.TF_STATIC.kind, placed)
        writer.write(topic, compose.stamp_ns(k), message)
    writer.close()
    with Bag(path) as bag:
        tree = read_transforms(bag)
    assert tree.base_of("laser") == "base_footprint"
    assert not tree.is_static("laser", "base_footprint")
    np.testing.assert_allclose(place(tree, "laser").translation, [0, 0, 2.25])
