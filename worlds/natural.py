"""Natural worlds: hills, trees, high grass, bushes, rocks, ditches and dead ends (section 5.3)."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import gaussian_filter

from terrain.classes import SemanticClass
from terrain.furniture import bench, bin_, lamp, table
from terrain.generators import (
    distance_to_line,
    ditch,
    hills,
    smooth_noise,
    terrace,
    winding_line,
)
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, bounds, rock
from terrain.plants import boulder, bush, fallen_trunk, grass, stone, tree
from terrain.stands import stand
from terrain.stems import sapling, shrub
from worlds.goals import sample_tasks
from worlds.ground_cover import CoverConfig, ground_cover
from worlds.rooms.movers import Mover
from worlds.rough_ground import RoughnessConfig, refined, rough_ground
from worlds.trails import draw_roots
from worlds.truth import TruthConfig, build_truth
from worlds.walker_config import WalkerConfig
from worlds.walkers import draw_walkers, solids_room
from worlds.ways import WaysConfig, lay_ways
from worlds.world import World

Maker = Callable[[Heightfield, float, float, np.random.Generator], list[SceneObject]]
"""Generator of the parts of one object at map x, y [m] on the ground."""

Placed = Callable[[Heightfield], Sequence[SceneObject]]
"""Generator of objects at places of their own on the ground."""


class Streams(NamedTuple):
    """Sources of randomness of what is on smooth ground: a change of one does not move the others.

    Attributes:
        objects: Source of places and sizes of objects.
        tasks: Source of starts and goals.
        walkers: Source of walkers.
        roughness: Source of what wheels roll over.
        cover: Source of low plants and leaves.
        ways: Source of trails, roots and kerbs.
    """

    objects: np.random.Generator
    tasks: np.random.Generator
    walkers: np.random.Generator
    roughness: np.random.Generator
    cover: np.random.Generator
    ways: np.random.Generator


class NaturalConfig(BaseModel):
    """Terrain and objects of a natural world; densities are per square metre at difficulty 0.5.

    Attributes:
        kind: Family of worlds.
        family: Number of the preset's own stream of seeds.
        about: Description in one line.
        difficulty: Default difficulty from 0 to 1; densities and slopes rise with it.
        size: Edge of the square [m].
        relief: Difference between highest and lowest point [m].
        max_slope: Slope of the steepest 0.1 % of the hills at difficulty 0.5 [rad].
        trees: Density of trees [1/m^2].
        grass: Density of clumps of high grass, clustered in patches [1/m^2].
        bushes: Density of bushes [1/m^2].
        rocks: Density of rocks of 0.05 to 1 m [1/m^2].
        logs: Density of fallen trunks [1/m^2].
        ditches: Number of ditches.
        pits: Number of pits.
        traps: Number of dead ends, U-shaped rows of rocks.
        terraces: Number of plateaus and basins whose edges are steps or banks of 3 to 75 cm.
        ledges: Number of plateaus and basins whose edges are upright steps of 5 to 50 cm.
        stones: Density of stones that a wheel rolls over [1/m^2].
        stands: Density of continuous stands of plants, 2 to 9 m wide [1/m^2].
        lamps: Density of lamps [1/m^2].
        benches: Density of benches [1/m^2].
        tables: Density of tables [1/m^2].
        bins: Density of bins [1/m^2].
        paths: Number of paths across the world, kept free of objects.
        water: Share of the square under water.
        cell: Distance between the ground's grid lines [m].
        tasks: Number of tasks.
        goals: Number of goals of each task.
        near: Least straight distance from goal to goal [m].
        far: Largest straight distance from goal to goal [m].
        longest: Largest length of a safe path from goal to goal [m]; in 300 s a robot drives 90 m.
        walkers: Number, size and speed of what moves: people, animals, vehicles.
        roughness: Clods, gravel and ruts, which wheels roll over.
        cover: Low plants and leaves on the ground.
        shrubs: Density of bushes on solid stems of 2 to 6 cm [1/m^2].
        saplings: Density of small trees, alone or in clumps, with stems of 4 to 20 cm and solid
            branches [1/m^2].
        ways: Trails, roots across them, and raised strips with kerbs.
        wind: Share of the cells of leaves that wind moves now and then.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["natural"] = "natural"
    family: int = Field(ge=0)
    about: str = ""
    difficulty: float = Field(default=0.5, ge=0, le=1)
    size: float = Field(default=120.0, ge=40, le=300)
    relief: float = Field(default=14.0, ge=0.1, le=40)
    max_slope: float = Field(default=np.deg2rad(32.0), gt=0, le=np.deg2rad(45.0))
    trees: float = Field(default=0.020, ge=0, le=0.2)
    grass: float = Field(default=0.050, ge=0, le=1)
    bushes: float = Field(default=0.012, ge=0, le=0.2)
    rocks: float = Field(default=0.022, ge=0, le=0.2)
    logs: float = Field(default=0.0015, ge=0, le=0.05)
    ditches: int = Field(default=14, ge=0, le=100)
    pits: int = Field(default=5, ge=0, le=100)
    traps: int = Field(default=5, ge=0, le=50)
    terraces: int = Field(default=0, ge=0, le=100)
    ledges: int = Field(default=0, ge=0, le=200)
    stones: float = Field(default=0.0, ge=0, le=1)
    stands: float = Field(default=0.0, ge=0, le=0.1)
    lamps: float = Field(default=0.0, ge=0, le=0.1)
    benches: float = Field(default=0.0, ge=0, le=0.1)
    tables: float = Field(default=0.0, ge=0, le=0.1)
    bins: float = Field(default=0.0, ge=0, le=0.1)
    paths: int = Field(default=0, ge=0, le=10)
    water: float = Field(default=0.0, ge=0, le=0.6)
    cell: float = Field(default=0.25, gt=0.02, le=0.5)
    tasks: int = Field(default=4, ge=1, le=100)
    goals: int = Field(default=1, ge=1, le=10)
    near: float = Field(default=25.0, gt=2)
    far: float = Field(default=45.0, gt=2)
    longest: float = Field(default=70.0, gt=2)
    walkers: WalkerConfig = Field(default_factory=WalkerConfig)
    roughness: RoughnessConfig = Field(default_factory=RoughnessConfig)
    cover: CoverConfig = Field(default_factory=CoverConfig)
    shrubs: float = Field(default=0.0, ge=0, le=0.2)
    saplings: float = Field(default=0.0, ge=0, le=0.2)
    ways: WaysConfig = Field(default_factory=WaysConfig)
    wind: float = Field(default=0.0, ge=0, le=1)


