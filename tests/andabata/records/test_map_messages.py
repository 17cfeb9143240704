"""Maps and plans are messages that costmaps and grid_map read as they were meant."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from andabata.navigation.planning.map_layers import UNITS, MapLayers
from andabata.records import map_messages, topics
from andabata.records.messages import NS, MessageBuilder, header_ns
from andabata.records.topics import message_types
from tests.support.grid_maps import layer_of

N, CELL = 8, 0.5
CORNER = np.array([-3.0, 10.0])
MARK = (1, 5)
"""Cell along x and y of the only obstacle."""


def made_map():
    """Return a map that knows one obstacle, one free cell and one uncertain cell."""
    layers = {name: np.full((N, N), np.nan, dtype=np.float32) for name in UNITS}
    layers["occupancy"][MARK] = 0.95
    layers["occupancy"][0, 0] = 0.02
    layers["occupancy"][7, 0] = 0.73
    layers["elevation"] += np.arange(N, dtype=np.float32)[:, None]
    layers["elevation"] = np.add.outer(np.arange(N), 10 * np.arange(N)).astype(np.float32)
    return MapLayers(CORNER, CELL, 0.731, layers)


@pytest.fixture(params=[1, 2])
def builder(request):
    """Builder of either version of ROS."""
    return MessageBuilder(request.param, 5 * NS)


def sent(builder, topic, message):
    """Return a message after it was serialised and read again."""
    store, kind = message_types(builder.ros), topic.type_name(builder.ros)
    if builder.ros == 1:
        return store.deserialize_ros1(store.serialize_ros1(message, kind), kind)
    return store.deserialize_cdr(store.serialize_cdr(message, kind), kind)


def test_an_occupancy_grid_runs_along_x_first(builder):
    """Origin, resolution, stamp and frame are the map's; unknown is -1, an obstacle 100."""
    message = map_messages.occupancy_grid(builder, 0.25, made_map(), 1.5)
    message = sent(builder, topics.LOCAL_MAP, message)
    assert (message.header.frame_id, header_ns(message)) == ("odom", 5_250_000_000)
    info, origin = message.info, message.info.origin
    assert (info.width, info.height, info.resolution) == (N, N, CELL)
    assert (origin.position.x, origin.position.y, origin.position.z) == (-3.0, 10.0, 1.5)
    assert origin.orientation.w == 1.0
    x, y = MARK
    data = np.asarray(message.data)
    assert data[y * N + x] == 100
    assert data[0] == 2
    assert data[7] == 73  # As likely as it gets without being an obstacle to the planner.
    assert np.count_nonzero(data == -1) == N * N - 3


def test_what_the_planner_enters_is_never_lethal(builder):
    """Below the planner's limit a cell has at most 99, whatever its probability."""
    layers = {**made_map().layers, "occupancy": np.full((N, N), 0.998, dtype=np.float32)}
    found = MapLayers(CORNER, CELL, 0.999, layers)
    message = map_messages.occupancy_grid(builder, 0.0, found, 0.0)
    assert (np.asarray(message.data) == 99).all()


def test_a_grid_map_counts_down_from_its_largest_corner(builder):
    """A cell lies where grid_map's own formula of index and position says (Eigen's order)."""
    message = sent(builder, topics.GRID_MAP, map_messages.grid_map(builder, 0.25, made_map()))
    header = message.info.header if builder.ros == 1 else message.header
    assert header.frame_id == "odom"
    assert list(message.layers) == list(UNITS)
    assert list(message.basic_layers) == ["occupancy"]
    centre, length = message.info.pose.position, N * CELL
    assert (centre.x, centre.y) == (CORNER[0] + length / 2, CORNER[1] + length / 2)
    assert (message.info.length_x, message.info.length_y) == (length, length)
    array = message.data[0]
    outer, inner = array.layout.dim
    assert (outer.label, outer.size, outer.stride) == ("column_index", N, N * N)
    assert (inner.label, inner.size, inner.stride) == ("row_index", N, N)
    x, y = CORNER + (np.array(MARK) + 0.5) * CELL
    row = int((centre.x + length / 2 - x) / CELL)
    column = int((centre.y + length / 2 - y) / CELL)
    assert np.asarray(array.data)[column * N + row] == np.float32(0.95)
    assert np.count_nonzero(~np.isnan(array.data)) == 3


def test_a_layer_comes_back(builder):
    """Reading as grid_map does undoes writing."""
    message = map_messages.grid_map(builder, 0.0, made_map())
    elevation = made_map().layers["elevation"]
    np.testing.assert_array_equal(layer_of(message, "elevation"), elevation)


def test_the_types_of_ros_1_are_anybotics_own():
    """The checksums are those that grid_map's nodes compare before they connect."""
    known = {
        "grid_map_msgs/msg/GridMap": "95681e052b1f73bf87b7eb984382b401",
        "grid_map_msgs/msg/GridMapInfo": "43ee5430e1c253682111cb6bedac0ef9",
    }
    for kind, digest in known.items():
        assert message_types(1).generate_msgdef(kind, ros_version=1)[1] == digest


def test_the_poses_of_a_path_head_for_the_next(builder):
    """Positions are the places; the last pose heads as the one before it."""
    places = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.5], [1.0, 2.0, 2.0]])
    message = sent(builder, topics.PLAN, map_messages.path(builder, 0.0, places))
    found = [pose.pose for pose in message.poses]
    assert [(p.position.x, p.position.y, p.position.z) for p in found] == list(map(tuple, places))
    turns = [2 * np.arctan2(p.orientation.z, p.orientation.w) for p in found]
    np.testing.assert_allclose(turns, [0.0, np.pi / 2, np.pi / 2])
    assert message.header.frame_id == message.poses[1].header.frame_id == "odom"
    assert map_messages.path(builder, 0.0, np.empty((0, 3))).poses == []
    assert len(map_messages.path(builder, 0.0, places[:1]).poses) == 1


def test_map_and_odom_together_give_the_pose_in_the_map(builder):
    """The transform times the pose in odom is the pose in the map, tilted poses too."""
    pose = Pose.from_euler(np.array([5.0, 6.0, 7.0]), 0.1, -0.2, 2.0)
    odometry = Pose.from_euler(np.array([1.0, -2.0, 0.5]), 0.12, -0.1, -1.0)
    stamped = map_messages.map_to_odom(builder, 0.0, pose, odometry)
    assert (stamped.header.frame_id, stamped.child_frame_id) == ("map", "odom")
    t, r = stamped.transform.translation, stamped.transform.rotation
    turn, shift = Rotation.from_quat([r.x, r.y, r.z, r.w]), np.array([t.x, t.y, t.z])
    np.testing.assert_allclose(turn.apply(odometry.position) + shift, pose.position)
    both = turn * Rotation.from_quat(odometry.quaternion)
    np.testing.assert_allclose(both.as_matrix(), pose.matrix[:3, :3], atol=1e-12)
