"""The field suite: labelled clouds of plants that block, and of ground that must stay free.

Both halves judge together: a classifier that calls more blocked gains in one and loses in the
other. Lasers, heights of the sensor, fields and cover are drawn.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.machine.lidar_models import sensor_names, sensor_settings
from traversability.cloud import PointCloud
from worlds.fields import Field, bare_ground, draw_field, make_field, plain_world
from worlds.rays.scene import RayScene
from worlds.scenes import Scene
from worlds.splits import refuse_judging
from worlds.world import Start, World

FIELD = "field"
"""Kind of the cases with a field of plants."""

FREE_KINDS = ("level", "noiseless", "grass", "litter", "undulation", "verge")
"""Kinds of ground that must stay free."""

_SUITE_SEED = 2_100_000_000


@dataclass(frozen=True)
class FieldCase:
    """One cloud of the suite.

    Attributes:
        kind: ``FIELD``, or one of ``FREE_KINDS``.
        sensor: Name of the laser.
        height: Height of its optical centre [m].
        bearing: Bearing of the field in the map [rad].
        field: The field; None on free ground.
        number: Number of the case within the suite.
    """

    kind: str
    sensor: str
    height: float
    bearing: float
    field: Field | None
    number: int


def field_cases(count: int, seed: int = 0, release: str | None = None) -> Iterator[FieldCase]:
    """Yield the suite: as many fields as cases of free ground, in turns.

    Args:
        count: Number of fields.
        seed: Seed of the suite.
        release: Release that the suite judges; None for development.

    Raises:
        JudgingSeedError: If the seed judges a release, and it is not ``release``.
    """
    refuse_judging(seed, release)
    names = sensor_names()
    for number in range(2 * count):
        rng = np.random.default_rng([_SUITE_SEED, seed, number])
        sensor = names[int(rng.integers(len(names)))]
        height, bearing = rng.uniform(0.5, 1.8), rng.uniform(-np.pi, np.pi)
        if number % 2 == 0:
            yield FieldCase(FIELD, sensor, height, bearing, draw_field(rng), number)
        else:
            kind = FREE_KINDS[number // 2 % len(FREE_KINDS)]
            yield FieldCase(kind, sensor, height, bearing, None, number)


def field_cloud(case: FieldCase, seed: int = 0) -> tuple[PointCloud, float]:
    """Return the labelled cloud of a case, and the heading of the robot that took it [rad].

    Args:
        case: Which.
        seed: Seed of the suite, as in ``field_cases``.
    """
    rng = np.random.default_rng([_SUITE_SEED, seed, case.number, 1])
    world = _world(case, rng)
    start = Start(0.0, 0.0, float(rng.uniform(-np.pi, np.pi)))
    scene = Scene(world, RayScene(world))
    return labelled_cloud(scene, _config(case), rng, start), start.yaw


def _world(case: FieldCase, rng: np.random.Generator) -> World:
    """Return the world of a case: a field, or bare ground that is level or slopes gently."""
    if case.field is not None:
        return make_field(case.field, case.bearing, rng)
    steep = 0.0 if case.kind in ("level", "noiseless") else rng.uniform(0.0, 10.0)
    return plain_world(case.kind, bare_ground(np.deg2rad(steep), rng), path=case.kind == "verge")


_COVER: dict[str, dict[str, object]] = {
    "noiseless": {"exact_share": 1.0},
    "grass": {"grass": (0.05, 0.15)},
    "litter": {"litter": (0.005, 0.025)},
    "undulation": {"undulation": (0.02, 0.05), "grass": (0.05, 0.15)},
    "verge": {"undulation": (0.0, 0.02), "grass": (0.05, 0.15)},
}
"""Settings of the clouds by kind of free ground."""


def _config(case: FieldCase) -> CloudsConfig:
    """Return the settings of a case's cloud: taken at a standstill, all beams kept."""
    taken = {
        "standstill_share": 1.0,
        "carry_time": 0.0,
        "varied_share": 1.0,
        "point_shares": (1.0, 1.0),
    }
    heights = {"lidar_heights": (case.height, case.height), "cover_share": 1.0}
    cover = _COVER.get(case.kind, {})
    return CloudsConfig.model_validate(sensor_settings(case.sensor) | taken | heights | cover)
