"""Worlds of hills from worlds of Gazebo: planes and heightmaps as ground, shapes as objects on it.

The world of hills has its middle at the origin; ``ImportedWorld.origin`` tells where that was.
Between the ground's grid lines heights are those of its triangles. Round shapes are cut by the
sides of their parts, by a centimetre at most. A mesh is taken apart into the pieces that hang
together: closed convex ones are solids, of others each triangle is a plate of 2 cm behind its face,
so that beams and contacts from outside are those of the mesh itself; no task begins or ends inside.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import QhullError

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, hull
from worlds.goals import UnsolvableWorldError, sample_tasks
from worlds.rooms.edges import edge_clearances, outline_edges
from worlds.sdf.footprints import is_ground
from worlds.sdf.meshes import Surface, is_closed, normals
from worlds.sdf.outlines import Corners, surface_in_slab
from worlds.sdf.shapes import Capsule, Cylinder, Ellipsoid, Shape, Sphere
from worlds.sdf.solids import Parts, parts_of
from worlds.sdf.terrain import Terrain, terrain_of
from worlds.sdf.world import SdfWorld, Solid
from worlds.traversability_map import TraversabilityMap
from worlds.truth import TruthConfig, build_truth
from worlds.world import Task, World

_TOLERANCE = 0.01
"""Depth at which round shapes may be cut [m]."""

_PLATE = 0.02
"""Thickness of a triangle of a mesh that is not convex [m]."""

_MARGIN = 5.0
"""Width of the ground around the shapes where nothing else bounds it [m] (assumption)."""

_CELLS = (0.1, 0.5)
"""Least and largest distance between the ground's grid lines [m] (assumption)."""

_MAX_EDGE = 300.0
"""Longest edge of a world [m]."""

_TASKS = 12
"""Number of tasks of a world (assumption)."""

_LONGEST = 45.0
"""Largest length of a task's safe path [m], as in the maze."""

Bounds = tuple[float, float, float, float]
"""Rectangle in the world: x_min, y_min, x_max, y_max [m]."""


@dataclass(frozen=True)
class ImportedWorld:
    """A world of hills made from a world of Gazebo.

    Attributes:
        world: World; its middle is the origin.
        origin: Place of its middle in the world of Gazebo [m].
        outside: Number of parts of shapes that lie beyond its border or under its ground.
    """

    world: World
    origin: tuple[float, float]
    outside: int


def world_of(
    world: SdfWorld,
    bounds: Bounds | None = None,
    cell: float | None = None,
    ground: Sequence[str] = (),
) -> ImportedWorld:
    """Return the world of hills of a world of Gazebo.

    Args:
        world: World.
        bounds: Rectangle of it to take; None for that of the hills, or else of all shapes with 5 m
            around them.
        cell: Distance between the ground's grid lines [m]; None for that of the finest heightmap,
            but at least 0.1 and at most 0.5 m.
        ground: Names of models whose shapes are ground, such as meshes of terrain and ramps.

    Raises:
        SdfError: If a mesh or an image cannot be read, or a heightmap is turned.
        ValueError: If bounds or cell are none, the world would be larger than 300 m, or a name of
            ``ground`` is no model's.
    """
    unknown = set(ground) - {name for each in world.solids for name in each.name.split("::")[:-2]}
    if unknown:
        raise ValueError(f"ground: expected names of models, got {', '.join(sorted(unknown))}")
    terrains: list[Terrain] = []
    objects: list[SceneObject] = []
    insides: list[Corners] = []
    for solid in world.solids:
        if not is_ground(solid) and not _is_of(solid, ground):
            parts = parts_of(solid, _TOLERANCE)
            objects += _objects(_semantic(solid.shape), parts)
            insides += _insides(parts)
        elif (terrain := terrain_of(solid)) is not None:
            terrains.append(terrain)
    if bounds is None:
        bounds = _around(terrains, objects)
    if cell is None:
        spacing = min((each.spacing for each in terrains), default=np.inf)
        cell = min(max(spacing, _CELLS[0]), _CELLS[1])
    field, origin = _field(terrains, bounds, cell)
    on_it = [placed for each in objects if (placed := _placed(each, field, origin)) is not None]
    n, m = field.heights.shape
    surface = np.full((n - 1, m - 1), SemanticClass.GROUND, dtype=np.uint8)
    truth = build_truth(field, tuple(on_it), TruthConfig())
    name = "".join(each if each.isalnum() or each in "-_." else "_" for each in world.name)
    tasks = _tasks(truth, field, outline_edges(insides) - np.tile(origin, 2))
    made = World(name, 0, 0.0, field, surface, tuple(on_it), tasks, truth)
    return ImportedWorld(made, origin, len(objects) - len(on_it))


def _is_of(solid: Solid, models: Sequence[str]) -> bool:
    """Return True if a shape is one of some models'."""
    return not set(models).isdisjoint(solid.name.split("::")[:-2])