def make_natural(
    name: str, seed: int, config: NaturalConfig, difficulty: float, rng: np.random.Generator
) -> World:
    """Return a natural world.

    The ground has a random stream of its own, as each part of ``Streams``.

    Args:
        name: Name of the preset.
        seed: Seed, for the record.
        config: Terrain and objects.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness.

    Raises:
        UnsolvableWorldError: If no tasks with safe paths are found.
    """
    ground_rng, *others = rng.spawn(1 + len(Streams._fields))
    smooth, surface = _ground(config, difficulty, ground_rng)
    return natural_on(name, seed, config, difficulty, smooth, surface, Streams(*others))


def natural_on(
    name: str,
    seed: int,
    config: NaturalConfig,
    difficulty: float,
    smooth: Heightfield,
    surface: NDArray[np.uint8],
    streams: Streams,
    placed: Placed | None = None,
) -> World:
    """Return a world on smooth ground: what of it is not the shape of the ground itself.

    Args:
        name: Name of the world.
        seed: Seed, for the record.
        config: Densities, tasks, walkers, roughness and cover.
        difficulty: Difficulty from 0 to 1.
        smooth: Ground without what wheels roll over.
        surface: Semantic class of each of its cells, uint8, shape (nx - 1, ny - 1).
        streams: Sources of randomness.
        placed: Maker of objects at given places, beside the random ones; None for none.

    Raises:
        UnsolvableWorldError: If no tasks with safe paths are found.
    """
    ground, base, worn = smooth, None, None
    made: list[SceneObject] = []
    way_rng, root_rng = streams.ways.spawn(2)
    rough, trails = config.roughness, []
    if not config.ways.is_empty:
        ways = lay_ways(smooth, surface, rough.cells, config.ways, difficulty, way_rng)
        ground, surface, worn, trails = ways.base, ways.surface, ways.worn, ways.trails
        made += ways.stones
    if not rough.is_smooth:
        base = ground
        if worn is None:
            ground, surface = refined(smooth, surface, rough.cells)
        ground = rough_ground(ground, surface, rough, difficulty, streams.roughness, worn)
    density = config.ways.roots * (0.5 + difficulty)
    made += draw_roots(ground, trails, density, root_rng)
    objects = _objects(ground, smooth, config, difficulty, streams.objects)
    removed = _on_path(objects, ground, surface)
    objects = tuple(each for each, gone in zip(objects, removed, strict=True) if not gone)
    objects += tuple(made)
    if placed is not None:
        objects += tuple(placed(ground))
    cover = ground_cover(surface, ground.cell, config.cover, difficulty, streams.cover)
    truth = build_truth(ground, objects, TruthConfig(), surface, base, cover)
    reach = (config.near, config.far)
    tasks = sample_tasks(truth, config.tasks, config.goals, reach, config.longest, streams.tasks)
    movers: tuple[Mover, ...] = ()
    if not config.walkers.is_empty:
        room = solids_room(ground, objects)
        movers = draw_walkers(config.walkers, room, tasks, streams.walkers, truth, difficulty)
    return World(
        name,
        seed,
        difficulty,
        ground,
        surface,
        objects,
        tasks,
        truth,
        movers,
        base,
        cover,
        wind=config.wind,
    )


