"""The rotating 2D laser and stage 1's horizontal scanner, cast against a world's ray scene."""

from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.machine.beams import BeamTables, beam_rays
from andabata.machine.counter_rng import normal, uniform
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import Sweeps
from terrain.classes import TRAITS
from terrain.kernel import inlined_kernel, kernel
from traversability.grid import PolarGrid
from worlds.ray_walk import NO_CLASS
from worlds.rays import RayScene

_RETURNS = np.ones(256, dtype=np.float32)
for _semantic, _traits in TRAITS.items():
    _RETURNS[_semantic] = _traits.returns


class LidarConfig(BaseModel):
    """A 2D laser of the UTM-30LX class in a vertical plane on a turning head.

    A spinning laser of several beams is the same thing: each column is a vertical sweep whose beams
    leave at once.

    Attributes:
        beams: Beams of a sweep (paper's sensor: 1081).
        span_deg: Lowest and highest beam over the horizon [deg], all on one side, all at the same
            time, for a laser of several beams; None for a 2D laser that sees both sides.
        elevations_deg: Elevation of each beam over the horizon [deg], growing, instead of
            ``span_deg``, for a laser whose beams are unevenly spaced.
        weave: For a rosette: cycles down and up through ``span_deg`` from shot to shot; the shots
            of a sweep then leave one after the other. 0 for fixed rows.
        field_of_view: Angle that a sweep covers; the gap faces down [rad].
        sweep_hz: Sweeps per second [Hz].
        head_rate: Turning speed of the head [rad/s]; half a turn makes a cloud. The default needs
            133 sweeps for it, the paper's 3.33 s.
        min_range: Nearer things give no return [m].
        max_range: Further things give no return [m].
        noise: Standard deviation of the range [m].
        dropout: Probability that a return is lost (assumption).
        edge_step: Neighbouring beams whose ranges differ by more than this meet an edge [m]
            (assumption). Neighbours are so close that their spots touch: the next beam of a 2D
            laser, the same beam in the next column of a laser of several beams, whose rows lie
            degrees apart. A rosette's shots have none.
        mixed: Probability that the far beam at an edge falls between the two ranges (assumption).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    beams: int = Field(default=1081, ge=11, le=10_000)
    span_deg: tuple[float, float] | None = None
    elevations_deg: tuple[float, ...] | None = None
    weave: float = Field(default=0.0, ge=0, lt=0.5)
    field_of_view: float = Field(default=np.deg2rad(270.0), gt=0, le=2 * np.pi)
    sweep_hz: float = Field(default=40.0, gt=0, le=100_000)
    head_rate: float = Field(default=np.pi * 40.0 / 133.0, gt=0, le=1000)
    min_range: float = Field(default=0.1, ge=0)
    max_range: float = Field(default=30.0, gt=0)
    noise: float = Field(default=0.03, ge=0, le=1)
    dropout: float = Field(default=0.005, ge=0, le=1)
    edge_step: float = Field(default=0.3, gt=0)
    mixed: float = Field(default=0.1, ge=0, le=1)

    @model_validator(mode="after")
    def _check_table(self) -> Self:
        """Refuse a table that is not one elevation a beam, in order."""
        table = self.elevations_deg
        if table is None:
            return self
        if self.span_deg is not None or self.weave:
            raise ValueError("elevations_deg: expected no span_deg and no weave beside it, got one")
        growing = all(low < high for low, high in pairwise(table))
        if len(table) != self.beams or not growing or table[0] < -90 or table[-1] > 90:
            raise ValueError(
                f"elevations_deg: expected {self.beams} growing angles from -90 to 90 degrees, one "
                f"for each of the beams, got {len(table)}"
            )
        return self

    @property
    def is_multibeam(self) -> bool:
        """Whether a sweep is a column of beams on one side, as of a spinning 3D laser."""
        return self.span_deg is not None or self.elevations_deg is not None

    @property
    def neighbour_stride(self) -> int:
        """Number of beams from one to the next beside it, counted through all sweeps; 0 is none."""
        if self.weave:
            return 0
        return self.beams if self.is_multibeam else 1

    @property
    def beam_period(self) -> float:
        """Time from beam to beam [s]: a turn of a 2D laser's mirror is a sweep period."""
        if self.is_multibeam:
            return 1 / (self.sweep_hz * self.beams) if self.weave else 0.0
        return _as_recorded(self.field_of_view / (2 * np.pi) / self.sweep_hz / (self.beams - 1))

    def elevations(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the angle of beams from straight up, negative on the other side [rad].

        Args:
            first: Number of the first sweep since the start.
            last: Number after the last one.

        Returns:
            float32, shape (b,), or (last - first, b) for a rosette.
        """
        if self.span_deg is not None and self.weave:
            low, high = self.span_deg
            shots = np.arange(first * self.beams, last * self.beams, dtype=np.float64)
            share = np.abs(2 * (shots * self.weave % 1) - 1)
            angles = np.deg2rad(90.0 - (low + share * (high - low)))
            return angles.reshape(-1, self.beams).astype(np.float32)
        if self.elevations_deg is not None:
            return np.deg2rad(90.0 - np.array(self.elevations_deg)).astype(np.float32)
        if self.span_deg is not None:
            return np.deg2rad(90.0 - np.linspace(*self.span_deg, self.beams)).astype(np.float32)
        half = _as_recorded(self.field_of_view / 2)
        return np.linspace(-half, half, self.beams).astype(np.float32)


def _as_recorded(number: float) -> float:
    """Return a number as a LaserScan holds it: a record then tells the very same beams."""
    return float(np.float32(number))


class RotatingLidar:
    """Sweeps of the vertical laser; each beam leaves from the pose of its own instant."""

    def __init__(
        self,
        scene: RayScene,
        config: LidarConfig,
        robot: RobotModel,
        rng: np.random.Generator,
        reach: float = np.inf,
    ) -> None:
        """Mount the laser.

        Args:
            scene: What the beams meet.
            config: The laser.
            robot: Height of the optical centre.
            rng: Noise, dropouts and porous things.
            reach: Nobody looks at returns further away [m], so that they need not be right. Nearer
                ones are the same to the bit.
        """
        self._scene = scene
        self._reach = reach
        self._config = config
        self._height = robot.lidar_height
        self._rng = rng
        self._elevations = config.elevations(0, 1)  # Those of every sweep, but for a rosette.
        self._tables = BeamTables()
        self._budgets = np.empty(0, dtype=np.float32)

    def sweeps(self, start: float, end: float, track: PoseTrack) -> Sweeps:
        """Return the sweeps that begin in a time span.

        Args:
            start: Begin of the span [s].
            end: End of the span, not included [s]; the track must reach to the last beam.
            track: Where the robot is when.
        """
        config = self._config
        first = int(np.ceil(start * config.sweep_hz - 1e-6))
        last = int(np.ceil(end * config.sweep_hz - 1e-6))
        stamps = np.arange(first, last) / config.sweep_hz
        elevations = config.elevations(first, last) if config.weave else self._elevations
        empty = Sweeps(
            stamps=stamps,
            head_angles=stamps * config.head_rate,
            head_rate=config.head_rate,
            beam_period=config.beam_period,
            elevations=elevations,
            ranges=np.full((len(stamps), config.beams), np.inf, dtype=np.float32),
        )
        rays = beam_rays(empty, track, self._height, self._tables)
        shape, key = empty.ranges.shape, np.uint64(self._rng.integers(2**63))
        true, classes = self._cast(rays, key)
        ranges = _measured(
            true.reshape(shape),
            classes.reshape(shape),
            key,
            _RETURNS,
            np.array([config.noise, config.dropout, config.edge_step, config.mixed]),
            np.array([config.min_range, config.max_range]),
            config.neighbour_stride,
        )
        return Sweeps(
            stamps=stamps,
            head_angles=empty.head_angles,
            head_rate=config.head_rate,
            beam_period=config.beam_period,
            elevations=elevations,
            ranges=ranges,
            classes=classes.reshape(shape),
        )

    def _cast(
        self, rays: NDArray[np.float32], key: np.uint64
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return true ranges [m] and classes; beyond ``reach`` only of beams that may be mixed.

        A mixed pixel lies between a near surface and the one behind it, however far. Everything
        else beyond is nobody's business, and most of the world needs no looking at.
        """
        if len(self._budgets) < len(rays):
            self._budgets = np.empty(len(rays), dtype=np.float32)
        budgets = self._budgets[: len(rays)]
        self._rng.standard_exponential(dtype=np.float32, out=budgets)
        ranges, classes = self._scene.cast(rays, budgets, self._reach)
        stride = self._config.neighbour_stride
        if np.isfinite(self._reach) and stride:
            row = self._config.beams if stride == 1 else len(ranges)
            beside = _maybe_mixed(ranges, row, stride, key, self._config.mixed)
            if len(beside):
                far = self._scene.cast(rays[beside], budgets[beside])
                ranges[beside], classes[beside] = far
        return ranges, classes


@inlined_kernel
def _mix(key, beam):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return a beam's draw of where between two surfaces it may fall."""
    return uniform(key, np.uint64(3) * np.uint64(beam))


@kernel
def _maybe_mixed(ranges, row, stride, key, mixed):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the beams that met nothing, draw a mixed pixel and have a neighbour that did not.

    Neighbours lie ``stride`` beams apart in the same row, which is a 2D laser's sweep.
    """
    found = np.empty(len(ranges), dtype=np.int64)
    count = 0
    for first in range(0, len(ranges), row):
        last = first + row - 1
        for k in range(first, last + 1):
            if np.isfinite(ranges[k]):
                continue
            before = k - stride >= first and np.isfinite(ranges[k - stride])
            after = k + stride <= last and np.isfinite(ranges[k + stride])
            if (before or after) and _mix(key, k) < mixed:
                found[count] = k
                count += 1
    return found[:count]


@kernel
def _measured(true, classes, key, returns, faults, bounds, stride):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return what the laser reads: noise, dropouts and mixed pixels; ``inf`` is no return.

    A lost return loses its class; a mixed pixel keeps that of the surface behind. Each beam has its
    own draws, so that what one meets changes nothing for the others.
    """
    noise, dropout, edge, mixed = faults
    ranges = np.empty(true.shape, dtype=np.float32)
    last = true.shape[1] - 1
    sweeps, beams = true.shape[0] - 1, true.shape[1]
    for i in range(true.shape[0]):
        for j in range(true.shape[1]):
            here = true[i, j]
            if not np.isfinite(here):
                ranges[i, j], classes[i, j] = np.inf, NO_CLASS
                continue
            beam = i * beams + j
            number = np.uint64(3) * np.uint64(beam)
            near = here
            if stride == 1:
                near = min(true[i, max(j - 1, 0)], true[i, min(j + 1, last)])
            elif stride == beams:
                near = min(true[max(i - 1, 0), j], true[min(i + 1, sweeps), j])
            measured = np.float64(here)
            if here - near > edge:
                mix = _mix(key, beam)
                if mix < mixed:
                    measured = near + mix / mixed * (here - near)
            measured += noise * normal(uniform(key, number + np.uint64(1)))
            keep = uniform(key, number + np.uint64(2))
            lost = keep >= (1 - dropout) * returns[classes[i, j]]
            if lost or not bounds[0] <= measured <= bounds[1]:
                ranges[i, j], classes[i, j] = np.inf, NO_CLASS
            else:
                ranges[i, j] = measured
    return ranges


class HorizontalScanner:
    """A horizontal 2D scanner with one beam for each sector of the grid (section 5.1)."""

    def __init__(
        self, scene: RayScene, grid: PolarGrid, robot: RobotModel, rng: np.random.Generator
    ) -> None:
        """Mount the scanner at the height of the laser's optical centre."""
        self._scene = scene
        self._bearings = grid.bearings
        self._max_range = grid.outer_radius
        self._height = robot.lidar_height
        self._rng = rng
        self._rays = np.zeros((grid.n_sectors, 6), dtype=np.float32)

    def ranges(self, pose: Pose) -> NDArray[np.float32]:
        """Return the ranges [m], shape (n_sectors,), ``inf`` where nothing is within the grid."""
        self._rays[:, :3] = pose.position
        self._rays[:, 2] += self._height
        self._rays[:, 3] = np.cos(self._bearings + pose.yaw)
        self._rays[:, 4] = np.sin(self._bearings + pose.yaw)
        budgets = self._rng.standard_exponential(len(self._rays), dtype=np.float32)
        return self._scene.cast(self._rays, budgets, self._max_range)[0]
