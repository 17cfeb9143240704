"""Scan of any cloud: mounting, levelling, cells and virtual scan."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.mounting import Mounting
from andabata.records.frames.names import is_base
from traversability.class_table import ClassTable
from traversability.cloud import PointCloud
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells
from traversability.levelling import ground_plane, levelled, tilt_of
from traversability.scanner import TraversabilityScanner
from traversability.scores import CellScores
from traversability.two_truths import truth_scores, two_truths
from traversability.virtual_scan import VirtualScan, virtual_scan
from worlds.truth import TruthConfig


@dataclass(frozen=True)
class Scanned:
    """Cloud with its cells and its virtual scan.

    Attributes:
        cloud: Points in ``base_footprint``.
        cells: State of each cell, a ``CellState``, uint8, shape (n_sectors, n_rings).
        scan: The virtual scan.
        grid: Polar grid of the cells.
        ground: Upward unit normal, shape (3,), and height [m] of the ground within 5 m, before
            levelling; None without ground.
        sensor: Position of the sensor in ``base_footprint`` [m], shape (3,); None if the cloud
            came in that frame.
    """

    cloud: PointCloud
    cells: NDArray[np.uint8]
    scan: VirtualScan
    grid: PolarGrid
    ground: tuple[NDArray[np.float64], float] | None = None
    sensor: NDArray[np.float64] | None = None


class ScanConfig(BaseModel):
    """Settings of a scan.

    Attributes:
        mounting: Mounting of the sensor, for clouds in the sensor's own frame.
        own_body: Distance from the sensor [m] below which returns are the robot's own and are left
            out; 0 keeps all.
        level: True to turn and shift the cloud so that the ground around the robot is the base
            plane, instead of relying on the mounting.
        n_sectors: Number of sectors; the paper has 32.
        max_traversable_vegetation: Height up to which the robot drives over plants [m].
        sensor_at: Position of the sensor in the cloud's own coordinates [m], for clouds of a map;
            None if the sensor is their origin.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    mounting: Mounting = Field(default_factory=Mounting)
    own_body: float = Field(default=0.0, ge=0, le=5)
    level: bool = False
    n_sectors: int = Field(default=32, ge=4, le=360)
    max_traversable_vegetation: float = Field(default=0.15, gt=0, le=1)
    sensor_at: tuple[float, float, float] | None = None


def scan_cloud(cloud: PointCloud, config: ScanConfig, forest: Forest) -> Scanned:
    """Classify the cells around the robot in a cloud and make the virtual scan.

    Args:
        cloud: Points in ``base_footprint``, or in the frame of a sensor.
        config: Mounting, levelling and number of sectors.
        forest: Cell classifier; its rings are used.

    Raises:
        ValueError: If the cloud cannot be levelled, or nothing of it is left.
    """
    cloud = _from_the_sensor(cloud, config.sensor_at)
    if config.own_body > 0:
        cloud = cloud.select(np.linalg.norm(cloud.points, axis=1) >= config.own_body)
        if not len(cloud):
            raise ValueError(
                f"own_body: expected points beyond {config.own_body} m, got none; lower it"
            )
    sensor = None
    if is_base(cloud.frame):
        cloud = replace(cloud, frame="base_footprint")
    else:
        mounting = config.mounting
        sensor = np.array([mounting.x, mounting.y, mounting.z])
        points = mounting.place(cloud.points)
        cloud = replace(cloud, points=points, frame="base_footprint")
    plane = ground_plane(cloud.points)
    if config.level:
        if plane is None:
            raise ValueError("level: expected ground within 5 m, got too few points")
        # The robot stands under its sensor, not where the sensor's tilted axis meets the ground.
        cloud = replace(cloud, points=levelled(cloud.points, plane, sensor))
        if sensor is not None:
            over = plane[0] @ (sensor - np.array([0.0, 0.0, plane[1]]))
            sensor = np.array([sensor[0], sensor[1], over])
    grid = forest.grid.model_copy(
        update={
            "n_sectors": config.n_sectors,
            "max_traversable_vegetation": config.max_traversable_vegetation,
        }
    )
    cells = TraversabilityScanner(forest, grid).cells(cloud.points)
    return Scanned(cloud, cells, virtual_scan(cells, grid), grid, plane, sensor)


def _from_the_sensor(cloud: PointCloud, sensor_at: tuple[float, float, float] | None) -> PointCloud:
    """Return the cloud with the sensor as its origin, as far as its position is known."""
    shift = np.zeros(3) if sensor_at is None else np.array(sensor_at)
    if not cloud.origin.any() and not shift.any():
        return cloud
    points = (cloud.coordinates() - shift).astype(np.float32)
    return replace(cloud, points=points, origin=np.zeros(3))


def scan_result(scanned: Scanned, labels: ClassTable | None = None) -> dict[str, Any]:
    """Return cells and ranges, ready for JSON.

    Unknown ranges are None; free ones are the outer radius of the last ring. A labelled cloud is
    scored.

    Args:
        scanned: Cloud with its cells.
        labels: Meaning of the points' classes; None if all points of a labelled cloud are known.
    """
    free_ranges = scanned.scan.ranges
    ranges, unknown = scanned.scan.finite(), np.isnan(free_ranges)
    blocked = free_ranges[np.isfinite(free_ranges)]
    cells, ground = scanned.cells, scanned.ground
    scores = _scores(scanned, labels)
    return scores | {
        "ground_tilt_deg": None if ground is None else _rounded(np.rad2deg(tilt_of(ground[0])), 2),
        "ground_height_m": None if ground is None else _rounded(ground[1], 3),
        "points": len(scanned.cloud),
        "nearest_obstacle_m": _rounded(blocked.min(), 4) if len(blocked) else None,
        "unknown_share": _rounded(unknown.mean(), 4),
        "ranges": [
            None if lost else _rounded(range_, 4)
            for range_, lost in zip(ranges, unknown, strict=True)
        ],
        "cell_states": cells.tolist(),
        "ring_edges_m": scanned.grid.ring_edges.tolist(),
        "cells": {
            "green": int((cells == CellState.TRAVERSABLE).sum()),
            "red": int((cells == CellState.NON_TRAVERSABLE).sum()),
            "white": int((cells == CellState.EMPTY).sum()),
        },
    }


def _scores(scanned: Scanned, labels: ClassTable | None) -> dict[str, Any]:
    """Return the scores of the cells of a labelled cloud by both truths; empty without labels."""
    cloud, cells, grid = scanned.cloud, scanned.cells, scanned.grid
    if cloud.nontraversable is None:
        return {}
    known, bad = np.ones(len(cloud), dtype=np.bool_), cloud.nontraversable
    if labels is not None and cloud.classes is not None:
        bad, known, _ = labels.judge(cloud.classes)
    truths = two_truths(cloud.points, bad, known, grid, TruthConfig().max_step)
    truth = label_cells(cloud.points[known], bad[known], grid) if labels is None else truths.first
    return {
        "scores": CellScores.of(truth, cells).as_dict(),
        "truths": truth_scores(truths.first, truths.second, cells),
    }


def _rounded(number: float | np.floating, digits: int) -> float:
    """Return a rounded number for JSON."""
    return round(float(number), digits)
