"""What is missed of the hazards? Cells whose own points look flat, told apart from the others.

Run with ``python tests/benchmarks/bench_lips.py [SIDES]``: hazards of development (seed 1, not the
suite that judges), red cells within 4 m. A cell looks flat where its points lie within 3 cm (rms)
of a plane of less than 20 degrees: nothing in it tells of the edge beside it.
"""

import sys
from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from andabata.datasets.hazard_suite import hazard_cases, hazard_cloud
from andabata.models import shipped_forest
from traversability.labels import CellState, label_cells, nontraversable
from traversability.scanner import TraversabilityScanner

NAMES = ("ditch", "drop", "down_step", "crest", "rock_field", "rock_over_clearance")


def looks_flat(points: NDArray[np.float32]) -> bool:
    """Return whether points (k, 3) [m] fit a drivable plane."""
    xy = points[:, :2] - points[:, :2].mean(axis=0)
    rows = np.column_stack([xy, np.ones(len(xy))])
    plane, *_ = np.linalg.lstsq(rows, points[:, 2], rcond=None)
    rough = float((points[:, 2] - rows @ plane).std())
    return rough < 0.03 and np.hypot(plane[0], plane[1]) < np.tan(np.deg2rad(20.0))


def main(sides: int) -> None:
    """Print a Markdown table."""
    scanner = TraversabilityScanner(shipped_forest())
    grid = scanner.grid
    near = int(np.searchsorted(grid.ring_edges, 4.0))
    found: dict[str, list[tuple[bool, bool]]] = defaultdict(list)
    for case in hazard_cases(sides):
        if case.hazard not in NAMES:
            continue
        cloud = hazard_cloud(case, seed=1)
        x, y = cloud.points[:, 0], cloud.points[:, 1]
        ring = np.searchsorted(grid.ring_edges, np.hypot(x, y), side="right") - 1
        share = (np.arctan2(y, x) + np.pi) / (2 * np.pi)
        sector = (share * grid.n_sectors).astype(int) % grid.n_sectors
        truth = label_cells(cloud.points, nontraversable(cloud), grid)
        called = scanner.cells(cloud.points)
        for s, r in np.argwhere(truth[:, :near] == CellState.NON_TRAVERSABLE):
            points = cloud.points[(sector == s) & (ring == r)]
            if len(points) >= grid.min_points:
                seen = called[s, r] == CellState.NON_TRAVERSABLE
                found[case.hazard].append((looks_flat(points), bool(seen)))
    sys.stdout.write("| hazard | red cells | look flat | recall of these | of the others |\n")
    sys.stdout.write("|---|---|---|---|---|\n")
    for name, cells in found.items():
        flat, seen = np.array(cells).T
        row = (name.replace("_", " "), len(flat), int(flat.sum()))
        recalls = f"{seen[flat].mean():.3f} | {seen[~flat].mean():.3f}"
        sys.stdout.write(f"| {' | '.join(map(str, row))} | {recalls} |\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2)
