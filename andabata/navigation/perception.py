"""From sensor readings to the virtual 2D scan and the Cartesian layers."""

from typing import Protocol

from andabata.localization.localizer import Localizer
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.mover_perception import MoverPerception
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import VirtualScan


class Perception(Protocol):
    """Estimates the free distance around the robot."""

    @property
    def layers(self) -> CartesianLayers | None:
        """Layers of the ground around the robot; None without clouds."""

    def reset(self) -> None:
        """Forget what was seen."""

    def update(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Take in what the scanner sent."""

    def scan(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Return the virtual scan around the current pose, None while there is nothing to see."""


class CloudPerception:
    """Sweeps to levelled cloud to cells to virtual scan (Sanchez et al. 2023, section 3).

    Attributes:
        assembler: Assembler of the clouds.
        movers: Perception of what moves, or None.
    """

    def __init__(
        self,
        assembler: CloudAssembler,
        forest: Forest,
        grid: PolarGrid,
        layers: CartesianLayers | None = None,
        movers: MoverPerception | None = None,
    ) -> None:
        """Put the parts together.

        Args:
            assembler: Assembler of the clouds.
            forest: Classifier of polar cells.
            grid: Polar grid.
            layers: Layers of the ground, fed by the same assembler; None without a planner.
            movers: Perception of what moves; None leaves it out.
        """
        self.assembler = assembler
        self.movers = movers
        self._layers = layers
        self._scanner = TraversabilityScanner(forest, grid)

    @property
    def layers(self) -> CartesianLayers | None:
        """Layers of the ground around the robot; None without a planner."""
        return self._layers

    def reset(self) -> None:
        """Forget the clouds."""
        self.assembler.reset()
        if self._layers is not None:
            self._layers.reset()
        if self.movers is not None:
            self.movers.reset()

    def update(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Place the new beams with the poses of their own instants."""
        if readings.sweeps is not None:
            self.assembler.add(readings.sweeps, localizer.track)
        for frame in readings.frames:
            self.assembler.add_frame(frame, localizer.track)
        if self.movers is not None:
            self.movers.update(readings, localizer.track)

    def scan(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Move the last cloud into the current pose and classify its cells.

        Without a cloud, or with one that is too old because the laser fell silent, there is
        nothing to see.
        """
        if self.assembler.is_stale(stamp):
            return None
        return self._scanner.scan(self.assembler.around(localizer.odometry))


class HorizontalPerception:
    """A horizontal scanner with one beam a sector is its own virtual scan (section 5.1)."""

    def __init__(self, grid: PolarGrid) -> None:
        """Take the polar grid, whose outer radius is the largest range."""
        self._grid = grid
        self.reset()

    @property
    def layers(self) -> CartesianLayers | None:
        """None: a scanner in one plane makes no clouds."""
        return None

    def reset(self) -> None:
        """Forget the last scan."""
        self._scan: VirtualScan | None = None

    def update(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Keep the scanner's ranges; after a period without any there is nothing to see."""
        ranges = readings.horizontal
        self._scan = None if ranges is None else VirtualScan(ranges, self._grid.outer_radius)

    def scan(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Return the scanner's ranges as they are."""
        return self._scan


def assembler_of(perception: Perception) -> CloudAssembler | None:
    """Return the assembler of the clouds, None with the horizontal scanner."""
    return perception.assembler if isinstance(perception, CloudPerception) else None
