"""The hollow: a winding trail between banks, with weeds, hills and ditches (section 6.1)."""

from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.classes import SemanticClass
from terrain.generators import bank, distance_to_line, ditch, smooth_noise
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from terrain.plants import boulder, bush, grass, tree
from worlds.goals import PATH_CLEARANCE, UnsolvableWorldError
from worlds.traversability_map import TraversabilityMap
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, Task, World


class HollowConfig(BaseModel):
    """Trail, banks and plants of a hollow (assumption: the paper shows photographs only).

    Attributes:
        kind: Family of worlds.
        family: Number of the preset's own stream of seeds.
        about: Description in one line.
        difficulty: Default difficulty from 0 to 1; the density of weeds rises with it.
        length: Length of the trail [m].
        floor: Half the width of the hollow's floor [m].
        bank_height: Height of the banks [m].
        bank_slope: Slope of the banks [rad].
        weeds: Number of clumps of weeds per metre of trail at difficulty 0.5 [1/m].
        cell: Distance between the ground's grid lines [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["hollow"] = "hollow"
    family: int = Field(ge=0)
    about: str = ""
    difficulty: float = Field(default=0.5, ge=0, le=1)
    length: float = Field(default=90.0, ge=30, le=200)
    floor: float = Field(default=3.5, ge=2, le=10)
    bank_height: float = Field(default=3.0, ge=0.5, le=10)
    bank_slope: float = Field(default=np.deg2rad(38.0), gt=0, le=np.deg2rad(60.0))
    weeds: float = Field(default=1.6, ge=0, le=10)
    cell: float = Field(default=0.25, gt=0.02, le=0.5)


def make_hollow(
    name: str, seed: int, config: HollowConfig, difficulty: float, rng: np.random.Generator
) -> World:
    """Return a hollow; its task leads along the trail to two goals.

    Args:
        name: Name of the preset.
        seed: Seed, for the record.
        config: Trail, banks and plants.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness.

    Raises:
        UnsolvableWorldError: If weeds and ditches close the trail.
    """
    size = config.length + 16.0
    cell = config.cell
    n = round(size / cell) + 1
    lines = np.arange(n, dtype=np.float64) * cell - size / 2
    trail = _trail(config, rng)
    # As far as the banks rise.
    reach = config.floor + config.bank_height / np.tan(config.bank_slope) + 1.0
    distance = distance_to_line(lines, lines, trail, reach)
    heights = bank(distance, config.floor, config.bank_height, config.bank_slope)
    heights += 0.4 * smooth_noise((n, n), cell, 30.0, rng)
    heights += 0.012 * smooth_noise((n, n), cell, 3.0, rng)
    for first in range(8, len(trail) - 12, 14):
        side = float(rng.choice([-1.0, 1.0])) * rng.uniform(1.6, 2.4)
        gutter = trail[first : first + 8] + np.array([0.0, side])
        near = distance_to_line(lines, lines, gutter, reach=1.0)
        heights += ditch(near, 0.9, rng.uniform(0.25, 0.5))
    ground = Heightfield(heights.astype(np.float32), cell)
    objects = tuple(_plants(ground, trail, config, difficulty, rng))
    surface = np.where(distance[:-1, :-1] < 1.2, SemanticClass.PATH, SemanticClass.GROUND)
    truth = build_truth(ground, objects, TruthConfig())
    tasks = (_task(truth, trail),)
    return World(name, seed, difficulty, ground, surface.astype(np.uint8), objects, tasks, truth)


def _trail(config: HollowConfig, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the trail's middle line [m], corners every metre, shape (k, 2)."""
    x = np.arange(-config.length / 2, config.length / 2 + 0.5)
    waves = rng.uniform([2.0, 1.0], [5.0, 2.5]) * rng.choice([-1.0, 1.0], 2)
    y = waves[0] * np.sin(x / config.length * 2 * np.pi * 1.5 + rng.uniform(0, 6))
    return np.column_stack([x, y + waves[1] * np.sin(x / 9.0 + rng.uniform(0, 6))])


def _plants(
    ground: Heightfield,
    trail: NDArray[np.float64],
    config: HollowConfig,
    difficulty: float,
    rng: np.random.Generator,
) -> list[SceneObject]:
    """Return weeds and stones on the floor, bushes on the banks and trees above them."""
    plants: list[SceneObject] = []
    metres = len(trail)
    for make, count, spread, off in (
        (grass, config.weeds * (0.5 + difficulty), 1.0, 1.6),
        (boulder, 0.15 * (0.5 + difficulty), 1.0, 1.5),
        (bush, 0.4, 0.8, config.floor + 1.0),
        (tree, 0.3, 2.0, config.floor + 5.0),
    ):
        for _ in range(round(metres * count)):
            middle = trail[rng.integers(metres)]
            side = float(rng.choice([-1.0, 1.0])) * (off + abs(rng.normal(0, spread)))
            plants.extend(make(ground, float(middle[0]), float(middle[1] + side), rng))
    return plants


def _task(truth: TraversabilityMap, trail: NDArray[np.float64]) -> Task:
    """Return the task along the trail to its middle and to its end.

    Raises:
        UnsolvableWorldError: If weeds and ditches close the trail.
    """
    stops = [_clearest(truth, trail, share) for share in (0.06, 0.5, 0.94)]
    for a, b in pairwise(stops):
        if truth.shortest_path(a, b, PATH_CLEARANCE) is None:
            raise UnsolvableWorldError("world: expected a safe path along the trail, got none")
    ahead = trail[np.argmin(np.abs(trail[:, 0] - stops[0][0])) + 3] - stops[0]
    start = Start(float(stops[0][0]), float(stops[0][1]), float(np.arctan2(ahead[1], ahead[0])))
    return Task(start, tuple((float(stop[0]), float(stop[1])) for stop in stops[1:]))


def _clearest(
    truth: TraversabilityMap, trail: NDArray[np.float64], share: float
) -> NDArray[np.float64]:
    """Return the point of most clearance near a share of the trail's length [m], shape (2,)."""
    middle = round(share * (len(trail) - 1))
    near = trail[max(0, middle - 4) : middle + 5]
    offsets = np.array([[0.0, dy] for dy in (-1.0, -0.5, 0.0, 0.5, 1.0)])
    places = (near[:, None] + offsets[None]).reshape(-1, 2)
    return places[np.argmax(truth.clearance_at(places[:, 0], places[:, 1]))]
