"""Beams of a laser that show what moves: some of them, placed in ``odom``, with their origin.

A turning laser's plane has a thousand beams, most of which go to the ground or the sky, and a 3D
laser's cloud has more points than a body needs: some of them are enough.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.beams import BeamTables, place_beams, place_points
from andabata.machine.pose import PoseTrack
from andabata.machine.sensor_readings import Sweeps
from andabata.navigation.free_space_grid import Rays
from andabata.navigation.silent_rows import SilentRows
from traversability.cloud import PointCloud


class LookConfig(BaseModel):
    """Beams that count, all of it assumptions.

    Attributes:
        elevations_deg: Lowest and highest elevation of a turning laser's beams [deg].
        beam_stride: Number of a turning laser's beams of which one counts.
        max_points: Largest number of points of a 3D laser's cloud.
        free_range: Range that a beam without a return has passed [m].
        silent_elevations_deg: Lowest and highest elevation of a 3D laser's beams without a return
            that count [deg].
        silent_interval: Number of clouds of which one is searched for such beams; it takes longer
            than all the rest.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    elevations_deg: tuple[float, float] = (-35.0, 55.0)
    beam_stride: int = Field(default=2, ge=1)
    max_points: int = Field(default=3000, ge=100)
    free_range: float = Field(default=8.0, gt=0)
    silent_elevations_deg: tuple[float, float] = (-10.0, 12.0)
    silent_interval: int = Field(default=5, ge=1)


class LookRays:
    """Selects and places beams.

    Attributes:
        config: Settings.
    """

    def __init__(
        self, config: LookConfig, lidar_height: float, rows_deg: tuple[float, ...] = ()
    ) -> None:
        """Begin.

        Args:
            config: Settings.
            lidar_height: Height of the optical centre above ``base_footprint`` [m].
            rows_deg: Elevations of a 3D laser's rows, increasing [deg]; none if they are unknown,
                and then no beam without a return counts.
        """
        self.config = config
        self._height = lidar_height
        self._silent = None
        if len(rows_deg) > 1:
            self._silent = SilentRows(rows_deg, config.silent_elevations_deg)
        self._frames = 0
        self._tables = BeamTables()
        self._elevations: NDArray[np.float32] | None = None
        self._chosen = np.empty(0, dtype=np.int64)
        self._phase = 0

    def of_sweeps(self, sweeps: Sweeps, track: PoseTrack) -> Rays | None:
        """Return beams of sweeps, None without any; the beams of a sweep are one look.

        Args:
            sweeps: Sweeps of a turning laser.
            track: Estimated poses in ``odom`` by stamp.
        """
        if not len(sweeps.stamps):
            return None
        chosen = self._beams(sweeps.elevations)
        first = np.arange(len(sweeps.stamps)) * sweeps.ranges.shape[1]
        rows = (first[:, None] + chosen).ravel()
        is_return = np.isfinite(sweeps.ranges.ravel()[rows])
        # What met nothing passed all that is near.
        ranges = np.where(np.isfinite(sweeps.ranges), sweeps.ranges, self.config.free_range)
        full = replace(sweeps, ranges=ranges.astype(np.float32))
        ends, _ = place_beams(full, track, self._height, self._tables, rows)
        # A beam of no length ends where it begins, wherever the head is mounted.
        still = replace(sweeps, ranges=np.zeros_like(sweeps.ranges))
        middle = first[len(first) // 2 :][:1]
        origins, _ = place_beams(still, track, self._height, self._tables, middle)
        stamps = np.repeat(sweeps.stamps, len(chosen))
        return Rays(origins[0].astype(np.float64), ends, stamps, is_return)

    def _beams(self, elevations: NDArray[np.float32]) -> NDArray[np.int64]:
        """Return the numbers of the beams of a sweep that count, shape (k,)."""
        if self._elevations is not elevations:
            low, high = self.config.elevations_deg
            over = 90.0 - np.degrees(np.abs(np.atleast_2d(elevations)[0]))
            self._chosen = np.flatnonzero((over >= low) & (over <= high))[
                :: self.config.beam_stride
            ]
            self._elevations = elevations
        return self._chosen

    def of_frame(self, frame: PointCloud, track: PoseTrack) -> Rays | None:
        """Return points of a 3D laser's cloud, others each time, None without any; one look.

        Beams without a return are not in a cloud: of a laser whose rows are known they are where
        it has none.

        Args:
            frame: Points with times, as in ``SensorReadings.frames``.
            track: Estimated poses in ``odom`` by stamp.
        """
        stride = max(1, -(-len(frame.points) // self.config.max_points))
        self._phase = (self._phase + 1) % stride
        mask = np.zeros(len(frame.points), dtype=np.bool_)
        mask[self._phase :: stride] = True
        chosen = frame.select(mask)
        if chosen.stamps is None or not len(chosen.points):
            return None
        ends = place_points(chosen, track, self._height)
        middle = float(chosen.stamps.mean())
        origin = track.at(np.array([middle]))[0, :3] + [0.0, 0.0, self._height]
        is_return = np.ones(len(ends), dtype=np.bool_)
        self._frames += 1
        if self._silent is not None and self._frames % self.config.silent_interval == 0:
            silent = self._silent.ends(frame, self._height, self.config.free_range)
            ends = np.concatenate([ends, place_points(silent, track, self._height)])
            is_return = np.concatenate([is_return, np.zeros(len(silent), dtype=np.bool_)])
        return Rays(origin, ends, np.full(len(ends), middle), is_return)
