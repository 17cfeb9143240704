"""Ours and the peers on the same clouds: cells, points, hazards and milliseconds."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.perception_peers import PEERS, Peer
from andabata.datasets.hazard_suite import HazardCase, hazard_cases, hazard_cloud
from andabata.engine import run_tasks
from traversability.binning import fill_quarters
from traversability.cloud import PointCloud
from traversability.dataset import Manifest, read_clouds
from traversability.files import read_cloud
from traversability.forest import Forest, Thresholds
from traversability.grid import PolarGrid
from traversability.labels import CellState, beyond_doubt, label_cells, nontraversable
from traversability.points import PointClassifier, fit_point_classifier, point_features
from traversability.scanner import TraversabilityScanner
from traversability.scores import CellScores, range_errors

OURS, EVEN, POINTS = "andabata", "andabata, even costs", "point classifier"
"""The cell classifier as it is shipped, the same with a threshold of one half, which asks for the
best F1 as the peers' settings do, and the point classifier."""

_POINTS_A_CLOUD = 400


@dataclass(frozen=True)
class Look:
    """What a subject made of one cloud.

    Attributes:
        subject: Who.
        cells: ``CellState`` of each cell.
        points: Confusion of points in the grid: tp, fp, fn, shape (3,), or None.
        seconds: Time from cloud to cells [s].
    """

    subject: str
    cells: NDArray[np.uint8]
    points: NDArray[np.int64] | None
    seconds: float


@dataclass(frozen=True)
class Bench:
    """Whom to compare, ready to be sent to a process.

    Attributes:
        forest: The cell classifier's file.
        points: The point classifier, or None.
        peers: Names of peers with their settings.
    """

    forest: bytes
    points: PointClassifier | None
    peers: tuple[tuple[str, tuple[tuple[str, Any], ...]], ...]


def tune(peer: Peer, clouds: Sequence[PointCloud], grid: PolarGrid) -> dict[str, Any]:
    """Return the settings with the best F1 of red cells."""

    def score(settings: dict[str, Any]) -> float:
        method = peer.make(**settings, grid=grid)
        truth = [label_cells(c.points, nontraversable(c), grid) for c in clouds]
        called = [label_cells(c.points, method(c.points), grid) for c in clouds]
        return CellScores.of(np.stack(truth), np.stack(called)).f1_red

    return max(peer.settings(), key=score)


def train_point_classifier(
    folder: Path, manifest: Manifest, grid: PolarGrid, clouds: int, seed: int
) -> PointClassifier:
    """Grow the point classifier on some points of some clouds of the training split."""
    rng = np.random.default_rng(seed)
    entries = manifest.of("train")
    chosen = rng.permutation(len(entries))[:clouds]
    features, bad = [], []
    for number in chosen:
        cloud = read_cloud(folder / entries[number].file)
        inside = np.flatnonzero(fill_quarters(cloud.points, grid).bins[: len(cloud)] >= 0)
        rows = rng.choice(inside, min(_POINTS_A_CLOUD, len(inside)), replace=False)
        features.append(point_features(cloud.points, grid)[rows])
        bad.append(nontraversable(cloud)[rows])
    return fit_point_classifier(np.concatenate(features), np.concatenate(bad), grid, seed)


def look_at(bench: Bench, folder: Path, file: str) -> list[Look]:
    """Return what every subject makes of a cloud of a data set."""
    cloud = read_cloud(folder / file)
    scanner = _scanner(bench.forest)
    grid, bad = scanner.grid, nontraversable(cloud)
    cells = scanner.cells(cloud.points)
    began = time.perf_counter()
    scanner.scan(cloud.points)
    looks = [Look(OURS, cells, None, time.perf_counter() - began)]
    even = _scanner(bench.forest, even=True)
    looks.append(Look(EVEN, even.cells(cloud.points), None, looks[0].seconds))
    methods: dict[str, Callable[[Any], NDArray[np.bool_]]] = {
        name: _method(name, settings) for name, settings in bench.peers
    }
    if bench.points is not None:
        methods[POINTS] = bench.points.obstacles
    inside = fill_quarters(cloud.points, grid).bins[: len(cloud)] >= 0
    for name, method in methods.items():
        began = time.perf_counter()
        flags = method(cloud.points)
        states = label_cells(cloud.points, flags, grid)
        seconds = time.perf_counter() - began
        hits = [bad & flags, ~bad & flags, bad & ~flags]
        looks.append(Look(name, states, np.array([(h & inside).sum() for h in hits]), seconds))
    return looks


@lru_cache(maxsize=4)
def _scanner(forest: bytes, even: bool = False) -> TraversabilityScanner:
    """Return a process's scanner."""
    loaded = Forest.from_bytes(forest)
    return TraversabilityScanner(replace(loaded, thresholds=Thresholds()) if even else loaded)


