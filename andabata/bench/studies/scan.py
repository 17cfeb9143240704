"""Measures the time from a point cloud to its virtual scan, on one core.

``python -m andabata.bench.studies.scan CLOUDS`` prints a Markdown table: quantiles over the
validation clouds of a data set, each thinned or repeated to the same number of points.
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from andabata.bench.table import Row, markdown_table
from andabata.models import shipped_forest
from traversability.binning import fill_quarters, make_quarters
from traversability.dataset import read_clouds, read_manifest
from traversability.scanner import TraversabilityScanner

STAGES = ("scan", "all cells", "points to quarters")
"""Names of the timed calls, from the whole to its first part."""


def best_of_five(call: Callable[[], object]) -> float:
    """Return the shortest duration of five calls [us]."""
    times = []
    for _ in range(5):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
    return 1e6 * min(times)


def time_scans(folder: Path, count: int) -> list[Row]:
    """Return the time of each stage [us]: median, 5 % and 95 % quantiles over the clouds.

    Args:
        folder: Data set; its validation split is used.
        count: Number of points that every cloud is thinned or repeated to.
    """
    scanner = TraversabilityScanner(shipped_forest())
    memory = make_quarters(scanner.grid, count)
    rng = np.random.default_rng(0)
    times = []
    for cloud in read_clouds(folder, read_manifest(folder), "validation"):
        chosen = np.sort(rng.choice(len(cloud), count, replace=len(cloud) < count))
        points = cloud.points[chosen]
        times.append(
            (
                best_of_five(lambda p=points: scanner.scan(p)),  # type: ignore[misc]
                best_of_five(lambda p=points: scanner.cells(p)),  # type: ignore[misc]
                best_of_five(lambda p=points: fill_quarters(p, scanner.grid, memory)),  # type: ignore[misc]
            )
        )
    quantiles = np.quantile(times, [0.5, 0.05, 0.95], axis=0).T
    return [
        {
            "stage": stage,
            "median [us]": round(middle),
            "5 % [us]": round(low),
            "95 % [us]": round(high),
            "clouds": len(times),
            "points": count,
        }
        for stage, (middle, low, high) in zip(STAGES, quantiles.tolist(), strict=True)
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clouds", type=Path, help="Data set.")
    parser.add_argument("--points", type=int, default=32_000, help="Points of each cloud.")
    options = parser.parse_args(argv)
    sys.stdout.write(markdown_table(time_scans(options.clouds, options.points)))


if __name__ == "__main__":
    main()
