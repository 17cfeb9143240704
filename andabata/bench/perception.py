"""Compares the cell classifier with its peers on the same clouds: cells, points, hazards, time."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.bench.hazards import evaluate_hazards
from andabata.bench.perception_peers import PEERS, Peer
from andabata.bench.reporter import Reporter
from andabata.bench.table import Row, benchmark_row
from andabata.datasets.hazard_suite import hazard_cases
from andabata.engine_processes import run_tasks
from traversability.binning import fill_quarters
from traversability.cloud import PointCloud
from traversability.dataset import DatasetError, Manifest, Split, read_clouds, read_manifest
from traversability.files import read_cloud
from traversability.forest import Forest, Thresholds
from traversability.grid import PolarGrid
from traversability.labels import label_cells, nontraversable
from traversability.points import PointClassifier, fit_point_classifier, point_features
from traversability.scanner import TraversabilityScanner
from traversability.scores import CellScores, range_errors

OURS, EVEN, POINTS = "andabata", "andabata, even costs", "point classifier"
"""Names of the cell classifier as shipped, of the same with a threshold of one half, which aims at
the best F1 as the peers' settings do, and of the point classifier."""


_POINTS_A_CLOUD = 400

Settings = tuple[tuple[str, Any], ...]
"""Settings of a peer, by name, ready to be a key."""


@dataclass(frozen=True)
class Classification:
    """Result of one subject on one cloud.

    Attributes:
        subject: Name of the subject.
        cells: ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).
        points: Confusion of points in the grid: tp, fp, fn, shape (3,), or None.
        seconds: Time from cloud to cells [s].
    """

    subject: str
    cells: NDArray[np.uint8]
    points: NDArray[np.int64] | None
    seconds: float


@dataclass(frozen=True)
class Subjects:
    """Subjects of the comparison, ready to be sent to a process.

    Attributes:
        forest: Content of the cell classifier's file.
        points: Point classifier, or None.
        peers: Names of peers with their settings.
    """

    forest: bytes
    points: PointClassifier | None
    peers: tuple[tuple[str, Settings], ...]


