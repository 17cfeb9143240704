"""Topics of the robot with types and rates: the paper's Table 3 and ours."""

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

Ros = Literal[1, 2]
"""Version of ROS."""

RosMessage: TypeAlias = Any
"""A message as rosbags makes it from its definition."""


@dataclass(frozen=True)
class Topic:
    """Topic under its names of ROS 1 and ROS 2.

    Attributes:
        ros1: Name in ROS 1, the paper's.
        ros2: Name in ROS 2, which forbids some of the paper's.
        kind: Message type, as ``package/msg/Name``.
        rate_hz: Rate of the messages [Hz]; None for those that are sent on events.
        kind1: Message type in ROS 1 where it differs.
    """

    ros1: str
    ros2: str
    kind: str
    rate_hz: float | None
    kind1: str | None = None

    def name(self, ros: Ros) -> str:
        """Return the name in a version of ROS."""
        return self.ros1 if ros == 1 else self.ros2

    def type_name(self, ros: Ros) -> str:
        """Return the message type in a version of ROS."""
        return self.kind1 if ros == 1 and self.kind1 else self.kind


POINT_CLOUD = "sensor_msgs/msg/PointCloud2"
PATH = "nav_msgs/msg/Path"

SCAN = Topic("/2D_scan", "/scan_2d", "sensor_msgs/msg/LaserScan", 40.0)
HEAD_ANGLE = Topic("/head_angle", "/head_angle", "andabata_msgs/msg/LaserEvent", 40.0)
ENCODERS = Topic("/encoder_data", "/encoder_data", "andabata_msgs/msg/Wheels_speed", 100.0)
IMU = Topic("/imu", "/imu/data", "sensor_msgs/msg/Imu", 100.0)
CLOUD = Topic("/3D_cloud", "/points", POINT_CLOUD, 0.3)
RELATIVE_CLOUD = Topic("/3D_relative_cloud", "/points_relative", POINT_CLOUD, 20.0)
TF = Topic("/tf", "/tf", "tf2_msgs/msg/TFMessage", 100.0, "tf/msg/tfMessage")
TF_STATIC = Topic("/tf_static", "/tf_static", "tf2_msgs/msg/TFMessage", None)
MAG = Topic("/mag_orientation", "/imu/mag", "sensor_msgs/msg/MagneticField", 100.0)
FIX = Topic("/fix", "/fix", "sensor_msgs/msg/NavSatFix", 1.0)
VIRTUAL_SCAN = Topic("/2D_virtual_scan", "/traversability_scan", "sensor_msgs/msg/LaserScan", 10.0)
TWIST = Topic("/cmd_vel", "/cmd_vel", "geometry_msgs/msg/Twist", 10.0)
WHEEL_COMMAND = Topic("/wheel_speed_cmd", "/wheel_speed_cmd", "andabata_msgs/msg/Wheels_cmd", 10.0)
FILTERED_ODOMETRY = Topic("/odometry/filtered", "/odometry/filtered", "nav_msgs/msg/Odometry", 10.0)
ESTIMATED_POSE = Topic("/pose", "/pose", "geometry_msgs/msg/PoseWithCovarianceStamped", 10.0)
"""Pose of the filter again, alone with its covariance: the type that viewers draw an ellipse of."""

