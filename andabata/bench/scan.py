"""How long from a cloud to its virtual scan? One core, clouds of a data set.

Run with ``python tests/benchmarks/bench_scan.py CLOUDS``: the median over the validation clouds,
each thinned or repeated to 32,000 points, of the best of five looks.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from andabata.models import shipped_forest
from traversability.binning import fill_quarters, make_quarters
from traversability.dataset import read_clouds, read_manifest
from traversability.scanner import TraversabilityScanner

POINTS = 32_000


def best_of_five(look: Callable[[], object]) -> float:
    """Return the shortest of five times [us]."""
    times = []
    for _ in range(5):
        began = time.perf_counter()
        look()
        times.append(time.perf_counter() - began)
    return 1e6 * min(times)


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    scanner = TraversabilityScanner(shipped_forest())
    memory = make_quarters(scanner.grid, POINTS)
    rng = np.random.default_rng(0)
    rows = []
    for cloud in read_clouds(folder, read_manifest(folder), "validation"):
        chosen = np.sort(rng.choice(len(cloud), POINTS, replace=len(cloud) < POINTS))
        points = cloud.points[chosen]
        rows.append(
            (
                best_of_five(lambda p=points: scanner.scan(p)),
                best_of_five(lambda p=points: scanner.cells(p)),
                best_of_five(lambda p=points: fill_quarters(p, scanner.grid, memory)),
            )
        )
    names = ("scan", "all cells", "points to quarters")
    for name, times in zip(names, np.transpose(rows), strict=True):
        low, middle, high = np.quantile(times, [0.05, 0.5, 0.95])
        text = f"{name:20} median {middle:5.0f} us, 5 to 95 % {low:.0f} to {high:.0f} us"
        sys.stdout.write(f"{text}, {len(times)} clouds of {POINTS} points\n")
