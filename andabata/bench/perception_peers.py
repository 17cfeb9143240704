"""Peers of the cell classifier: methods that label obstacle points, with their settings.

A cell is blocked by the same 15 % rule as the truth. The two libraries come with the extra
``peers``.
"""

import io
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.grid import PolarGrid
from traversability.height_rule import Points, quantile_rule

Settings = Mapping[str, Any]


@dataclass(frozen=True)
class Peer:
    """Method with the settings among which the best is chosen.

    Attributes:
        name: Name for tables.
        make: Function from settings to a function from points to obstacle flags.
        choices: Values of each setting.
    """

    name: str
    make: Callable[..., Callable[[Points], NDArray[np.bool_]]]
    choices: Mapping[str, tuple[Any, ...]]

    def settings(self) -> Iterator[dict[str, Any]]:
        """Yield every combination of settings."""
        for values in product(*self.choices.values()):
            yield dict(zip(self.choices, values, strict=True))


def cloth(
    resolution: float, rigidness: int, distance: float, smooth: bool, grid: PolarGrid
) -> Callable[[Points], NDArray[np.bool_]]:
    """Return the cloth simulation filter (Zhang et al. 2016).

    Args:
        resolution: Edge of the cloth's cells [m].
        rigidness: Stiffness of the cloth, 1 to 3.
        distance: Largest distance of ground points from the cloth [m].
        smooth: True to smooth the cloth on slopes.
        grid: Polar grid, which this peer ignores.
    """
    import CSF

    filter_ = CSF.CSF()
    filter_.params.cloth_resolution = resolution
    filter_.params.rigidness = rigidness
    filter_.params.class_threshold = distance
    filter_.params.bSloopSmooth = smooth

    def obstacles(points: Points) -> NDArray[np.bool_]:
        filter_.setPointCloud(points.astype(np.float64))
        ground, rest = CSF.VecInt(), CSF.VecInt()
        with quiet():
            filter_.do_filtering(ground, rest, False)
        flags = np.zeros(len(points), dtype=bool)
        flags[np.array(rest, dtype=int)] = True
        return flags

    return obstacles


def patchwork(
    distance: float, uprightness: float, seeds: float, grid: PolarGrid
) -> Callable[[Points], NDArray[np.bool_]]:
    """Return Patchwork++ (Lee et al. 2022), with the sensor at the height of ours.

    Args:
        distance: Largest distance of ground points from a patch's plane [m].
        uprightness: Smallest z component of the normal of a ground patch.
        seeds: Height above the lowest points up to which points seed a plane [m].
        grid: Grid, whose inner radius is the smallest range.
    """
    import pypatchworkpp

    parameters = pypatchworkpp.Parameters()
    parameters.verbose = False
    parameters.enable_RNR = False
    parameters.sensor_height = 0.72
    parameters.min_range, parameters.max_range = grid.inner_radius, 14.0
    parameters.th_dist, parameters.th_seeds = distance, seeds
    parameters.uprightness_thr = uprightness
    parameters.num_min_pts = 5

    def obstacles(points: Points) -> NDArray[np.bool_]:
        # It adapts from cloud to cloud; ours come from many places, so each gets a new one.
        with quiet():
            method = pypatchworkpp.patchworkpp(parameters)
            sensor = points.astype(np.float64) - [0.0, 0.0, parameters.sensor_height]
            method.estimateGround(np.column_stack([sensor, np.zeros(len(points))]))
        flags = np.zeros(len(points), dtype=bool)
        flags[np.asarray(method.getNongroundIndices(), dtype=int)] = True
        return flags

    return obstacles


@contextmanager
def quiet() -> Iterator[None]:
    """Keep the prints of a library off standard output, which is for ``--json``."""
    kept = os.dup(1)
    try:
        with tempfile.TemporaryFile() as sink, redirect_stdout(io.StringIO()):
            os.dup2(sink.fileno(), 1)
            yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


PEERS = (
    Peer(
        "quantile rule",
        quantile_rule,
        {"height": (0.08, 0.1, 0.15, 0.2, 0.3, 0.4), "quantile": (0.1, 0.25)},
    ),
    Peer(
        "cloth (CSF)",
        cloth,
        {
            "resolution": (0.2, 0.3, 0.5, 1.0),
            "rigidness": (1, 2, 3),
            "distance": (0.05, 0.1, 0.2, 0.3),
            "smooth": (True, False),
        },
    ),
    Peer(
        "patchwork++",
        patchwork,
        {
            "distance": (0.05, 0.08, 0.125, 0.2),
            "uprightness": (0.5, 0.707, 0.9, 0.95),
            "seeds": (0.06, 0.125, 0.3),
        },
    ),
)
"""Peers of the cell classifier."""
