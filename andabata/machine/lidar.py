"""Rotating 2D laser and horizontal scanner of stage 1, cast against a world's ray scene."""

import math
from dataclasses import replace
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.machine.beam_rays import beam_rays
from andabata.machine.beams import BeamTables
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.ranging import measure_beams
from andabata.machine.reality import AS_BELIEVED, TrueConstants
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import Sweeps
from traversability.grid import PolarGrid
from worlds.rays.scene import RayScene
from worlds.walking import Walkers, cover_rays


class LidarConfig(BaseModel):
    """Parameters of a 2D laser of the UTM-30LX class in a vertical plane on a rotating head.

    A spinning multi-beam laser is a special case: each column is a vertical sweep whose beams are
    emitted at once.

    Attributes:
        beams: Number of beams of a sweep (paper's sensor: 1081).
        span_deg: Elevations of the lowest and the highest beam of a multi-beam laser [deg], all on
            one side and emitted at once; None for a 2D laser that scans both sides.
        elevations_deg: Elevations of all beams [deg], increasing, instead of ``span_deg``, for a
            multi-beam laser whose beams are unevenly spaced.
        weave: Number of cycles down and up through ``span_deg`` from shot to shot of a rosette,
            whose shots are emitted one after the other; 0 for fixed rows.
        field_of_view: Angle that a sweep covers [rad]; the rest faces down.
        sweep_hz: Number of sweeps per second [Hz].
        head_rate: Angular speed of the head [rad/s]; half a turn makes a cloud. The default takes
            133 sweeps, the paper's 3.33 s.
        min_range: Range below which there is no return [m].
        max_range: Range beyond which there is no return [m].
        noise: Standard deviation of the range [m].
        dropout: Probability that a return is lost (assumption).
        edge_step: Difference in range of neighbouring beams from which there is an edge between
            them [m] (assumption). The spots of neighbours touch: the next beam of a 2D laser, the
            same beam in the next column of a multi-beam laser, whose rows lie degrees apart. The
            shots of a rosette have no neighbours.
        mixed: Probability of a mixed pixel: the far beam at an edge falls between the two ranges
            (assumption).
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
        """Refuse a table other than one elevation per beam, in increasing order."""
        table = self.elevations_deg
        if table is None:
            return self
        if self.span_deg is not None or self.weave:
            raise ValueError("elevations_deg: expected no span_deg and no weave beside it, got one")
        increasing = all(low < high for low, high in pairwise(table))
        if len(table) != self.beams or not increasing or table[0] < -90 or table[-1] > 90:
            raise ValueError(
                f"elevations_deg: expected {self.beams} increasing angles from -90 to 90 degrees, "
                f"one per beam, got {len(table)}"
            )
        return self

    @property
    def is_multibeam(self) -> bool:
        """True if a sweep is a column of beams on one side, as of a spinning 3D laser."""
        return self.span_deg is not None or self.elevations_deg is not None

    @property
    def rows_deg(self) -> tuple[float, ...]:
        """Elevations of a multi-beam laser's rows, increasing [deg]; none of one without rows."""
        if self.elevations_deg is not None:
            return self.elevations_deg
        if self.span_deg is None or self.weave:
            return ()
        return tuple(np.linspace(*self.span_deg, self.beams).tolist())

    @property
    def neighbour_stride(self) -> int:
        """Number of beams from one to its neighbour, counted through all sweeps; 0 without any."""
        if self.weave:
            return 0
        return self.beams if self.is_multibeam else 1

    @property
    def beam_period(self) -> float:
        """Time from beam to beam [s]; a 2D laser's mirror turns once per sweep."""
        if self.is_multibeam:
            return 1 / (self.sweep_hz * self.beams) if self.weave else 0.0
        return _as_recorded(self.field_of_view / (2 * np.pi) / self.sweep_hz / (self.beams - 1))

    def elevations(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the angles of the beams from the zenith [rad], negative on the other side.

        Args:
            first: Number of the first sweep since the start.
            last: Number after the last one.

        Returns:
            Angles, float32, shape (b,), or (last - first, b) for a rosette.
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
    """Return a number as a LaserScan holds it, in float32, so that a record has the same beams."""
    return float(np.float32(number))


class RotatingLidar:
    """Model of the vertical laser; each beam is cast from the pose of its own instant."""

    def __init__(
        self,
        scene: RayScene,
        config: LidarConfig,
        robot: RobotModel,
        rng: np.random.Generator,
        reach: float = np.inf,
        walkers: Walkers | None = None,
    ) -> None:
        """Mount the laser.

        Args:
            scene: Ray scene of the world.
            config: Parameters of the laser.
            robot: Parameters of the body, for the height of the optical centre.
            rng: Source of noise, dropouts and returns of porous objects.
            reach: Range up to which returns have to be right [m]; returns within it are the same,
                bit for bit, whatever the reach.
            walkers: Walkers of the world; None without any.
        """
        self._scene, self._walkers = scene, walkers
        self._reach = reach
        self._config, self._robot = config, robot
        self._rng = rng
        self._elevations = config.elevations(0, 1)  # The same for every sweep, except of a rosette.
        self._beam_period, self._stride = config.beam_period, config.neighbour_stride
        self._tables = BeamTables()
        self.reset(AS_BELIEVED)

    def reset(self, constants: TrueConstants) -> None:
        """Begin a drive.

        Args:
            constants: True constants of the drive; their seed is that of the sweeps' errors.
        """
        config = self._config
        self._height = self._robot.lidar_height + constants.laser_height
        noise = math.hypot(config.noise, constants.range_noise)
        errors = [noise, config.dropout, config.edge_step, config.mixed]
        self._errors = np.array([*errors, config.min_range, config.max_range])
        self._clock, self._scale = constants.laser_clock, 1 + constants.range_scale
        self._bias = constants.range_bias
        self._bias_rng = np.random.default_rng([constants.seed, 1])

    def sweeps(self, start: float, end: float, track: PoseTrack) -> Sweeps:
        """Return the sweeps that begin in a time span.

        Args:
            start: Begin of the span [s].
            end: End of the span, not included [s]; the track must reach to the last beam.
            track: True poses of the robot over time.
        """
        config = self._config
        first = math.ceil(start * config.sweep_hz - 1e-6)
        last = math.ceil(end * config.sweep_hz - 1e-6)
        stamps = np.arange(first, last) / config.sweep_hz
        ranges = np.empty((len(stamps), config.beams), dtype=np.float32)
        classes = np.empty(ranges.shape, dtype=np.uint8)
        sweeps = Sweeps(
            stamps=stamps,
            head_angles=stamps * config.head_rate,
            head_rate=config.head_rate,
            beam_period=self._beam_period,
            elevations=config.elevations(first, last) if config.weave else self._elevations,
            ranges=ranges,
            classes=classes,
        )
        # Late stamps: the beams left earlier than the robot believes.
        left = replace(sweeps, stamps=stamps - self._clock)
        rays, times = beam_rays(left, track, self._height, self._tables)
        key = np.uint64(self._rng.integers(2**63))
        measure_beams(
            rays,
            times,
            self._rng.standard_exponential(len(rays), dtype=np.float32),
            self._scene.layout,
            None if self._walkers is None else self._walkers.track,
            self._reach,
            key,
            self._errors,
            self._stride,
            ranges,
            classes,
        )
        if self._scale != 1 or self._bias:
            ranges *= np.float32(self._scale)
            bias = self._bias * self._bias_rng.standard_normal((len(stamps), 1))
            ranges += bias.astype(np.float32)
        return sweeps


class HorizontalScanner:
    """Horizontal 2D scanner with one beam per sector of the grid (section 5.1)."""

    def __init__(
        self,
        scene: RayScene,
        grid: PolarGrid,
        robot: RobotModel,
        rng: np.random.Generator,
        walkers: Walkers | None = None,
    ) -> None:
        """Mount the scanner at the height of the laser's optical centre.

        Args:
            scene: Ray scene of the world.
            grid: Polar grid whose sectors the beams point along.
            robot: Parameters of the body, for the height of the optical centre.
            rng: Source of returns of porous objects.
            walkers: Walkers of the world; None without any.
        """
        self._scene, self._walkers = scene, walkers
        self._bearings = grid.bearings
        self._max_range = grid.outer_radius
        self._height = robot.lidar_height
        self._rng = rng
        self._rays = np.zeros((grid.n_sectors, 6), dtype=np.float32)

    def ranges(self, pose: Pose) -> NDArray[np.float32]:
        """Return the ranges at a pose [m], shape (n_sectors,).

        Args:
            pose: True pose of the robot.

        Returns:
            Ranges [m], float32; ``inf`` is no return within the grid.
        """
        self._rays[:, :3] = pose.position
        self._rays[:, 2] += self._height
        self._rays[:, 3] = np.cos(self._bearings + pose.yaw)
        self._rays[:, 4] = np.sin(self._bearings + pose.yaw)
        budgets = self._rng.standard_exponential(len(self._rays), dtype=np.float32)
        ranges, classes = self._scene.cast(self._rays, budgets, self._max_range)
        if self._walkers is not None:
            track = self._walkers.track
            times = np.full(len(ranges), track.latest)
            cover_rays(self._rays, times, track, self._max_range, ranges, classes)
        return ranges
