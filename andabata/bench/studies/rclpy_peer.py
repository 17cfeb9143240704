"""Node of ROS's own Python client that exchanges messages with ours, in a process of its own.

It runs in the environment of rclpy (``make ros2``), which has none of our packages. It prints
``ready`` when the publishers and subscribers that it is told to wait for are there, begins at a
line of its input, and prints its findings as JSON at its end.
"""

import json
import sys
import threading
import time
from typing import Any

import rclpy
from geometry_msgs.msg import Twist
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, PointCloud2, PointField

_KINDS = {"cloud": PointCloud2, "imu": Imu, "twist": Twist}
_POINT_BYTES = 16


class Peer:
    """Node with a publisher and a subscriber of each kind."""

    def __init__(self, plan: dict[str, Any]) -> None:
        """Create the node."""
        self.plan = plan
        self.node = rclpy.create_node(plan["name"])
        reliable = ReliabilityPolicy.RELIABLE if plan["reliable"] else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=100, reliability=reliable)
        self.delays: dict[str, list[float]] = {kind: [] for kind in plan["receive"]}
        for kind, topic in plan["receive"].items():
            self.node.create_subscription(_KINDS[kind], topic, self._taker(kind), qos)
        self.publishers = {
            kind: self.node.create_publisher(_KINDS[kind], topic, qos)
            for kind, topic in plan["send"].items()
        }

    def _taker(self, kind: str) -> Any:  # noqa: ANN401 - a function.
        """Return the function that takes messages of a kind."""

        def take(message: Any) -> None:  # noqa: ANN401 - a message.
            """Note the delay of a message [s]."""
            if kind == "twist":
                sent = message.linear.x
            else:
                sent = message.header.stamp.sec + message.header.stamp.nanosec * 1e-9
            self.delays[kind].append(time.time() - sent)

        return take

    def wait(self) -> None:
        """Wait until our node is there with its publishers and subscribers."""
        sent = self.plan["send"].values()
        received = self.plan["receive"].values()
        while not (
            all(self.node.count_publishers(topic) for topic in received)
            and all(self.node.count_subscribers(topic) for topic in sent)
        ):
            time.sleep(0.1)

    def send(self) -> dict[str, int]:
        """Publish for the planned time; return the number of messages by kind."""
        counts = dict.fromkeys(self.publishers, 0)
        rates = {"cloud": 10, "imu": 100, "twist": 10}
        message = {"cloud": _cloud(self.plan["points"]), "imu": Imu(), "twist": Twist()}
        begin = time.monotonic()
        for tick in range(round(100 * self.plan["seconds"])):
            time.sleep(max(0.0, begin + tick / 100 - time.monotonic()))
            for kind, publisher in self.publishers.items():
                if tick % (100 // rates[kind]):
                    continue
                second, rest = divmod(time.time_ns(), 1_000_000_000)
                if kind == "twist":
                    message[kind].linear.x = time.time()
                else:
                    message[kind].header.stamp.sec = second
                    message[kind].header.stamp.nanosec = rest
                publisher.publish(message[kind])
                counts[kind] += 1
        return counts


def _cloud(points: int) -> PointCloud2:
    """Return a cloud of a number of points with x, y, z and intensity."""
    fields = [PointField(name=n, offset=4 * k, datatype=7, count=1) for k, n in enumerate("xyzi")]
    cloud = PointCloud2(height=1, width=points, fields=fields, point_step=_POINT_BYTES)
    cloud.row_step = points * _POINT_BYTES
    cloud.data = bytes(points * _POINT_BYTES)
    return cloud


def main() -> None:
    """Run the plan of the command line."""
    plan = json.loads(sys.argv[1])
    rclpy.init()
    peer = Peer(plan)
    threading.Thread(target=rclpy.spin, args=(peer.node,), daemon=True).start()
    peer.wait()
    print("ready", flush=True)  # noqa: T201 - to the process that started this one.
    sys.stdin.readline()
    sent = peer.send()
    time.sleep(plan["patience"])
    found = {
        "sent": sent,
        "delays": peer.delays,
        "nodes": peer.node.get_node_names_and_namespaces(),
        "topics": dict(peer.node.get_topic_names_and_types()),
    }
    print(json.dumps(found), flush=True)  # noqa: T201


if __name__ == "__main__":
    main()
