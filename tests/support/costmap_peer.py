"""Node of rclpy that reads and writes what Nav2's costmaps and planner do; see its test.

It comes late to a latched map, as a costmap does that is started after the navigator.
"""

import json
import sys
import threading
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Path
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import LaserScan


def path(length):
    """Return a path along x in ``map``, a pose a metre."""
    message = Path()
    message.header.frame_id = "map"
    for k in range(length + 1):
        pose = PoseStamped()
        pose.pose.position.x = float(k)
        message.poses.append(pose)
    return message


def main():
    """Print the map and a scan once both have come, and send a path; then wait to be ended."""
    topics = json.loads(sys.argv[1])
    rclpy.init()
    node = rclpy.create_node("costmap")
    heard, is_complete = {}, threading.Event()

    def take(name, message):
        heard[name] = message
        if len(heard) == 2:
            is_complete.set()

    # A static layer's own profile, and that of a message filter for scans.
    late = QoSProfile(
        depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
    )
    node.create_subscription(OccupancyGrid, topics["map"], lambda m: take("map", m), late)
    scans = qos_profile_sensor_data
    node.create_subscription(LaserScan, topics["scan"], lambda m: take("scan", m), scans)
    planner = node.create_publisher(Path, topics["path"], 1)
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    is_complete.wait()
    while not planner.get_subscription_count():
        time.sleep(0.1)
    planner.publish(path(20))
    grid, scan = heard["map"], heard["scan"]
    found = {
        "frame": grid.header.frame_id,
        "size": [grid.info.width, grid.info.height],
        "resolution": grid.info.resolution,
        "values": sorted(set(grid.data)),
        "scan_frame": scan.header.frame_id,
        "ranges": len(scan.ranges),
    }
    print(json.dumps(found), flush=True)  # noqa: T201 - to the test.
    sys.stdin.readline()


if __name__ == "__main__":
    main()
