"""Any cloud to cells and a virtual scan."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.mounting import Mounting
from andabata.records.frames import is_base
from andabata.records.mounting_checks import ground_remarks
from traversability.cloud import PointCloud
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells
from traversability.levelling import ground_plane, levelled, tilt_of
from traversability.scanner import TraversabilityScanner
from traversability.scores import CellScores
from traversability.virtual_scan import VirtualScan, virtual_scan


@dataclass(frozen=True)
class Scanned:
    """A cloud with what was seen in it.

    Attributes:
        cloud: In ``base_footprint``.
        cells: ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).
        scan: The virtual scan.
        grid: The cells' grid.
        ground_tilt: Of the ground within 5 m, before levelling [rad]; None without ground.
        mounted: Whether the cloud came in a frame of its own and the mounting has placed it.
    """

    cloud: PointCloud
    cells: NDArray[np.uint8]
    scan: VirtualScan
    grid: PolarGrid
    ground_tilt: float | None
    mounted: bool = True


class ScanConfig(BaseModel):
    """How a cloud is looked at.

    Attributes:
        mounting: Of the sensor, for clouds in a frame of their own, not in one of the robot's.
        own_body: Returns nearer than this to the sensor are the robot's own [m]; 0 keeps all.
        level: Whether to turn and shift the cloud so that the ground around the robot is the base
            plane, instead of trusting the mounting.
        n_sectors: Sectors; the paper's 32, or more.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    mounting: Mounting = Field(default_factory=Mounting)
    own_body: float = Field(default=0.0, ge=0, le=5)
    level: bool = False
    n_sectors: int = Field(default=32, ge=4, le=360)


MOST_TILT = np.deg2rad(12.0)
"""Ground that tilts more than this around the robot makes one ask whether the cloud is level."""


def scan_cloud(cloud: PointCloud, config: ScanConfig, forest: Forest) -> Scanned:
    """Judge the cells around the robot in a cloud.

    Args:
        cloud: In ``base_footprint``, or of a sensor.
        config: How.
        forest: The cell classifier; its rings are used.

    Raises:
        ValueError: If the cloud cannot be levelled, or nothing of it is left.
    """
    if config.own_body > 0:
        cloud = cloud.select(np.linalg.norm(cloud.points, axis=1) >= config.own_body)
        if not len(cloud):
            raise ValueError(
                f"own_body: expected points beyond {config.own_body} m, got none; lower it"
            )
    mounted = not is_base(cloud.frame)
    if not mounted:
        cloud = replace(cloud, frame="base_footprint")
    else:
        points = config.mounting.place(cloud.points)
        cloud = replace(cloud, points=points, frame="base_footprint")
    plane = ground_plane(cloud.points)
    if config.level:
        if plane is None:
            raise ValueError("level: expected ground within 5 m, got too few points")
        cloud = replace(cloud, points=levelled(cloud.points, plane))
    grid = forest.grid.model_copy(update={"n_sectors": config.n_sectors})
    cells = TraversabilityScanner(forest, grid).cells(cloud.points)
    tilt = None if plane is None else tilt_of(plane[0])
    return Scanned(cloud, cells, virtual_scan(cells, grid), grid, tilt, mounted)


def doubts(scanned: Scanned, config: ScanConfig) -> list[str]:
    """Return what a person should know before trusting a scan."""
    found = []
    tilt = scanned.ground_tilt
    if tilt is not None and tilt > MOST_TILT and not config.level:
        found.append(
            f"the ground around the robot tilts {np.rad2deg(tilt):.0f} degrees; is the cloud "
            "level? (--mounting, --level)"
        )
    if not config.level:
        found += ground_remarks(scanned.cloud.points, config.mounting.z, scanned.mounted)
    if tilt is None:
        found.append("too few points within 5 m to see the ground; is it the right cloud?")
    if np.isnan(scanned.scan.ranges).mean() > 0.5:
        found.append("most sectors hold no judged cell: their ranges are unknown, not free")
    return found


def scan_result(scanned: Scanned) -> dict[str, Any]:
    """Return cells and ranges, ready for JSON; unknown ranges are None, free ones the last ring."""
    ranges = scanned.scan.finite()
    unknown = np.isnan(scanned.scan.ranges)
    cells, tilt = scanned.cells, scanned.ground_tilt
    scores = {}
    if scanned.cloud.nontraversable is not None:
        truth = label_cells(scanned.cloud.points, scanned.cloud.nontraversable, scanned.grid)
        scores["scores"] = CellScores.of(truth, cells).as_dict()
    return scores | {
        "ground_tilt_deg": None if tilt is None else round(float(np.rad2deg(tilt)), 2),
        "points": len(scanned.cloud),
        "ranges": [
            None if lost else round(float(range_), 4)
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
