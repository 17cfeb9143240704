"""Scores of the cell classifier on the hazard suite: recall, stops in time, false alarms."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row
from andabata.datasets.hazard_suite import HazardCase, hazard_cases, hazard_cloud
from andabata.engine_processes import run_tasks
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState, beyond_doubt, label_cells, nontraversable
from traversability.scanner import TraversabilityScanner

NEAR = 4.0
"""Largest distance of the cells of hazards that count [m]."""


def hazard_table(hazards: Sequence[Row]) -> list[Row]:
    """Return the results of ``evaluate_hazards`` as a table for people."""
    return [
        {
            "hazard": row["hazard"],
            "clouds": row["clouds"],
            "blocked cells": row["red_cells"],
            "recall": row["recall"],
            "of clear labels": row["recall_clear"],
            "stopped": row["stopped"],
            "false alarms": row["false_alarms"],
        }
        for row in hazards
    ]


@dataclass(frozen=True)
class HazardClassification:
    """Cells of one hazard's cloud.

    Attributes:
        case: Hazard.
        truth: True ``CellState``, uint8, shape (n_sectors, n_rings).
        called: ``CellState`` that the classifier gives, of the same shape.
        clear: True for cells whose label is beyond doubt, of the same shape.
    """

    case: HazardCase
    truth: NDArray[np.uint8]
    called: NDArray[np.uint8]
    clear: NDArray[np.bool_]


def classify_hazard(forest: bytes, seed: int, case: HazardCase) -> HazardClassification:
    """Return the cells of one case of the hazard suite."""
    scanner = _scanner(forest)
    cloud = hazard_cloud(case, seed)
    truth = label_cells(cloud.points, nontraversable(cloud), scanner.grid)
    clear = beyond_doubt(cloud, scanner.grid)
    return HazardClassification(case, truth, scanner.cells(cloud.points), clear)


@lru_cache(maxsize=4)
def _scanner(forest: bytes) -> TraversabilityScanner:
    """Return the scanner of this process."""
    return TraversabilityScanner(Forest.from_bytes(forest))


def evaluate_hazards(
    forest: bytes, sides: int, seed: int, workers: int, on_case: Callable[[], None]
) -> list[Row]:
    """Return recall and false alarms of each hazard, within 4 m of the robot.

    ``recall`` is the share of blocked cells that are called blocked, ``recall_clear`` that of those
    whose label is beyond doubt, ``stopped`` the share of sectors with a blocked cell whose virtual
    range is not too long by more than a ring, and ``false_alarms`` the share of traversable cells
    that are called blocked.

    Args:
        forest: Content of the cell classifier's file.
        sides: Number of sides that hazards are seen from.
        seed: Seed of the suite.
        workers: Number of processes.
        on_case: Function that is called after each case.
    """
    results: dict[tuple[str, float | None], list[HazardClassification]] = {}
    work = partial(classify_hazard, forest, seed)
    for case, result in run_tasks(work, list(hazard_cases(sides)), workers):
        slope = case.slope_deg if case.hazard == "bare_ground" else None
        results.setdefault((case.hazard, slope), []).append(result)
        on_case()
    grid = Forest.from_bytes(forest).grid
    return [
        {"hazard": name if slope is None else f"{name}, {slope:g} degrees"}
        | hazard_scores(
            np.stack([result.truth for result in rows]),
            np.stack([result.called for result in rows]),
            np.stack([result.clear for result in rows]),
            grid,
        )
        for (name, slope), rows in results.items()
    ]


def hazard_scores(
    truth: NDArray[np.uint8],
    called: NDArray[np.uint8],
    clear: NDArray[np.bool_],
    grid: PolarGrid,
) -> Row:
    """Return the scores of one hazard; see ``evaluate_hazards``.

    Args:
        truth: True ``CellState``, shape (k, n_sectors, n_rings).
        called: ``CellState`` that the classifier gives, of the same shape.
        clear: True for cells whose label is beyond doubt, of the same shape.
        grid: Grid of the cells.
    """
    near = int(np.searchsorted(grid.ring_edges, NEAR))
    blocked, alarm = (c[..., :near] == CellState.NON_TRAVERSABLE for c in (truth, called))
    free = truth[..., :near] == CellState.TRAVERSABLE
    # Index of each sector's first blocked ring; the number of rings if there is none.
    true_range, called_range = (
        np.where(
            (c == CellState.NON_TRAVERSABLE).any(-1),
            (c == CellState.NON_TRAVERSABLE).argmax(-1),
            grid.n_rings,
        )
        for c in (truth, called)
    )

    def share(part: NDArray[np.bool_], whole: NDArray[np.bool_]) -> float | None:
        return float((part & whole).sum() / whole.sum()) if whole.any() else None

    return {
        "clouds": len(truth),
        "red_cells": int(blocked.sum()),
        "recall": share(alarm, blocked),
        "recall_clear": share(alarm, blocked & clear[..., :near]),
        "stopped": share(called_range - true_range <= 1, true_range < near),
        "false_alarms": share(alarm, free),
    }
