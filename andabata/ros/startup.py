"""Start of a live navigator: waits for transforms and for an initial pose."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records.messages import NS
from andabata.records.topics import IMU, Ros
from andabata.ros.datum_initializer import STATUS_INTERVAL, DatumInitializer, missing_readings
from andabata.ros.graph import Graph, RosError
from andabata.ros.sensor_inbox import SensorInbox

POLL_NS = NS // 20
"""Time between two checks of what was received [ns]."""

_TRANSFORM_TIMEOUT = 3.0
"""Longest wait for the sensors' first messages and the transforms of their frames [s]."""

_INITIAL_POSE_TIMEOUT = 1.0
"""Longest wait for an initial pose before the sensors' readings give one [s]."""

_MAX_CLOCK_OFFSET = 1.0
"""Largest offset of the sensors' stamps from the graph's time [s]; beyond is another clock."""

_PLAY: dict[Ros, str] = {
    1: "`rosbag play --clock` and `rosparam set use_sim_time true`",
    2: "`ros2 bag play --clock` and give --use-sim-time",
}
"""Next step where stamps are of another clock, by version of ROS."""

_KEPT_ROWS = 1000
"""Number of rows that are kept of each sensor while the start is unknown."""


def wait_for_transforms(graph: Graph, inbox: SensorInbox, status: Callable[[str], None]) -> None:
    """Wait a while for the transforms of the sensors' frames.

    Later ones count from their arrival on. What is missing at the end is reported as status.

    Args:
        graph: Graph whose time is used.
        inbox: Store of the received messages.
        status: Function called with a line of text for the user.
    """
    begin = graph.now_ns()
    while not graph.is_shutdown and graph.now_ns() - begin < _TRANSFORM_TIMEOUT * NS:
        graph.sleep_until(graph.now_ns() + POLL_NS)
        if inbox.has_all_transforms:
            break
    for remark in inbox.mounting_remarks:
        status(f"note: {remark}")


class StartFinder:
    """Determines the start from a published initial pose, or from the sensors' readings."""

    def __init__(
        self,
        graph: Graph,
        inbox: SensorInbox,
        datum: DatumInitializer,
        status: Callable[[str], None],
    ) -> None:
        """Begin without readings.

        Args:
            graph: Graph whose time is used.
            inbox: Store of the received messages.
            datum: Initializer that gets the datum of a start by readings.
            status: Function called with a line of text for the user.
        """
        self._graph, self._inbox, self._datum, self._status = graph, inbox, datum, status
        self._readings = SensorReadings(0.0)

    def wait(self) -> tuple[Pose, bool]:
        """Wait for a start.

        Returns:
            Pose in the map, and True if it comes from the sensors' readings alone.

        Raises:
            RosError: If the sensors have another clock than the graph, or the graph shuts down.
            DatumError: If the fixes lie far from the datum that is given.
        """
        graph = self._graph
        begin = reported = graph.now_ns()
        while not graph.is_shutdown:
            graph.sleep_until(graph.now_ns() + POLL_NS)
            self._add(self._inbox.take_readings(0.0))
            pose = self._inbox.take_initial_pose()
            if pose is not None:
                return pose, False
            if graph.now_ns() - begin > _INITIAL_POSE_TIMEOUT * NS:
                pose = self._datum.initial_pose(self._readings, graph.now_ns())
                if pose is not None:
                    return pose, True
            if graph.now_ns() - reported > STATUS_INTERVAL * NS:
                reported = graph.now_ns()
                missing = missing_readings(self._readings, graph.ros)
                self._status(f"no start yet: expected {missing}; or /initialpose")
        raise RosError(
            "start: expected /initialpose, or readings that give a pose, got the end of the graph; "
            "give --start"
        )

    def _add(self, new: SensorReadings) -> None:
        """Append readings.

        Raises:
            RosError: If they have another clock than the graph.
        """
        if new.imu is not None:
            check_clock(float(new.imu[-1, 0]), self._graph.now_ns() / NS, self._graph.ros)
        kept = self._readings
        self._readings = SensorReadings(
            0.0,
            imu=_joined(kept.imu, new.imu),
            mag=_joined(kept.mag, new.mag),
            gnss=_joined(kept.gnss, new.gnss),
            antenna=new.antenna,
        )


def check_clock(stamp: float, now: float, ros: Ros = 1) -> None:
    """Refuse a stamp of another clock.

    Args:
        stamp: Stamp of an inertial reading [s].
        now: The graph's time [s].
        ros: Version of ROS, whose commands the advice names.

    Raises:
        RosError: If the two are too far apart.
    """
    if abs(stamp - now) > _MAX_CLOCK_OFFSET:
        raise RosError(
            f"{IMU.name(ros)}: expected stamps within {_MAX_CLOCK_OFFSET:.0f} s of the graph's "
            f"time, got one {now - stamp:.1f} s behind; play recordings with {_PLAY[ros]}"
        )


def _joined(
    kept: NDArray[np.float64] | None, new: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """Return the last rows of both together; None without any."""
    if kept is None or new is None:
        return new if kept is None else kept
    return np.concatenate([kept, new])[-_KEPT_ROWS:]
