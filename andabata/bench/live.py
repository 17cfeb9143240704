"""Rates and delays of the live ROS 1 graph, measured by the reference tools.

``python -m tests.benchmarks.bench_live --seconds 60``: a master on loopback, a simulated robot, the
navigator, ``rosbag record`` and ``rostopic hz``, all of them processes of this machine.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from andabata.bench.ros_graph import result, running, stopped
from andabata.records.bags import Bag

WATCHED = ("/cmd_vel", "/2D_virtual_scan", "/3D_relative_cloud", "/imu", "/2D_scan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--world", default="natural-test")
    parser.add_argument("--seed", type=int, default=0)
    words = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, running(Path(name)) as graph:
        place = ("--world", words.world, "--seed", words.seed)
        graph.andabata("robot", *place, "--seconds", words.seconds + 120)
        graph.wait_for("/initialpose", "Publishers:")
        seconds = words.seconds + 15
        node = graph.andabata("navigator", "--controller", "reactive", "--seconds", seconds)
        graph.wait_for("/cmd_vel", "Publishers:")
        bag = Path(name) / "live.bag"
        recorder = graph.start("rosbag", "record", "-O", bag, *WATCHED)
        said = graph.tool("rostopic", "hz", "/cmd_vel", "/2D_virtual_scan", seconds=words.seconds)
        figures = result(node, 120)
        stamps: dict[str, list[float]] = {topic: [] for topic in WATCHED}
        with Bag(stopped(recorder, bag)) as found:
            for message in found.messages():
                stamps[message.topic].append(message.stamp_ns / 1e9)
    clouds = np.array(stamps["/3D_relative_cloud"])
    for topic in ("/2D_virtual_scan", "/cmd_vel"):
        times = np.array(stamps[topic])
        times = times[times > clouds[0]]
        delay = 1e3 * (times - clouds[np.searchsorted(clouds, times) - 1])
        gaps = np.diff(times)
        row = {
            "topic": topic,
            "messages": len(times),
            "rate_hz": float(1 / gaps.mean()),
            "gap_99_ms": float(1e3 * np.quantile(gaps, 0.99)),
            "delay_median_ms": float(np.median(delay)),
            "delay_99_ms": float(np.quantile(delay, 0.99)),
            "delay_max_ms": float(delay.max()),
        }
        sys.stdout.write(json.dumps(row) + "\n")
    rates = {t: (len(s) - 1) / (s[-1] - s[0]) for t, s in stamps.items()}
    sys.stdout.write(json.dumps({"rates_hz": rates, "navigator": figures}) + "\n")
    sys.stdout.write("\n".join(said.splitlines()[-4:]) + "\n")


if __name__ == "__main__":
    main()
