"""Measures rates and delays of the live ROS 1 graph with the reference tools.

``python -m andabata.bench.studies.live --seconds 60`` starts a master on loopback, a simulated
robot, the navigator, ``rosbag record`` and ``rostopic hz``, all of them processes of this machine,
and prints Markdown tables.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.studies.ros_graph import finished_bag, result, running
from andabata.bench.table import Row, markdown_table
from andabata.records.bags import Bag
from worlds.splits import DEVELOPMENT_SEED

CLOUD = "/3D_relative_cloud"
"""Topic to whose messages delays refer."""

PRODUCTS = ("/2D_virtual_scan", "/cmd_vel")
"""Topics that are made from a cloud."""

RECORDED = (*PRODUCTS, CLOUD, "/imu", "/2D_scan")
"""Topics that are recorded."""


@dataclass(frozen=True)
class LiveRun:
    """Recording of a live graph.

    Attributes:
        stamps: Receipt times by topic [s], float64, shape (n,) each.
        navigator: Result that the navigator printed.
        rates: Last lines of ``rostopic hz``.
    """

    stamps: dict[str, NDArray[np.float64]]
    navigator: dict[str, Any]
    rates: str


def run_graph(world: str, seed: int, seconds: float) -> LiveRun:
    """Run the graph and record it.

    Args:
        world: Preset of the simulated robot's world.
        seed: Seed of the world and of the noise.
        seconds: Duration of the recording [s].
    """
    with tempfile.TemporaryDirectory() as name, running(Path(name)) as graph:
        drive = ("--world", world, "--seed", seed)
        graph.andabata("robot", *drive, "--seconds", seconds + 120)
        graph.wait_for("/initialpose", "Publishers:")
        node = graph.andabata("navigator", "--controller", "reactive", "--seconds", seconds + 15)
        graph.wait_for("/cmd_vel", "Publishers:")
        bag = Path(name) / "live.bag"
        recorder = graph.start("rosbag", "record", "-O", bag, *RECORDED)
        printed = graph.tool("rostopic", "hz", *reversed(PRODUCTS), seconds=seconds)
        navigator = result(node, 120)
        stamps: dict[str, list[float]] = {topic: [] for topic in RECORDED}
        with Bag(finished_bag(recorder, bag)) as recording:
            for message in recording.messages():
                stamps[message.topic].append(message.stamp_ns / 1e9)
    arrays = {topic: np.array(each) for topic, each in stamps.items()}
    return LiveRun(arrays, navigator, "\n".join(printed.splitlines()[-4:]))


def delay_row(topic: str, stamps: NDArray[np.float64], clouds: NDArray[np.float64]) -> Row:
    """Return rate, gaps and delays after the last cloud before each message.

    Args:
        topic: Name of the topic.
        stamps: Times of its messages [s], shape (n,).
        clouds: Times of the clouds [s], shape (k,).
    """
    times = stamps[stamps > clouds[0]]
    delay = 1e3 * (times - clouds[np.searchsorted(clouds, times) - 1])
    gaps = np.diff(times)
    return {
        "topic": topic,
        "messages": len(times),
        "rate [Hz]": float(1 / gaps.mean()),
        "99 % of gaps [ms]": float(1e3 * np.quantile(gaps, 0.99)),
        "median delay [ms]": float(np.median(delay)),
        "99 % [ms]": float(np.quantile(delay, 0.99)),
        "most [ms]": float(delay.max()),
    }


def rate_rows(stamps: dict[str, NDArray[np.float64]]) -> list[Row]:
    """Return the mean rate of each topic."""
    return [
        {"topic": topic, "rate [Hz]": float((len(each) - 1) / (each[-1] - each[0]))}
        for topic, each in stamps.items()
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """Run the graph and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="Duration [s].")
    parser.add_argument("--world", default="natural-test", help="World preset.")
    parser.add_argument(
        "--seed", type=int, default=DEVELOPMENT_SEED, help="Seed of world and noise."
    )
    options = parser.parse_args(argv)
    run = run_graph(options.world, options.seed, options.seconds)
    clouds = run.stamps[CLOUD]
    sys.stdout.write(
        markdown_table([delay_row(topic, run.stamps[topic], clouds) for topic in PRODUCTS])
    )
    sys.stdout.write("\n" + markdown_table(rate_rows(run.stamps)))
    sys.stdout.write(f"\nnavigator: {run.navigator}\n\n{run.rates}\n")


if __name__ == "__main__":
    main()