def _ground(
    config: NaturalConfig, difficulty: float, rng: np.random.Generator
) -> tuple[Heightfield, NDArray[np.uint8]]:
    """Return hills with ditches, pits and terraces, and the class of each grid cell."""
    cell, size = config.cell, config.size
    n = round(size / cell) + 1
    steep = min(config.max_slope * (0.7 + 0.6 * difficulty), np.deg2rad(35.0))
    heights = hills((n, n), cell, config.relief, steep, rng)
    lines = np.arange(n, dtype=np.float64) * cell - size / 2
    for _ in range(round(config.ditches * (0.5 + difficulty))):
        start = rng.uniform(-size / 2, size / 2, 2)
        line = winding_line(start, rng.uniform(-np.pi, np.pi), rng.uniform(8, 25), 0.15, rng)
        distance = distance_to_line(lines, lines, line, reach=2.0)
        heights += ditch(distance, rng.uniform(0.8, 1.8), rng.uniform(0.2, 0.6))
    for _ in range(round(config.pits * (0.5 + difficulty))):
        centre = rng.uniform(-size / 2, size / 2, (1, 2))
        distance = distance_to_line(lines, lines, np.repeat(centre, 2, axis=0), reach=5.0)
        heights += ditch(distance, rng.uniform(2.0, 5.0), rng.uniform(0.5, 1.2))
    for _ in range(round(config.terraces * (0.5 + difficulty))):
        start = rng.uniform(-size / 2, size / 2, 2)
        line = winding_line(start, rng.uniform(-np.pi, np.pi), rng.uniform(2, 12), 0.4, rng)
        distance = distance_to_line(lines, lines, line, reach=8.0)
        height = rng.choice([-1.0, 1.0]) * 0.03 * 25.0 ** rng.uniform(0, 1)
        heights += terrace(distance, rng.uniform(1.5, 5.0), height, rng.uniform(cell, 1.5))
    for _ in range(round(config.ledges * (0.5 + difficulty))):
        start = rng.uniform(-size / 2, size / 2, 2)
        line = winding_line(start, rng.uniform(-np.pi, np.pi), rng.uniform(2, 12), 0.3, rng)
        distance = distance_to_line(lines, lines, line, reach=6.0)
        height = rng.choice([-1.0, 1.0]) * 0.05 * 10.0 ** rng.uniform(0, 1)
        heights += terrace(distance, rng.uniform(1.5, 4.0), height, cell)
    surface = np.full((n - 1, n - 1), SemanticClass.GROUND, dtype=np.uint8)
    for _ in range(config.paths):
        heights = _lay_path(heights, surface, lines, rng)
    if config.water:
        level = np.quantile(heights, config.water)
        wet = heights < level
        surface[wet[:-1, :-1] & wet[1:, :-1] & wet[:-1, 1:] & wet[1:, 1:]] = SemanticClass.WATER
        heights = np.maximum(heights, level)
    return Heightfield(heights.astype(np.float32), cell), surface


