"""Scores of the cell classifier on the field suite: plants that block, ground that stays free."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.bench.table import Row
from andabata.datasets.field_suite import FREE_KINDS, FieldCase, field_cases, field_cloud
from andabata.engine_processes import run_tasks
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells, nontraversable
from traversability.scanner import TraversabilityScanner

INTO_FIELD = 1.5
"""Stretch beyond a field's edge that no range may run into it [m]."""

_HEIGHTS = (0.2, 0.3, 0.4, 0.6, 1.2)
"""Bounds of the heights that fields are scored by [m]."""


@dataclass(frozen=True)
class FieldClassification:
    """Cells of one case's cloud.

    Attributes:
        case: Case of the suite.
        points: Points in ``base_footprint`` [m], float32, shape (n, 3).
        truth: True ``CellState``, uint8, shape (n_sectors, n_rings).
        called: ``CellState`` that the classifier gives, of the same shape.
        ranges: Range of the virtual scan in each sector [m], shape (n_sectors,).
        bearings: Bearing of each sector from the field's middle [rad], shape (n_sectors,).
    """

    case: FieldCase
    points: NDArray[np.float32]
    truth: NDArray[np.uint8]
    called: NDArray[np.uint8]
    ranges: NDArray[np.float32]
    bearings: NDArray[np.float64]


def classify_field(forest: bytes, seed: int, case: FieldCase) -> FieldClassification:
    """Return the cells of one case of the field suite."""
    scanner = _scanner(forest)
    cloud, yaw = field_cloud(case, seed)
    truth = label_cells(cloud.points, nontraversable(cloud), scanner.grid)
    called, scan = scanner.cells(cloud.points), scanner.scan(cloud.points)
    bearings = scanner.grid.bearings + yaw - case.bearing
    bearings = (bearings + np.pi) % (2 * np.pi) - np.pi
    return FieldClassification(case, cloud.points, truth, called, scan.ranges, bearings)


def field_examples(forest: bytes, count: int, seed: int) -> dict[str, FieldClassification]:
    """Return the first case of each kind, by kind; arguments as in ``evaluate_fields``."""
    first: dict[str, FieldCase] = {}
    for case in field_cases(count, seed):
        first.setdefault(case.kind, case)
    return {kind: classify_field(forest, seed, case) for kind, case in first.items()}


@lru_cache(maxsize=4)
def _scanner(forest: bytes) -> TraversabilityScanner:
    """Return the scanner of this process."""
    return TraversabilityScanner(Forest.from_bytes(forest))


def evaluate_fields(
    forest: bytes,
    count: int,
    seed: int,
    workers: int,
    on_case: Callable[[], None],
    release: str | None = None,
) -> list[Row]:
    """Return the scores of fields by height, and of each kind of free ground.

    Args:
        forest: Content of the cell classifier's file.
        count: Number of fields, and of cases of free ground.
        seed: Seed of the suite.
        workers: Number of processes.
        on_case: Function that is called after each case.
        release: Release that the suite judges; None for development.

    Raises:
        JudgingSeedError: If the seed judges a release, and it is not ``release``.
    """
    results = []
    work = partial(classify_field, forest, seed)
    for _, result in run_tasks(work, list(field_cases(count, seed, release)), workers):
        results.append(replace(result, points=result.points[:0]))  # Hundreds of clouds, unread.
        on_case()
    grid = Forest.from_bytes(forest).grid
    rows = []
    for low, high in pairwise(_HEIGHTS):
        inside = [r for r in results if r.case.field and low <= r.case.field.height < high]
        rows.append({"kind": f"field, {low:g} to {high:g} m"} | field_scores(inside, grid))
    for kind in FREE_KINDS:
        same = [r for r in results if r.case.kind == kind]
        rows.append({"kind": kind} | field_scores(same, grid))
    return rows


def field_scores(results: Sequence[FieldClassification], grid: PolarGrid) -> Row:
    """Return the scores of some cases.

    ``recall`` is the share of blocked cells that are called blocked, ``into_field`` the number of
    sectors towards the field whose range runs more than ``INTO_FIELD`` into it, of ``towards``;
    ``false_alarms`` the share of free cells that are called blocked, ``closed`` the share of
    sectors without a blocked cell that end early.

    Args:
        results: Cells of the cases.
        grid: Grid of the cells.
    """
    blocked = free = hit = alarms = into = towards = clear = closed = 0
    for result in results:
        bad = result.truth == CellState.NON_TRAVERSABLE
        good = result.truth == CellState.TRAVERSABLE
        called = result.called == CellState.NON_TRAVERSABLE
        blocked, hit = blocked + int(bad.sum()), hit + int((bad & called).sum())
        free, alarms = free + int(good.sum()), alarms + int((good & called).sum())
        open_ = ~bad.any(axis=1) & ~np.isnan(result.ranges)
        clear, closed = clear + int(open_.sum()), closed + int((open_ & called.any(axis=1)).sum())
        if result.case.field is not None:
            ahead, limit = _towards(result, grid)
            ranges = np.minimum(np.nan_to_num(result.ranges, posinf=np.inf), grid.outer_radius)
            towards, into = towards + int(ahead.sum()), into + int((ranges > limit)[ahead].sum())
    return {
        "clouds": len(results),
        "red_cells": blocked,
        "recall": hit / blocked if blocked else None,
        "towards": towards,
        "into_field": into,
        "green_cells": free,
        "false_alarms": alarms / free if free else None,
        "closed": closed / clear if clear else None,
    }


def _towards(
    result: FieldClassification, grid: PolarGrid
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return the sectors that look into a field without gaps, and the longest range of each [m].

    Sectors within 45 degrees of the field's middle look into it, where plants of full height
    begin behind the ramp of a gradual edge.
    """
    field = result.case.field
    if field is None or field.gaps > 0:
        return np.zeros(grid.n_sectors, dtype=np.bool_), np.zeros(grid.n_sectors)
    ahead = np.abs(result.bearings) < np.deg2rad(45.0)
    begin = field.distance + field.ramp
    limit = begin / np.cos(np.where(ahead, result.bearings, 0.0)) + INTO_FIELD
    return ahead & (limit < grid.outer_radius), limit


def field_table(rows: Sequence[Row]) -> list[Row]:
    """Return the results of ``evaluate_fields`` as a table for people."""
    return [
        {
            "kind": row["kind"],
            "clouds": row["clouds"],
            "blocked cells": row["red_cells"],
            "recall": row["recall"],
            "sectors into the field": f"{row['into_field']} of {row['towards']}",
            "false alarms": row["false_alarms"],
            "free sectors closed": row["closed"],
        }
        for row in rows
    ]