DIAGNOSTICS = Topic("/diagnostics", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", 1.0)
GOAL = Topic("/goal", "/goal", "geometry_msgs/msg/PoseStamped", None)
GOAL_REACHED = Topic("/goal_reached", "/goal_reached", "geometry_msgs/msg/PoseStamped", None)
"""Goal that the robot declares reached, by its own estimate, once for each goal."""

GROUND_TRUTH = Topic("/ground_truth", "/ground_truth", "nav_msgs/msg/Odometry", 10.0)
WALKERS = Topic("/walkers", "/walkers", "geometry_msgs/msg/PoseArray", 10.0)
"""True places of the walkers' feet, of worlds that have some."""

INITIAL_POSE = Topic(
    "/initialpose", "/initialpose", "geometry_msgs/msg/PoseWithCovarianceStamped", None
)
LASER_CLOUD = Topic("/laser_cloud", "/laser_cloud", POINT_CLOUD, 10.0)
"""Cloud of a 3D laser, which replaces the rotating laser's sweeps and angles."""

LOCAL_MAP = Topic("/local_map", "/local_map", "nav_msgs/msg/OccupancyGrid", 1.0)
"""Occupancy around the robot, in ``odom``, of drives with a planner."""

GRID_MAP = Topic("/grid_map", "/grid_map", "grid_map_msgs/msg/GridMap", 1.0)
"""All layers of the local map, in ``odom``."""

PLAN = Topic("/plan", "/plan", PATH, 2.0)
"""Way to the goal over the local map, in ``odom``."""

SUBGOAL = Topic("/subgoal", "/subgoal", "geometry_msgs/msg/PoseStamped", 2.0)
"""Place that the controller heads for, in ``odom``."""

HEADING_ERROR = Topic("/heading_error", "/heading_error", "std_msgs/msg/Float64", None)
"""Bearing of the goal, or of the sub-goal, relative to the heading at each decision [rad]."""

UPDATE = Topic("/update", "/update", "std_msgs/msg/Float64", 10.0)
"""Time [s] at which a live navigator takes in readings within a control period, when it records."""

PLANNER_TOPICS = (LOCAL_MAP, GRID_MAP, PLAN, SUBGOAL, HEADING_ERROR)
"""Topics of what the planner knows and wants."""

TOPICS = (
    SCAN,
    HEAD_ANGLE,
    ENCODERS,
    IMU,
    CLOUD,
    RELATIVE_CLOUD,
    TF,
    MAG,
    FIX,
    VIRTUAL_SCAN,
    TWIST,
    WHEEL_COMMAND,
    FILTERED_ODOMETRY,
    ESTIMATED_POSE,
    DIAGNOSTICS,
    GOAL,
    GROUND_TRUTH,
    INITIAL_POSE,
)
"""All topics with the paper's laser; the first twelve are the paper's."""

_OWN_TYPES = {
    "andabata_msgs/msg/LaserEvent": "std_msgs/Header header\nfloat64 angle\nfloat64 rate\n",
    "andabata_msgs/msg/Wheels_speed": "std_msgs/Header header\nfloat64 left\nfloat64 right\n",
    "andabata_msgs/msg/Wheels_cmd": "std_msgs/Header header\nfloat64 left\nfloat64 right\n",
}
"""Definitions of the types that the paper names and does not publish (assumption)."""

_GRID_MAP = "string[] layers\nstring[] basic_layers\nstd_msgs/Float32MultiArray[] data\n"
_GRID_MAP += "uint16 outer_start_index\nuint16 inner_start_index\n"
_GRID_MAP_INFO = "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
_GRID_MAP_TYPES = {
    1: {
        "grid_map_msgs/msg/GridMapInfo": f"std_msgs/Header header\n{_GRID_MAP_INFO}",
        "grid_map_msgs/msg/GridMap": f"grid_map_msgs/GridMapInfo info\n{_GRID_MAP}",
    },
    2: {
        "grid_map_msgs/msg/GridMapInfo": _GRID_MAP_INFO,
        "grid_map_msgs/msg/GridMap": f"std_msgs/Header header\ngrid_map_msgs/GridMapInfo info\n"
        f"{_GRID_MAP}",
    },
}
"""Definitions of ANYbotics' grid_map by version of ROS: the header is elsewhere in each."""

_ROS1_ONLY = {
    "tf/msg/tfMessage": "geometry_msgs/TransformStamped[] transforms\n",
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
}
"""Types that rosbags' store of ROS 1 lacks."""


@cache
def message_types(ros: Ros) -> "Typestore":
    """Return rosbags' type store with every type that the topics need."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
    own = _OWN_TYPES | _GRID_MAP_TYPES[ros] | (_ROS1_ONLY if ros == 1 else {})
    for name, text in own.items():
        store.register(get_types_from_msg(text, name))
    return store
