"""Any cloud to cells and a virtual scan."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from traversability.cloud import PointCloud
from traversability.forest import Forest
from traversability.labels import CellState
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import VirtualScan, virtual_scan


class Mounting(BaseModel):
    """How the sensor sits on the robot: sensor coordinates to ``base_footprint``.

    Attributes:
        x: Forward of the base [m].
        y: Left of the base [m].
        z: Above the base plane [m].
        roll: About x [rad].
        pitch: About y [rad].
        yaw: About z [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    x: float = Field(default=0.0, ge=-10, le=10)
    y: float = Field(default=0.0, ge=-10, le=10)
    z: float = Field(default=0.72, ge=0, le=10)
    roll: float = Field(default=0.0, ge=-np.pi, le=np.pi)
    pitch: float = Field(default=0.0, ge=-np.pi, le=np.pi)
    yaw: float = Field(default=0.0, ge=-np.pi, le=np.pi)

    def place(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return sensor points in ``base_footprint`` [m], shape (n, 3)."""
        turn = Rotation.from_euler("ZYX", [self.yaw, self.pitch, self.roll])
        R_base_sensor = turn.as_matrix().astype(np.float32)
        shift = np.array([self.x, self.y, self.z], dtype=np.float32)
        return points @ R_base_sensor.T + shift


@dataclass(frozen=True)
class Scanned:
    """A cloud with what was seen in it.

    Attributes:
        cloud: In ``base_footprint``.
        cells: ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).
        scan: The virtual scan.
    """

    cloud: PointCloud
    cells: NDArray[np.uint8]
    scan: VirtualScan


def scan_cloud(cloud: PointCloud, mounting: Mounting, forest: Forest) -> Scanned:
    """Judge the cells around the robot in a cloud.

    Args:
        cloud: In ``base_footprint``, or of a sensor.
        mounting: Of the sensor.
        forest: The cell classifier; its grid is used.
    """
    if cloud.frame != "base_footprint":
        cloud = PointCloud(mounting.place(cloud.points), "base_footprint")
    cells = TraversabilityScanner(forest).cells(cloud.points)
    return Scanned(cloud, cells, virtual_scan(cells, forest.grid))


def scan_result(scanned: Scanned, forest: Forest) -> dict[str, Any]:
    """Return cells and ranges, ready for JSON; unknown ranges are None, free ones the last ring."""
    ranges = scanned.scan.finite()
    unknown = np.isnan(scanned.scan.ranges)
    cells = scanned.cells
    return {
        "points": len(scanned.cloud),
        "ranges": [
            None if lost else round(float(range_), 4)
            for range_, lost in zip(ranges, unknown, strict=True)
        ],
        "cell_states": cells.tolist(),
        "ring_edges_m": forest.grid.ring_edges.tolist(),
        "cells": {
            "green": int((cells == CellState.TRAVERSABLE).sum()),
            "red": int((cells == CellState.NON_TRAVERSABLE).sum()),
            "white": int((cells == CellState.EMPTY).sum()),
        },
    }