def _around(terrains: Sequence[Terrain], objects: Sequence[SceneObject]) -> Bounds:
    """Return the rectangle of the hills, or else of the objects with a margin."""
    rectangles = [each.bounds for each in terrains if each.bounds is not None]
    margin = 0.0
    if not rectangles:
        margin = _MARGIN
        for each in objects:
            (x0, y0, _), (x1, y1, _) = each.vertices.min(axis=0), each.vertices.max(axis=0)
            rectangles.append((float(x0), float(y0), float(x1), float(y1)))
    rectangles = rectangles or [(-_MARGIN, -_MARGIN, _MARGIN, _MARGIN)]
    low, high = np.array(rectangles)[:, :2].min(axis=0), np.array(rectangles)[:, 2:].max(axis=0)
    (x0, y0), (x1, y1) = (low - margin).tolist(), (high + margin).tolist()
    return x0, y0, x1, y1


def _field(
    terrains: Sequence[Terrain], bounds: Bounds, cell: float
) -> tuple[Heightfield, tuple[float, float]]:
    """Return the ground of a rectangle, and where its middle is.

    Raises:
        ValueError: If the rectangle is smaller than a cell, or too large.
    """
    x_min, y_min, x_max, y_max = bounds
    width, depth = x_max - x_min, y_max - y_min
    if not 0 < cell <= min(width, depth) <= max(width, depth) <= _MAX_EDGE:
        raise ValueError(
            f"bounds: expected x_min, y_min, x_max, y_max at least a cell of {cell} m and at most "
            f"{_MAX_EDGE:.0f} m apart, got {bounds}"
        )
    n, m = (int(edge / cell + 1e-6) + 1 for edge in (width, depth))
    origin = (x_min + x_max) / 2, (y_min + y_max) / 2
    x = origin[0] + (np.arange(n) - (n - 1) / 2) * cell
    y = origin[1] + (np.arange(m) - (m - 1) / 2) * cell
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    heights = np.full((n, m), -np.inf)
    for each in terrains:
        np.maximum(heights, each.heights(grid_x, grid_y), out=heights)
    # Where there is none at all the ground is at the lowest of the rest.
    known = np.isfinite(heights)
    heights[~known] = heights[known].min() if known.any() else 0.0
    return Heightfield(heights.astype(np.float32), cell), origin


def _objects(semantic: SemanticClass, parts: Parts) -> Iterator[SceneObject]:
    """Yield the convex objects of a shape's parts."""
    for points in parts.convex:
        try:
            yield hull(semantic, points)
        except QhullError:
            continue  # A part without a volume.
    for surface in parts.surfaces:
        yield from _plates(semantic, surface)


def _insides(parts: Parts) -> list[Corners]:
    """Return the outlines of closed surfaces, of which only the faces are objects."""
    closed = [each for each in parts.surfaces if is_closed(each.triangles)]
    return [outline for each in closed for outline in surface_in_slab(each, -np.inf, np.inf)]


def _plates(semantic: SemanticClass, surface: Surface) -> Iterator[SceneObject]:
    """Yield the triangles of a surface as plates behind their faces."""
    across = normals(surface)
    across *= _PLATE / np.linalg.norm(across, axis=1, keepdims=True)
    sides = np.array(
        [[0, 1, 2], [5, 4, 3], [0, 3, 1], [1, 3, 4], [1, 4, 2], [2, 4, 5], [2, 5, 0], [0, 5, 3]]
    )
    for corners, back in zip(surface.vertices[surface.triangles], across, strict=True):
        vertices = np.concatenate([corners, corners - back]).astype(np.float32)
        yield SceneObject(semantic, vertices, sides.astype(np.uint32))


def _semantic(shape: Shape) -> SemanticClass:
    """Return the semantic class of a shape (assumption): SDF has none."""
    match shape:
        case Cylinder() | Capsule():
            return SemanticClass.POST
        case Sphere() | Ellipsoid():
            return SemanticClass.ROCK
    return SemanticClass.WALL


def _placed(
    each: SceneObject, ground: Heightfield, origin: tuple[float, float]
) -> SceneObject | None:
    """Return an object in the frame of the world of hills; None if it is beyond or below it."""
    vertices = each.vertices - np.array([*origin, 0.0], dtype=np.float32)
    x, y, z = vertices.T
    beyond = (abs(x) > ground.width / 2).all() or (abs(y) > ground.depth / 2).all()
    if beyond or (z <= ground.height_at(x, y)).all():
        return None
    return SceneObject(each.semantic, vertices, each.triangles)


def _tasks(
    truth: TraversabilityMap, ground: Heightfield, insides: NDArray[np.float64]
) -> tuple[Task, ...]:
    """Return starts and goals that are inside of nothing, none if there are no safe ways.

    Args:
        truth: True map.
        ground: Ground.
        insides: Edges of what is inside of closed surfaces [m], shape (n, 4).
    """
    near = min(0.25 * min(ground.width, ground.depth), 20.0)
    far = min(0.75 * max(ground.width, ground.depth), 40.0)
    clearance = truth.clearance.astype(np.float64).ravel()
    if len(insides):
        i, j = np.indices(truth.clearance.shape).reshape(2, -1)
        low = np.array([truth.x_min, truth.y_min])
        middles = low + (np.stack([i, j], axis=1) + 0.5) * truth.cell
        edge_clearances(middles, insides, clearance)
    outside = np.maximum(clearance, 0.0).reshape(truth.clearance.shape).astype(np.float32)
    space = replace(truth, clearance=outside)
    try:
        return sample_tasks(space, _TASKS, 1, (near, far), _LONGEST, np.random.default_rng(0))
    except UnsolvableWorldError:
        return ()