def _lay_path(
    heights: NDArray[np.float64],
    surface: NDArray[np.uint8],
    lines: NDArray[np.float64],
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return the heights with a levelled path across them, and mark its cells in ``surface``."""
    half, cell = lines[-1], lines[1] - lines[0]
    yaw = rng.uniform(-np.pi, np.pi)
    start = -1.2 * half * np.array([np.cos(yaw), np.sin(yaw)]) + rng.uniform(-0.3, 0.3, 2) * half
    line = winding_line(start, yaw, 3.0 * half, 0.1, rng)
    width = rng.uniform(1.2, 2.5)
    distance = distance_to_line(lines, lines, line, reach=width + 2.0)
    surface[distance[:-1, :-1] < width / 2] = SemanticClass.PATH
    even = gaussian_filter(heights, 1.0 / cell, mode="nearest")
    share = np.clip(1.0 + width / 2 - distance, 0.0, 1.0)
    return heights + share * (even - heights)


def _on_path(
    objects: Sequence[SceneObject], ground: Heightfield, surface: NDArray[np.uint8]
) -> NDArray[np.bool_]:
    """Return which objects have their middle on a path or in the water, and touch it."""
    lows, highs = bounds(objects)
    x, y, _ = (lows + highs).T / 2
    i = ((x + ground.width / 2) / ground.cell).astype(int).clip(0, surface.shape[0] - 1)
    j = ((y + ground.depth / 2) / ground.cell).astype(int).clip(0, surface.shape[1] - 1)
    touches = lows[:, 2] < ground.height_at(x, y) + 0.3
    return np.asarray((surface[i, j] != SemanticClass.GROUND) & touches)


def _objects(
    ground: Heightfield,
    smooth: Heightfield,
    config: NaturalConfig,
    difficulty: float,
    rng: np.random.Generator,
) -> Sequence[SceneObject]:
    """Return all objects on the ground, at the same places on smooth ground and on rough."""
    objects: list[SceneObject] = []
    kinds: tuple[tuple[Maker, float, float], ...] = (
        (tree, config.trees, 25.0),
        (grass, config.grass, 9.0),
        (bush, config.bushes, 15.0),
        (boulder, config.rocks, 12.0),
        (fallen_trunk, config.logs, 30.0),
        (stone, config.stones, 6.0),
        (lamp, config.lamps, 40.0),
        (bench, config.benches, 20.0),
        (table, config.tables, 20.0),
        (bin_, config.bins, 20.0),
        (stand, config.stands, 15.0),
        (shrub, config.shrubs, 12.0),
        (sapling, config.saplings, 18.0),
    )
    for make, density, patch in kinds:
        # A stream for each kind: a preset without benches has the same trees as one with.
        stream = rng.spawn(1)[0]
        if not density:
            continue
        for x, y in _scatter(smooth, density * (0.5 + difficulty), patch, stream):
            objects.extend(make(ground, x, y, stream))
    for _ in range(round(config.traps * (0.5 + difficulty))):
        objects.extend(_trap(ground, rng))
    return objects


def _scatter(
    ground: Heightfield, density: float, patch: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return random places clustered in patches [m], shape (k, 2).

    Args:
        ground: The heightfield.
        density: Mean density of places [1/m^2].
        patch: Typical distance between patches [m].
        rng: Source of randomness.
    """
    field = smooth_noise(ground.heights.shape, ground.cell, patch, rng)
    weight = np.exp(1.2 * field)
    chance = density * ground.cell**2 * weight / weight.mean()
    cells = np.argwhere(rng.random(field.shape) < chance)
    places = (cells + rng.uniform(-0.5, 0.5, cells.shape)) * ground.cell
    return places - [ground.width / 2, ground.depth / 2]


def _trap(ground: Heightfield, rng: np.random.Generator) -> list[SceneObject]:
    """Return a U-shaped row of rocks, 5 to 9 m deep: a dead end."""
    centre = rng.uniform(-0.4, 0.4, 2) * [ground.width, ground.depth]
    yaw, depth, half = rng.uniform(-np.pi, np.pi), rng.uniform(5, 9), rng.uniform(2.0, 3.5)
    corners = np.array([[0, -half], [depth, -half], [depth, half], [0, half]])
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    objects: list[SceneObject] = []
    for a, b in pairwise(corners):
        count = int(np.hypot(*(b - a)) / 0.7)
        for share in np.arange(count) / count:
            x, y = turn @ (a + share * (b - a)) + centre + rng.normal(0, 0.1, 2)
            objects.extend(_big_rock(ground, float(x), float(y), rng))
    return objects


def _big_rock(
    ground: Heightfield, x: float, y: float, rng: np.random.Generator
) -> list[SceneObject]:
    """Return a rock of 0.4 to 0.8 m."""
    radii = rng.uniform(0.4, 0.8, 3)
    return [rock((x, y, float(ground.height_at(x, y))), radii, rng)]
