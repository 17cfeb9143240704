"""The hazard suite: labelled clouds of hazards at known distances, sides and slopes."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from traversability.cloud import PointCloud
from worlds.hazards import HAZARDS, make_hazard
from worlds.rays.scene import RayScene
from worlds.scenes import Scene
from worlds.world import Start

DISTANCES = (1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 5.0, 8.0)
"""Distances of a hazard's near edge [m]."""

SLOPES_DEG = (0.0, 6.0, 12.0)
"""Slopes of the ground that hazards stand on."""

BARE_SLOPES_DEG = (0.0, 5.0, 10.0, 15.0, 18.0, 19.5)
"""Slopes of bare ground, all of them drivable."""

BLIND_EDGE = 0.8
"""Distance at which the drop at the edge of the blind cone begins [m]; the cone's radius is
0.72 m."""

_SUITE_SEED = 2_000_000_000
_CONFIG = CloudsConfig(standstill_share=1.0, carry_time=0.0)


@dataclass(frozen=True)
class HazardCase:
    """One cloud of the suite.

    Attributes:
        hazard: Name of the hazard.
        distance: Distance of its near edge [m].
        bearing: Bearing of the hazard in the map [rad].
        slope_deg: Slope of the ground [deg].
        number: Number of the cloud within the suite.
    """

    hazard: str
    distance: float
    bearing: float
    slope_deg: float
    number: int


def hazard_cases(sides: int = 4) -> Iterator[HazardCase]:
    """Yield the suite: each hazard at each distance and slope, from several sides.

    Args:
        sides: Bearings of each; the first is straight ahead of the map's x axis, and none lies in
            the middle of a sector.
    """
    number = 0
    for hazard in HAZARDS:
        slopes = BARE_SLOPES_DEG if hazard == "bare_ground" else SLOPES_DEG
        for slope in slopes:
            # A slope on a slope would be too steep to drive.
            if hazard == "drivable_slope" and slope > 0:
                continue
            for distance in DISTANCES:
                near = BLIND_EDGE + 0.05 * distance if hazard == "drop" else distance
                for side in range(sides):
                    bearing = 2 * np.pi * (side + 0.13 * (number % 7)) / sides
                    yield HazardCase(hazard, near, bearing, slope, number)
                    number += 1


def hazard_cloud(case: HazardCase, seed: int = 0) -> PointCloud:
    """Return the labelled cloud of a case.

    Args:
        case: Which.
        seed: Seed of the suite: 0 for published results, others for development.
    """
    rng = np.random.default_rng([_SUITE_SEED, seed, case.number])
    slope = np.deg2rad(case.slope_deg)
    world = make_hazard(HAZARDS[case.hazard], case.distance, case.bearing, float(slope), rng)
    start = Start(0.0, 0.0, float(rng.uniform(-np.pi, np.pi)))
    return labelled_cloud(Scene(world, RayScene(world)), _CONFIG, rng, start)
