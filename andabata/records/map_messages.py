"""Messages of the local map and the plan, as Nav2 and grid_map read them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose
from andabata.navigation.planning.map_layers import OCCUPANCY, MapLayers
from andabata.records.messages import MessageBuilder
from andabata.records.topics import PATH, RosMessage

UNKNOWN, LETHAL = -1, 100
"""Occupancy of a cell that nothing was seen of, and of one that the planner does not enter."""

_MOST_FREE = 99
"""Largest occupancy of a cell that is no obstacle to the planner."""

_MAP_FRAME = "odom"
_LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
"""Quaternion without a turn."""


def occupancy_grid(
    builder: MessageBuilder, seconds: float, map_layers: MapLayers, height: float
) -> RosMessage:
    """Return the occupancy of the local map as a ``nav_msgs/OccupancyGrid``.

    Values are probabilities of an obstacle in percent, row by row along x from the corner with the
    smallest x and y; -1 is unknown. What the planner takes for an obstacle is 100 and nothing else
    is, so that a costmap's static layer sees the same obstacles.

    Args:
        builder: Builder of the messages.
        seconds: Time of the map [s].
        map_layers: The map.
        height: Height at which the map is drawn [m], the robot's; costmaps do not read it.
    """
    occupancy = map_layers.layers[OCCUPANCY]
    known = ~np.isnan(occupancy)
    percent = np.minimum(np.rint(100.0 * np.where(known, occupancy, 0.0)), _MOST_FREE)
    percent[known & (occupancy > map_layers.lethal_occupancy)] = LETHAL
    percent[~known] = UNKNOWN
    n = len(occupancy)
    header = builder.header(seconds, _MAP_FRAME)
    info = builder.new(
        "nav_msgs/msg/MapMetaData",
        map_load_time=header.stamp,
        resolution=map_layers.cell,
        width=n,
        height=n,
        origin=builder.pose(Pose(np.array([*map_layers.corner, height]), _LEVEL)),
    )
    # A row of the message runs along x, the first index of ours.
    data = np.ascontiguousarray(percent.T).astype(np.int8).ravel()
    return builder.new("nav_msgs/msg/OccupancyGrid", header=header, info=info, data=data)


def grid_map(builder: MessageBuilder, seconds: float, map_layers: MapLayers) -> RosMessage:
    """Return all layers of the local map as a ``grid_map_msgs/GridMap``.

    grid_map counts rows from the largest x down and columns from the largest y down, stores them
    column by column, and states the centre of the map. The circular buffer is unrolled: both start
    indices are 0. NaN is unknown.

    Args:
        builder: Builder of the messages.
        seconds: Time of the map [s].
        map_layers: The map.
    """
    n = len(map_layers.layers[OCCUPANCY])
    header, length = builder.header(seconds, _MAP_FRAME), n * map_layers.cell
    centre = np.array([*(map_layers.corner + length / 2), 0.0])
    info = {
        "resolution": map_layers.cell,
        "length_x": length,
        "length_y": length,
        "pose": builder.pose(Pose(centre, _LEVEL)),
    }
    # ROS 1 has the header inside of the info, ROS 2 outside.
    inside, outside = ({"header": header}, {}) if builder.ros == 1 else ({}, {"header": header})
    return builder.new(
        "grid_map_msgs/msg/GridMap",
        **outside,
        info=builder.new("grid_map_msgs/msg/GridMapInfo", **inside, **info),
        layers=list(map_layers.layers),
        basic_layers=[OCCUPANCY],
        data=[_layer(builder, values) for values in map_layers.layers.values()],
        outer_start_index=0,
        inner_start_index=0,
    )


def _layer(builder: MessageBuilder, values: NDArray[np.float32]) -> RosMessage:
    """Return a layer, first index x and second y, in grid_map's order."""
    rows, columns = values.shape
    dimensions = [
        builder.new("std_msgs/msg/MultiArrayDimension", label=label, size=size, stride=stride)
        for label, size, stride in (
            ("column_index", columns, rows * columns),
            ("row_index", rows, rows),
        )
    ]
    layout = builder.new("std_msgs/msg/MultiArrayLayout", dim=dimensions, data_offset=0)
    data = np.ascontiguousarray(values[::-1, ::-1].T, dtype=np.float32).ravel()
    return builder.new("std_msgs/msg/Float32MultiArray", layout=layout, data=data)


def path(builder: MessageBuilder, seconds: float, places: NDArray[np.float64]) -> RosMessage:
    """Return places as a ``nav_msgs/Path``; each pose heads for the next one.

    Args:
        builder: Builder of the messages.
        seconds: Time of the plan [s].
        places: Places in ``odom`` [m], shape (k, 3).
    """
    header = builder.header(seconds, _MAP_FRAME)
    ahead = np.diff(places[:, :2], axis=0)
    yaws = np.arctan2(ahead[:, 1], ahead[:, 0])
    yaws = np.append(yaws, yaws[-1:]) if len(yaws) else np.zeros(len(places))
    poses = [
        builder.new(
            "geometry_msgs/msg/PoseStamped",
            header=header,
            pose=builder.pose(Pose.from_euler(place, 0.0, 0.0, float(yaw))),
        )
        for place, yaw in zip(places, yaws, strict=True)
    ]
    return builder.new(PATH, header=header, poses=poses)


def subgoal(
    builder: MessageBuilder, seconds: float, place: NDArray[np.float64], bearing: float
) -> RosMessage:
    """Return the place that the controller heads for as a ``geometry_msgs/PoseStamped``.

    Args:
        builder: Builder of the messages.
        seconds: Time of the decision [s].
        place: Place in ``odom`` [m], shape (3,).
        bearing: Bearing from the robot to the place in ``odom`` [rad].
    """
    return builder.new(
        "geometry_msgs/msg/PoseStamped",
        header=builder.header(seconds, _MAP_FRAME),
        pose=builder.pose(Pose.from_euler(place, 0.0, 0.0, bearing)),
    )


def map_to_odom(builder: MessageBuilder, seconds: float, pose: Pose, odometry: Pose) -> RosMessage:
    """Return the transform ``map -> odom`` as a ``geometry_msgs/TransformStamped``.

    Args:
        builder: Builder of the messages.
        seconds: Time of the poses [s].
        pose: Pose of the robot in the map.
        odometry: Pose of the robot in ``odom``.
    """
    R_map_odom = Rotation.from_quat(pose.quaternion) * Rotation.from_quat(odometry.quaternion).inv()
    shift = pose.position - R_map_odom.apply(odometry.position)
    row = np.concatenate([shift, R_map_odom.as_quat()])
    return builder.stamped_transform(seconds, ("map", "odom"), row)
