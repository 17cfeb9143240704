"""Cartesian layers of perception: what clouds show of the ground around the robot, in ``odom``.

Beside the polar cells of the virtual scan the robot keeps finer, square cells, which it updates
with what the laser has measured since the last time.
"""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.mover_perception import MoverPerception
from andabata.navigation.planning.ground_layer import GroundLayer, GroundLayerConfig
from andabata.navigation.planning.low_obstacle_layer import (
    LowObstacleLayer,
    LowObstacleLayerConfig,
)
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ElevationGrid


class CartesianLayers:
    """Ground layer and low obstacle layer, fed by the swaths of a cloud assembler.

    Attributes:
        ground: Log odds of ground cells; None without a classifier.
        low_obstacles: Heights of low obstacles.
        movers: Perception of what moves, whose places are not kept; None keeps all.
    """

    def __init__(
        self,
        assembler: CloudAssembler,
        cells: int,
        cell: float,
        ground: GroundLayerConfig,
        low_obstacles: LowObstacleLayerConfig,
        classifier: GroundClassifier | None,
        movers: MoverPerception | None = None,
    ) -> None:
        """Begin empty.

        Args:
            assembler: Source of the swaths.
            cells: Number of ground cells along an edge of the square.
            cell: Edge of a ground cell [m]; the elevation grid has half of it.
            ground: Settings of the ground layer.
            low_obstacles: Settings of the low obstacle layer.
            classifier: Classifier of ground cells; None leaves them to the virtual scan.
            movers: Perception of what moves, which is fed by others; None for none.

        Raises:
            ValueError: If the classifier knows cells of another size.
        """
        self._assembler = assembler
        self.movers = movers
        self._elevation = ElevationGrid(cell / 2, low_obstacles.cells)
        self.low_obstacles = LowObstacleLayer(cell / 2, low_obstacles)
        self.ground = None if classifier is None else GroundLayer(cells, classifier, ground)
        if self.ground is not None and not math.isclose(cell, self.ground.cell):
            raise ValueError(
                f"local_planner.occupancy.cell: expected {self.ground.cell:g} m, the size of the "
                f"ground cells that the classifier knows, got {cell:g} m; train one for these"
            )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._settled = -np.inf
        self.low_obstacles.reset()
        if self.ground is not None:
            self.ground.reset()

    @property
    def is_measured(self) -> bool:
        """True if anything was taken in since the last reset."""
        return self._settled > -np.inf

    def update(self, position: NDArray[np.float64]) -> None:
        """Take in what was measured since the last time, each place once.

        Args:
            position: Position of the robot in ``odom`` [m], shape (2,).
        """
        window = self._assembler.window
        if window.settled <= self._settled:
            return
        swath = window.since(self._settled)
        self._elevation.describe(swath.points, position, swath.stamps, swath.newest)
        self.low_obstacles.update(self._elevation, position, swath.due)
        if self.ground is not None:
            self.ground.update(self._elevation, position, swath.due)
        self._settled = window.settled