@lru_cache(maxsize=16)
def _method(name: str, settings: tuple[tuple[str, Any], ...]) -> Callable[..., Any]:
    """Return a process's peer."""
    (peer,) = (peer for peer in PEERS if peer.name == name)
    return peer.make(**dict(settings), grid=PolarGrid())


def compare(
    bench: Bench,
    folder: Path,
    manifest: Manifest,
    workers: int,
    on_cloud: Callable[[], None],
) -> dict[str, dict[str, Any]]:
    """Return each subject's scores on the validation split: all cells, each kind of world, time."""
    entries = manifest.of("validation")
    grid = Forest.from_bytes(bench.forest).grid
    truth = np.stack(
        [
            label_cells(c.points, nontraversable(c), grid)
            for c in read_clouds(folder, manifest, "validation")
        ]
    )
    kinds = np.array([entry.world for entry in entries])
    looks: dict[str, list[Look]] = {}
    work = partial(look_at, bench, folder)
    for _, found in run_tasks(work, [entry.file for entry in entries], workers):
        for look in found:
            looks.setdefault(look.subject, []).append(look)
        on_cloud()
    return {name: _summary(rows, truth, kinds, grid) for name, rows in looks.items()}


def _summary(
    looks: list[Look], truth: NDArray[np.uint8], kinds: NDArray[np.str_], grid: PolarGrid
) -> dict[str, Any]:
    """Return a subject's scores."""
    cells = np.stack([look.cells for look in looks])
    worlds = {
        str(kind): CellScores.of(truth[kinds == kind], cells[kinds == kind]).f1_red
        for kind in np.unique(kinds)
    }
    summary = CellScores.of(truth, cells).as_dict() | {"worlds": worlds}
    summary["ranges"] = range_errors(truth, cells, grid)
    summary["ms"] = 1e3 * float(np.median([look.seconds for look in looks]))
    counted = [look.points for look in looks if look.points is not None]
    if counted:
        tp, fp, fn = np.sum(counted, axis=0)
        summary["f1_points"] = float(2 * tp / (2 * tp + fp + fn))
    return summary


@dataclass(frozen=True)
class HazardLook:
    """What the scanner made of one hazard's cloud: states of its cells, true and called."""

    case: HazardCase
    truth: NDArray[np.uint8]
    called: NDArray[np.uint8]
    clear: NDArray[np.bool_]


def look_at_hazard(forest: bytes, seed: int, case: HazardCase) -> HazardLook:
    """Return what the scanner makes of a case of the suite."""
    scanner = _scanner(forest)
    cloud = hazard_cloud(case, seed)
    truth = label_cells(cloud.points, nontraversable(cloud), scanner.grid)
    clear = beyond_doubt(cloud, scanner.grid)
    return HazardLook(case, truth, scanner.cells(cloud.points), clear)


def judge_hazards(
    forest: bytes, sides: int, seed: int, workers: int, on_case: Callable[[], None]
) -> list[dict[str, Any]]:
    """Return recall and false alarms of each hazard, within 4 m of the robot.

    ``recall`` counts red cells, ``recall_clear`` those beyond doubt, and ``stopped`` the sectors
    with a red cell whose virtual range is not too long by more than a ring.
    """
    looks: dict[tuple[str, float | None], list[HazardLook]] = {}
    work = partial(look_at_hazard, forest, seed)
    for case, look in run_tasks(work, list(hazard_cases(sides)), workers):
        slope = case.slope_deg if case.hazard == "bare_ground" else None
        looks.setdefault((case.hazard, slope), []).append(look)
        on_case()
    grid = Forest.from_bytes(forest).grid
    return [
        {"hazard": name if slope is None else f"{name}, {slope:g} degrees"} | _hazard(rows, grid)
        for (name, slope), rows in looks.items()
    ]


def _hazard(looks: list[HazardLook], grid: PolarGrid) -> dict[str, Any]:
    """Return the figures of one hazard."""
    near = int(np.searchsorted(grid.ring_edges, 4.0))
    truth, called = (np.stack([getattr(k, name) for k in looks]) for name in ("truth", "called"))
    clear = np.stack([look.clear for look in looks])[..., :near]
    red, alarm = (c[..., :near] == CellState.NON_TRAVERSABLE for c in (truth, called))
    green = truth[..., :near] == CellState.TRAVERSABLE
    true_range, called_range = (
        np.where((c == CellState.NON_TRAVERSABLE).any(-1), (c == 2).argmax(-1), grid.n_rings)
        for c in (truth, called)
    )
    seen = true_range < near

    def share(part: NDArray[np.bool_], whole: NDArray[np.bool_]) -> float | None:
        return float((part & whole).sum() / whole.sum()) if whole.any() else None

    return {
        "clouds": len(looks),
        "red_cells": int(red.sum()),
        "recall": share(alarm, red),
        "recall_clear": share(alarm, red & clear),
        "stopped": share(called_range - true_range <= 1, seen),
        "false_alarms": share(alarm, green),
    }
