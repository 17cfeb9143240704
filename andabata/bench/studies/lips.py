"""Measures which hazard cells the classifier misses: those whose own points look flat, or others.

``python -m andabata.bench.studies.lips`` prints a Markdown table. The clouds are hazards of
development (seed 1, not those of the evaluation); blocked cells within 4 m count. A cell looks flat
if its own points lie within 3 cm (rms) of a plane of less than 20 degrees, as on the lip of a
ditch: nothing in the cell itself shows the edge beside it.
"""

import argparse
import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from andabata.bench.table import Row, markdown_table
from andabata.datasets.hazard_suite import HazardCase, hazard_cases, hazard_cloud
from andabata.models import shipped_forest
from traversability.labels import CellState, label_cells, nontraversable
from traversability.scanner import TraversabilityScanner

HAZARDS = ("ditch", "drop", "down_step", "crest", "rock_field", "rock_over_clearance")
"""Names of the hazards."""

_NEAR = 4.0
"""Largest distance of a cell that counts [m]."""

_ROUGHNESS, _SLOPE_DEG = 0.03, 20.0
"""Limits of what looks flat: rms distance from the plane [m], slope of the plane [deg]."""

CellFlags = NDArray[np.bool_]
"""Flags of blocked cells, shape (n, 2): looks flat, called blocked."""


def looks_flat(points: NDArray[np.float32]) -> bool:
    """Return True if points, shape (k, 3) [m], fit a traversable plane."""
    xy = points[:, :2] - points[:, :2].mean(axis=0)
    rows = np.column_stack([xy, np.ones(len(xy))])
    plane, *_ = np.linalg.lstsq(rows, points[:, 2], rcond=None)
    rough = float((points[:, 2] - rows @ plane).std())
    return rough < _ROUGHNESS and bool(
        np.hypot(plane[0], plane[1]) < np.tan(np.deg2rad(_SLOPE_DEG))
    )


def classify_hazard(scanner: TraversabilityScanner, case: HazardCase) -> CellFlags:
    """Return the flags of a hazard's near blocked cells that hold enough points."""
    grid = scanner.grid
    near = int(np.searchsorted(grid.ring_edges, _NEAR))
    cloud = hazard_cloud(case, seed=1)
    x, y = cloud.points[:, 0], cloud.points[:, 1]
    ring = np.searchsorted(grid.ring_edges, np.hypot(x, y), side="right") - 1
    share = (np.arctan2(y, x) + np.pi) / (2 * np.pi)
    sector = (share * grid.n_sectors).astype(int) % grid.n_sectors
    truth = label_cells(cloud.points, nontraversable(cloud), grid)
    called = scanner.cells(cloud.points)
    flags = []
    for s, r in np.argwhere(truth[:, :near] == CellState.NON_TRAVERSABLE):
        points = cloud.points[(sector == s) & (ring == r)]
        if len(points) >= grid.min_points:
            blocked = called[s, r] == CellState.NON_TRAVERSABLE
            flags.append((looks_flat(points), bool(blocked)))
    return np.array(flags, dtype=bool).reshape(-1, 2)


def recall_row(hazard: str, flags: CellFlags) -> Row:
    """Return the recall of one hazard's cells, of those that look flat and of the others."""
    flat, found = flags.T

    def recall(cells: NDArray[np.bool_]) -> float | None:
        return float(found[cells].mean()) if cells.any() else None

    return {
        "hazard": hazard.replace("_", " "),
        "blocked cells": len(flat),
        "look flat": int(flat.sum()),
        "recall of these": recall(flat),
        "of the others": recall(~flat),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sides", type=int, default=2, help="Sides that hazards are seen from.")
    options = parser.parse_args(argv)
    scanner = TraversabilityScanner(shipped_forest())
    cases = [case for case in hazard_cases(options.sides) if case.hazard in HAZARDS]
    found: dict[str, list[CellFlags]] = {}
    for case in track(cases, "hazards", console=Console(stderr=True)):
        found.setdefault(case.hazard, []).append(classify_hazard(scanner, case))
    rows = [recall_row(hazard, np.concatenate(flags)) for hazard, flags in found.items()]
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
