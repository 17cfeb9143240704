"""From senses to the virtual 2D scan."""

from typing import Protocol

from andabata.localization.localizer import Localizer
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.cloud_assembly import CloudAssembler
from andabata.navigation.controller import SweepWindow
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import VirtualScan


class Perception(Protocol):
    """Whatever tells how far it is free around the robot."""

    @property
    def recent(self) -> SweepWindow | None:
        """What was measured last in every direction; None where there are no clouds."""

    def reset(self) -> None:
        """Forget what was seen."""

    def take(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Take in what the scanner sent."""

    def look(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Return the virtual scan around the current pose, None while there is nothing to see."""


class CloudPerception:
    """Sweeps to levelled cloud to cells to virtual scan (Sanchez et al. 2023, section 3)."""

    def __init__(self, assembler: CloudAssembler, forest: Forest, grid: PolarGrid) -> None:
        self.assembler = assembler
        self._scanner = TraversabilityScanner(forest, grid)

    @property
    def recent(self) -> SweepWindow | None:
        """What the assembler keeps of the last half turn."""
        return self.assembler.recent

    def reset(self) -> None:
        """Forget the clouds."""
        self.assembler.reset()

    def take(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Place the new beams."""
        if readings.sweeps is not None:
            self.assembler.add(readings.sweeps, localizer.track)
        for frame in readings.frames:
            self.assembler.add_frame(frame, localizer.track)

    def look(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Carry the last cloud into the current pose and judge its cells.

        Without a cloud, or with one that is too old because the laser fell silent, there is
        nothing to see.
        """
        if self.assembler.is_stale(stamp):
            return None
        return self._scanner.scan(self.assembler.around(localizer.odometry))


class HorizontalPerception:
    """A horizontal scanner with one beam a sector is its own virtual scan (section 5.1)."""

    def __init__(self, grid: PolarGrid) -> None:
        self._grid = grid
        self.reset()

    @property
    def recent(self) -> SweepWindow | None:
        """None: a scanner in one plane makes no clouds."""
        return None

    def reset(self) -> None:
        """Forget the last scan."""
        self._scan: VirtualScan | None = None

    def take(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Keep the scanner's ranges; a period without any is blind."""
        ranges = readings.horizontal
        self._scan = None if ranges is None else VirtualScan(ranges, self._grid.outer_radius)

    def look(self, stamp: float, localizer: Localizer) -> VirtualScan | None:
        """Return the scanner's ranges as they are."""
        return self._scan


def assembler_of(perception: Perception) -> CloudAssembler | None:
    """Return what puts the clouds together, None with the horizontal scanner."""
    return perception.assembler if isinstance(perception, CloudPerception) else None
