"""Satellite receiver: fixes once a second, late, with white, slow and multipath errors."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from andabata.machine.clock import TICK
from andabata.machine.geo_reference import GeoReference
from andabata.machine.reality import TrueConstants
from terrain.classes import SemanticClass
from terrain.objects import SceneObject

_CANOPY = (SemanticClass.TRUNK, SemanticClass.FOLIAGE)
"""Classes of objects that shade the satellite receiver."""

_STAMP, _POSITION, _QUATERNION = 0, 1, 4
"""First columns of a row of the true track: stamp [s], x, y, z [m], quaternion x, y, z, w."""


class GnssConfig(BaseModel):
    """Satellite receiver with one fix per second (paper: 1 m of horizontal resolution).

    The metre is split, by assumption, into white noise and a time-correlated error (first-order
    Gauss-Markov). Near trees signals are lost or arrive by multipath.

    Attributes:
        noise: White noise of each horizontal axis [m].
        correlated_error: Standard deviation of each axis of the time-correlated error [m].
        correlation_time: Correlation time of that error [s].
        vertical_ratio: Ratio of vertical to horizontal noise.
        latency: Time from the instant of a fix to its arrival [s].
        dropout: Probability that a fix is lost, in the open; the receiver then reports none.
        multipath_rate: Probability per second that multipath begins, in the open.
        multipath_error: Standard deviation of each axis of the error by multipath [m].
        multipath_time: Mean duration of multipath [s].
        canopy_factor: Factor on both probabilities within ``canopy_range`` of a tree.
        canopy_range: Distance from a tree up to which it shades the receiver [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    noise: float = Field(default=0.66, ge=0)
    correlated_error: float = Field(default=0.25, ge=0)
    correlation_time: float = Field(default=60.0, gt=0)
    vertical_ratio: float = Field(default=2.0, ge=0)
    latency: float = Field(default=0.15, ge=0, lt=1)
    dropout: float = Field(default=0.01, ge=0, le=1)
    multipath_rate: float = Field(default=0.005, ge=0, le=1)
    multipath_error: float = Field(default=6.0, ge=0)
    multipath_time: float = Field(default=4.0, ge=1)
    canopy_factor: float = Field(default=6.0, ge=1)
    canopy_range: float = Field(default=3.0, ge=0)


class GnssReceiver:
    """Satellite receiver of one robot in one world."""

    def __init__(
        self, config: GnssConfig, geo_reference: GeoReference, objects: Sequence[SceneObject]
    ) -> None:
        """Mount the receiver.

        Args:
            config: Errors of the receiver.
            geo_reference: Datum of the map.
            objects: Objects of the world; its trees shade the receiver.
        """
        self._config, self._geo_reference = config, geo_reference
        trees = [o.vertices[:, :2].mean(axis=0) for o in objects if o.semantic in _CANOPY]
        self._trees = cKDTree(np.array(trees)) if trees else None
        self._decay = np.exp(-1 / config.correlation_time)

    def reset(self, rng: np.random.Generator, constants: TrueConstants) -> None:
        """Begin at time zero.

        Args:
            rng: Source of all errors but the slow one; kept.
            constants: True constants of the drive; their seed is that of the slow error.
        """
        gnss = self._config
        self._rng = rng
        self._correlated = gnss.correlated_error * rng.standard_normal(3)
        self._multipath = np.zeros(3)
        self._pending: list[NDArray[np.float64]] = []  # Fixes on their way, oldest first.
        self._second = 0
        noise = gnss.noise if constants.gnss_noise is None else constants.gnss_noise
        self._sigma = np.array([noise, noise, noise * gnss.vertical_ratio])
        self._antenna = constants.antenna
        # The slow error is a unit process that a level scales: its course is the same at each.
        self._slow_rng = np.random.default_rng([constants.seed, 0])
        self._slow, self._drift = self._slow_rng.standard_normal(3), constants.gnss_drift
        self._slow_decay = np.exp(-1 / constants.gnss_drift_time)
        # A receiver reports its usual variance and knows nothing of multipath.
        variance = noise**2 + gnss.correlated_error**2 + constants.gnss_drift**2
        self._stated_variance = variance * constants.gnss_sigma_ratio**2

    def arrived(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fixes that arrive in a period, after taking one at each whole second in it.

        Args:
            rows: Rows of the true track, shape (k, 8 or more).

        Returns:
            Rows as in ``SensorReadings.gnss``, shape (j, 5).
        """
        now = float(rows[-1, _STAMP])
        if now > self._second + 1 - TICK / 2:
            for row in rows:
                second = round(row[_STAMP])
                if second > self._second and abs(row[_STAMP] - second) < TICK / 2:
                    self._second = second
                    self._take_fix(row)
        due = [fix for fix in self._pending if fix[0] + self._config.latency <= now]
        if not due:
            return np.empty((0, 5))
        self._pending = self._pending[len(due) :]
        return np.array(due)

    def _take_fix(self, row: NDArray[np.float64]) -> None:
        """Take a fix at a true row; a lost one is reported as no fix."""
        gnss, draw = self._config, self._rng.standard_normal
        self._wander()
        shaded = (
            self._trees is not None
            and len(self._trees.query_ball_point(row[1:3], gnss.canopy_range)) > 0
        )
        factor = gnss.canopy_factor if shaded else 1.0
        lost, begins, ends = self._rng.random(3)
        # Multipath is an offset that stays for a geometrically distributed number of seconds.
        if self._multipath.any():
            if ends < 1 / gnss.multipath_time:
                self._multipath = np.zeros(3)
        elif begins < gnss.multipath_rate * factor:
            self._multipath = gnss.multipath_error * draw(3)
        error = self._sigma * draw(3) + self._correlated + self._multipath
        if lost < gnss.dropout * factor:
            self._pending.append(np.array([row[_STAMP], *[np.nan] * 3, np.inf]))
            return
        lever = Rotation.from_quat(row[_QUATERNION : _QUATERNION + 4]).apply(self._antenna)
        place = row[_POSITION : _POSITION + 3] + error + self._drift * self._slow + lever
        geodetic = self._geo_reference.to_geodetic(place[None])[0]
        self._pending.append(np.array([row[_STAMP], *geodetic, self._stated_variance]))

    def _wander(self) -> None:
        """Move the correlated errors on by a second, as Gauss-Markov processes of first order."""
        driving = self._config.correlated_error * np.sqrt(1 - self._decay**2)
        self._correlated = self._decay * self._correlated + driving * self._rng.standard_normal(3)
        driving = np.sqrt(1 - self._slow_decay**2)
        self._slow = self._slow_decay * self._slow + driving * self._slow_rng.standard_normal(3)