def bench_perception(
    forest: Forest,
    clouds: Path,
    *,
    tune_on: Path | None,
    tuning: int,
    points: int,
    sides: int,
    seed: int,
    workers: int,
    reporter: Reporter,
) -> Row:
    """Return the scores of the cell classifier and of every peer that is installed.

    Args:
        forest: Cell classifier.
        clouds: Data set whose validation split evaluates.
        tune_on: Data set on whose validation split the peers are tuned; None for the training
            split of ``clouds``.
        tuning: Largest number of clouds to tune on.
        points: Number of training clouds of the point classifier; 0 leaves it out.
        sides: Number of sides that hazards are seen from; 0 leaves them out.
        seed: Seed of the point classifier.
        workers: Number of processes.
        reporter: Receiver of messages and progress.

    Returns:
        ``rows`` of all scores, scores by ``subjects``, ``hazards``, ``settings`` of the peers and
        number of ``clouds``.

    Raises:
        DatasetError: If there are no clouds to tune on.
    """
    manifest = read_manifest(clouds)
    source, split = tune_on or clouds, _tuning_split(tune_on)
    source_manifest = read_manifest(source)
    tuning_clouds = list(read_clouds(source, source_manifest, split))
    if not tuning_clouds:
        raise DatasetError(
            f"{source}: expected clouds of the {split} split to tune on, got none; see --tune-on"
        )
    every = max(1, len(tuning_clouds) // tuning)
    peers = tune_peers(tuning_clouds[::every][:tuning], forest.grid, reporter.status)
    trained = None
    if points:
        reporter.status(f"training the point classifier on {points} clouds")
        trained = train_point_classifier(source, source_manifest, forest.grid, points, seed)
    subjects = Subjects(forest.to_bytes(), trained, peers)
    total = len(manifest.of("validation"))
    with reporter.progress("clouds", total) as step:
        scores = compare(subjects, clouds, manifest, workers, step)
    hazards = []
    if sides:
        with reporter.progress("hazards", len(list(hazard_cases(sides)))) as step:
            hazards = evaluate_hazards(subjects.forest, sides, 0, workers, step)
    return {
        "rows": score_rows(scores),
        "subjects": scores,
        "hazards": hazards,
        "settings": {name: dict(settings) for name, settings in peers},
        "clouds": total,
    }


def _tuning_split(tune_on: Path | None) -> Split:
    """Return the split to tune on, which never is the one that evaluates."""
    return "validation" if tune_on else "train"


def tune_peers(
    clouds: Sequence[PointCloud], grid: PolarGrid, status: Callable[[str], None]
) -> tuple[tuple[str, Settings], ...]:
    """Return every peer that is installed with its best settings.

    Args:
        clouds: Labelled clouds.
        grid: Grid of the cells.
        status: Function that is called with a message for each peer.
    """
    tuned = []
    for peer in PEERS:
        try:
            settings = tune(peer, clouds, grid)
        except ImportError as error:
            status(f"{peer.name}: left out, {error.name} is not installed (extra `peers`)")
            continue
        status(f"{peer.name}: {settings}")
        tuned.append((peer.name, tuple(settings.items())))
    return tuple(tuned)


def tune(peer: Peer, clouds: Sequence[PointCloud], grid: PolarGrid) -> dict[str, Any]:
    """Return a peer's settings with the best F1 of blocked cells."""

    def score(settings: dict[str, Any]) -> float:
        method = peer.make(**settings, grid=grid)
        truth = [label_cells(c.points, nontraversable(c), grid) for c in clouds]
        called = [label_cells(c.points, method(c.points), grid) for c in clouds]
        return CellScores.of(np.stack(truth), np.stack(called)).f1_red

    return max(peer.settings(), key=score)


def train_point_classifier(
    folder: Path, manifest: Manifest, grid: PolarGrid, clouds: int, seed: int
) -> PointClassifier:
    """Return a point classifier trained on some points of the training split.

    Args:
        folder: Folder of the data set.
        manifest: Manifest of the data set.
        grid: Grid in which points count.
        clouds: Number of clouds.
        seed: Seed of the choice of clouds and points, and of the trees.
    """
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


def classify_cloud(subjects: Subjects, folder: Path, file: str) -> list[Classification]:
    """Return the result of every subject on one cloud of a data set.

    Args:
        subjects: Subjects of the comparison.
        folder: Folder of the data set.
        file: Path of the cloud in the folder.
    """
    cloud = read_cloud(folder / file)
    scanner = _scanner(subjects.forest)
    grid, bad = scanner.grid, nontraversable(cloud)
    cells = scanner.cells(cloud.points)
    began = time.perf_counter()
    scanner.scan(cloud.points)
    results = [Classification(OURS, cells, None, time.perf_counter() - began)]
    even = _scanner(subjects.forest, even=True)
    results.append(Classification(EVEN, even.cells(cloud.points), None, results[0].seconds))
    methods: dict[str, Callable[[Any], NDArray[np.bool_]]] = {
        name: _method(name, settings) for name, settings in subjects.peers
    }
    if subjects.points is not None:
        methods[POINTS] = subjects.points.obstacles
    inside = fill_quarters(cloud.points, grid).bins[: len(cloud)] >= 0
    for name, method in methods.items():
        began = time.perf_counter()
        flags = method(cloud.points)
        states = label_cells(cloud.points, flags, grid)
        seconds = time.perf_counter() - began
        hits = [bad & flags, ~bad & flags, bad & ~flags]
        counts = np.array([(h & inside).sum() for h in hits])
        results.append(Classification(name, states, counts, seconds))
    return results


@lru_cache(maxsize=4)
def _scanner(forest: bytes, even: bool = False) -> TraversabilityScanner:
    """Return the scanner of this process; ``even`` sets its thresholds to one half."""
    loaded = Forest.from_bytes(forest)
    return TraversabilityScanner(replace(loaded, thresholds=Thresholds()) if even else loaded)


@lru_cache(maxsize=16)
def _method(name: str, settings: Settings) -> Callable[..., Any]:
    """Return the peer of this process."""
    (peer,) = (peer for peer in PEERS if peer.name == name)
    return peer.make(**dict(settings), grid=PolarGrid())


def compare(
    subjects: Subjects,
    folder: Path,
    manifest: Manifest,
    workers: int,
    on_cloud: Callable[[], None],
) -> dict[str, Row]:
    """Return each subject's scores on the validation split: all cells, each kind of world, time.

    Args:
        subjects: Subjects of the comparison.
        folder: Folder of the data set.
        manifest: Manifest of the data set.
        workers: Number of processes.
        on_cloud: Function that is called after each cloud.
    """
    entries = manifest.of("validation")
    grid = Forest.from_bytes(subjects.forest).grid
    truth = np.stack(
        [
            label_cells(c.points, nontraversable(c), grid)
            for c in read_clouds(folder, manifest, "validation")
        ]
    )
    kinds = np.array([entry.world for entry in entries])
    results: dict[str, list[Classification]] = {}
    work = partial(classify_cloud, subjects, folder)
    for _, by_subject in run_tasks(work, [entry.file for entry in entries], workers):
        for result in by_subject:
            results.setdefault(result.subject, []).append(result)
        on_cloud()
    return {name: _summary(rows, truth, kinds, grid) for name, rows in results.items()}


def _summary(
    results: list[Classification],
    truth: NDArray[np.uint8],
    kinds: NDArray[np.str_],
    grid: PolarGrid,
) -> Row:
    """Return the scores of one subject.

    Args:
        results: Result on each cloud.
        truth: True ``CellState`` of each cloud's cells, shape (k, n_sectors, n_rings).
        kinds: Preset of each cloud's world, shape (k,).
        grid: Grid of the cells.
    """
    cells = np.stack([result.cells for result in results])
    worlds = {
        str(kind): CellScores.of(truth[kinds == kind], cells[kinds == kind]).f1_red
        for kind in np.unique(kinds)
    }
    summary = CellScores.of(truth, cells).as_dict() | {"worlds": worlds}
    summary["ranges"] = range_errors(truth, cells, grid)
    summary["ms"] = 1e3 * float(np.median([result.seconds for result in results]))
    counted = [result.points for result in results if result.points is not None]
    if counted:
        tp, fp, fn = np.sum(counted, axis=0)
        summary["f1_points"] = float(2 * tp / (2 * tp + fp + fn))
    return summary


def score_rows(scores: Mapping[str, Row]) -> list[Row]:
    """Return one benchmark row for each score of each subject."""
    ours = scores[OURS]
    return [
        benchmark_row(
            name,
            subject,
            figures[name],
            "ms" if name == "ms" else "1",
            sum(figures["confusion"].values()),
            figures[name] / ours[name] if name in ours else None,
        )
        for subject, figures in scores.items()
        for name in ("balanced_accuracy", "f1_red", "recall", "f1_points", "ms")
        if name in figures
    ]


def score_table(scores: Mapping[str, Row]) -> list[Row]:
    """Return the scores of all cells as a table for people, one line a subject."""
    return [
        {
            "subject": subject,
            "bal. accuracy": figures["balanced_accuracy"],
            "F1": figures["f1_red"],
            "recall": figures["recall"],
            "F1 of points": figures.get("f1_points"),
            "ms": f"{figures['ms']:.2f}",
        }
        for subject, figures in scores.items()
    ]


def world_table(scores: Mapping[str, Row]) -> list[Row]:
    """Return F1 by kind of world as a table for people, one line a subject."""
    return [
        {"subject": subject} | dict(sorted(figures["worlds"].items()))
        for subject, figures in scores.items()
    ]
