"""Exchange of messages with ROS's own client over DDS: how many arrive, and how late.

``python -m andabata.bench.studies.ros2_link`` prints a JSON object for each quality of service. The
peer is rclpy in an environment of its own (``make ros2``).
"""

import argparse
import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from andabata.distribution import HOME
from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder, header_ns
from andabata.records.topics import POINT_CLOUD, RosMessage, Topic
from andabata.ros.ros2_graph import Ros2Graph

PEER = Path(__file__).with_name("rclpy_peer.py")

_VARIABLE = "ANDABATA_RCLPY"
"""Environment variable with the Python of an environment that has rclpy."""

_NODE = "andabata_link"
_PATIENCE = 1.0
"""Time after the last message in which late ones may arrive [s]."""

_RATES = {"cloud": 10, "imu": 100, "twist": 10}
"""Rates of the messages [Hz]."""


def rclpy_python() -> Path:
    """Return the Python that has rclpy: of ``make ros2``, or that of ``ANDABATA_RCLPY``."""
    given = os.environ.get(_VARIABLE)
    return Path(given) if given else HOME / "build" / "rclpy" / "bin" / "python"


def _own(name: str, kind: str) -> Topic:
    """Return a reliable topic of this study."""
    return Topic(name, name, kind, None)


IMU, TWIST = topics.IMU.kind, topics.TWIST.kind

SENT = {
    True: {
        "cloud": _own("/link/points", POINT_CLOUD),
        "imu": _own("/link/imu", IMU),
        "twist": topics.TWIST,
    },
    False: {"cloud": topics.LASER_CLOUD, "imu": topics.IMU, "twist": topics.TWIST},
}
"""Our topics by kind: reliable, and with the profile of sensors."""

RECEIVED = {
    "cloud": _own("/peer/points", POINT_CLOUD),
    "imu": _own("/peer/imu", IMU),
    "twist": _own("/peer/twist", TWIST),
}
"""Topics of the peer."""


@contextmanager
def peer_process(python: Path, script: Path, plan: dict[str, Any]) -> Iterator[Any]:
    """Yield a running script of rclpy; it ends with the block.

    Args:
        python: Python of its environment.
        script: The script.
        plan: Its argument, ready for JSON.
    """
    # Its packages find each other; ours must not be among them.
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    with subprocess.Popen(
        [str(python), str(script), json.dumps(plan)],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def measure(
    python: Path, reliable: bool, seconds: float = 8.0, points: int = 10_000
) -> dict[str, Any]:
    """Return what arrives in both directions at once.

    Args:
        python: Python that has rclpy.
        reliable: True for the reliable quality of service, False for that of sensors.
        seconds: Duration [s].
        points: Number of points of a cloud.

    Returns:
        By direction and kind: number of messages sent and received, and their delay [ms].
    """
    delays: dict[str, list[float]] = {kind: [] for kind in RECEIVED}
    sent = SENT[reliable]
    plan = {
        "name": "peer",
        "reliable": reliable,
        "seconds": seconds,
        "points": points,
        "patience": _PATIENCE,
        "receive": {kind: topic.ros2 for kind, topic in sent.items()},
        "send": {kind: topic.ros2 for kind, topic in RECEIVED.items()},
    }
    with peer_process(python, PEER, plan) as process:
        graph = Ros2Graph(_NODE, status=lambda text: None)
        try:
            for topic in sent.values():
                graph.advertise(topic)
            for kind, topic in RECEIVED.items():
                graph.subscribe(topic, _taker(delays[kind]))
            if process.stdout.readline() != "ready\n":
                raise RuntimeError("rclpy: expected ready, got the end of its process")
            time.sleep(1.0)  # Both sides know of each other; each has to have matched, too.
            process.stdin.write("go\n")
            process.stdin.flush()
            counts = _send(graph, sent, seconds, points)
            found = json.loads(process.stdout.readline())
        finally:
            graph.close()
    return {
        "reliable": reliable,
        "to_rclpy": _table(counts, found["delays"]),
        "from_rclpy": _table(found["sent"], delays),
        "dropped": graph.dropped,
        "nodes": found["nodes"],
        "topics": found["topics"],
    }


def _taker(delays: list[float]) -> Callable[[Topic, RosMessage], None]:
    """Return the function that notes the delay of a message [s]."""

    def take(topic: Topic, message: RosMessage) -> None:
        """Note the delay of a message; a twist has its time as its speed."""
        is_twist = topic.kind == TWIST
        sent = message.linear.x if is_twist else header_ns(message) / NS
        delays.append(time.time() - sent)

    return take


def _send(graph: Ros2Graph, sent: dict[str, Topic], seconds: float, points: int) -> dict[str, int]:
    """Publish at the rates of a robot; return the number of messages by kind."""
    counts = dict.fromkeys(sent, 0)
    begin = time.monotonic()
    for tick in range(round(100 * seconds)):
        time.sleep(max(0.0, begin + tick / 100 - time.monotonic()))
        for kind, topic in sent.items():
            if tick % (100 // _RATES[kind]) == 0:
                graph.write(topic, 0, _message(kind, points))
                counts[kind] += 1
    return counts


def _message(kind: str, points: int) -> RosMessage:
    """Return a message that is stamped now."""
    builder = MessageBuilder(2, time.time_ns())
    if kind == "imu":
        return builder.imu(np.zeros(7))
    if kind == "twist":
        return builder.twist(time.time(), 0.0)
    fields = [
        builder.new("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=7, count=1)
        for k, name in enumerate("xyzi")
    ]
    return builder.new(
        POINT_CLOUD,
        header=builder.header(0.0, "lidar"),
        height=1,
        width=points,
        fields=fields,
        is_bigendian=False,
        point_step=16,
        row_step=16 * points,
        data=np.zeros(16 * points, dtype=np.uint8),
        is_dense=True,
    )


def _table(sent: dict[str, int], delays: dict[str, list[float]]) -> dict[str, dict[str, Any]]:
    """Return numbers of messages and delays [ms] by kind."""
    return {
        kind: {
            "sent": number,
            "received": len(delays[kind]),
            "median_ms": round(1e3 * float(np.median(delays[kind] or [np.nan])), 2),
            "p99_ms": round(1e3 * float(np.quantile(delays[kind] or [np.nan], 0.99)), 2),
        }
        for kind, number in sent.items()
    }


def main() -> None:
    """Measure both qualities of service and print them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--points", type=int, default=10_000)
    options = parser.parse_args()
    for reliable in (True, False):
        found = measure(rclpy_python(), reliable, options.seconds, options.points)
        print(json.dumps({k: v for k, v in found.items() if k != "topics"}))  # noqa: T201


if __name__ == "__main__":
    main()
