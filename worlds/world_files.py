"""Worlds in files of one's own: ground, objects and tasks as safetensors, which hold no code.

The true map is not in a file: it follows from ground and objects, and is built when one is read.
"""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
)
from safetensors import safe_open
from safetensors.numpy import save

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.agents import check_movers
from worlds.rooms.movers import Behaviour, Mover, MoverPlan
from worlds.truth import TruthConfig, build_truth
from worlds.world import MapDatum, Start, Task, World

SUFFIX = ".safetensors"
"""End of the names of world files."""

_KIND = "andabata-world-1"
"""Kind and version of the format."""

_SHAPES = {
    "heights": (np.float32, 2),
    "surface": (np.uint8, 2),
    "kinds": (np.uint8, 1),
    "vertices": (np.float32, 2),
    "vertex_starts": (np.int64, 1),
    "triangles": (np.uint32, 2),
    "triangle_starts": (np.int64, 1),
}
"""Type and number of dimensions of each array."""


_MAX_EDGE, _FARTHEST = 1000.0, 10_000.0
"""Longest edge of the ground, and farthest coordinate of an object [m]: larger ones of a damaged
file would take all memory, or hours."""


class WorldFileError(ValueError):
    """A file that is no world; the text names the file."""


class _Task(BaseModel):
    """Start and goals of a task."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    start: tuple[float, float, float]
    goals: tuple[tuple[float, float], ...]


class _Mover(BaseModel):
    """A walker at its begin; see ``Mover``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    place: tuple[float, float]
    velocity: tuple[float, float]
    plan: MoverPlan
    behaviour: Behaviour | None = None

    @model_serializer(mode="wrap")
    def _without_none(self, handler: SerializerFunctionWrapHandler) -> dict[str, object]:
        """Leave out the behaviour of one that has none: its bytes stay what they ever were."""
        written: dict[str, object] = handler(self)
        return {key: value for key, value in written.items() if value is not None}


class _Header(BaseModel):
    """What of a world is no array; see ``World``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    name: str
    seed: int
    difficulty: float
    cell: float
    tasks: tuple[_Task, ...]
    movers: tuple[_Mover, ...] = ()
    base_cell: float | None = None
    datum: MapDatum | None = None
    wind: float = Field(default=0.0, ge=0, le=1)


def is_world_file(name: str) -> bool:
    """Return True if a world's name is that of a file."""
    return name.endswith(SUFFIX)


def world_to_bytes(world: World) -> bytes:
    """Return a world as the bytes of a file; equal worlds give equal bytes."""
    objects = world.objects
    header = _Header(
        name=world.name,
        seed=world.seed,
        difficulty=world.difficulty,
        cell=world.ground.cell,
        tasks=tuple(
            _Task(start=(task.start.x, task.start.y, task.start.yaw), goals=task.goals)
            for task in world.tasks
        ),
        movers=tuple(
            _Mover(
                place=mover.place,
                velocity=mover.velocity,
                plan=mover.plan,
                behaviour=mover.behaviour,
            )
            for mover in world.movers
        ),
        base_cell=None if world.base is None else world.base.cell,
        datum=world.datum,
        wind=world.wind,
    )
    arrays = {
        "heights": world.ground.heights,
        "surface": world.surface,
        "kinds": np.array([each.semantic for each in objects], dtype=np.uint8),
        "vertices": _joined([each.vertices for each in objects], np.float32),
        "vertex_starts": _starts([len(each.vertices) for each in objects]),
        "triangles": _joined([each.triangles for each in objects], np.uint32),
        "triangle_starts": _starts([len(each.triangles) for each in objects]),
    }
    if world.base is not None:
        arrays["base"] = world.base.heights
    if world.cover is not None:
        arrays["cover"] = world.cover
    whole = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    # One key, since the order of several is not always the same.
    # A world without walkers, roughness, datum or wind has the bytes that it had before there were
    # any.
    optional = ("movers", "base_cell", "datum", "wind")
    left_out = {name for name in optional if not getattr(header, name)}
    return save(whole, {_KIND: header.model_dump_json(exclude=left_out)})


def load_world(path: Path) -> World:
    """Return the world of a file.

    Raises:
        WorldFileError: If it is no world.
        OSError: If it cannot be read.
    """
    with path.open("rb"):
        pass  # For the plain error of a file that is not there.
    try:
        with safe_open(path, "numpy") as file:
            about = file.metadata() or {}
            if _KIND not in about:
                kinds = ", ".join(about) or "nothing of the kind"
                raise WorldFileError(f"{path}: expected {_KIND}, got {kinds}")
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        header = _Header.model_validate(json.loads(about[_KIND]))
        return _world(header, arrays)
    except WorldFileError:
        raise
    except Exception as error:  # A hostile header raises many kinds.
        raise WorldFileError(f"{path}: expected a whole world, got a damaged one ({error})") from (
            error
        )


def _world(header: _Header, arrays: dict[str, NDArray[np.generic]]) -> World:
    """Return the world of a header and arrays.

    Raises:
        ValueError: If they do not fit together.
    """
    for name, (kind, dimensions) in _SHAPES.items():
        array = arrays.get(name)
        if array is None or array.dtype != kind or array.ndim != dimensions:
            raise ValueError(f"{name}: expected {np.dtype(kind)} of {dimensions} dimensions")
    ground = Heightfield(arrays["heights"].astype(np.float32), header.cell)
    if not max(ground.width, ground.depth) <= _MAX_EDGE:
        raise ValueError(f"heights: expected an edge of at most {_MAX_EDGE:.0f} m, got more")
    surface = arrays["surface"].astype(np.uint8)
    if surface.shape != tuple(edge - 1 for edge in ground.heights.shape):
        raise ValueError(f"surface: expected one value a cell, got shape {surface.shape}")
    objects = tuple(_objects(arrays))
    tasks = tuple(Task(Start(*task.start), task.goals) for task in header.tasks)
    base = _base(header, arrays, ground)
    cover = _cover(arrays, surface)
    truth = build_truth(ground, objects, TruthConfig(), surface, base, cover)
    movers = tuple(Mover(one.place, one.velocity, one.plan, one.behaviour) for one in header.movers)
    check_movers(movers)
    return World(
        header.name,
        header.seed,
        header.difficulty,
        ground,
        surface,
        objects,
        tasks,
        truth,
        movers,
        base,
        cover,
        header.datum,
        header.wind,
    )


def _base(
    header: _Header, arrays: dict[str, NDArray[np.generic]], ground: Heightfield
) -> Heightfield | None:
    """Return the ground without roughness, None if it has none.

    Raises:
        ValueError: If it is not as large as the ground.
    """
    heights = arrays.get("base")
    if heights is None or header.base_cell is None:
        return None
    base = Heightfield(heights.astype(np.float32), header.base_cell)
    sizes = (base.width, base.depth), (ground.width, ground.depth)
    if not np.allclose(*sizes, rtol=1e-6):
        raise ValueError(f"base: expected the size of the ground, {sizes[1]} m, got {sizes[0]} m")
    return base


def _cover(
    arrays: dict[str, NDArray[np.generic]], surface: NDArray[np.uint8]
) -> NDArray[np.uint8] | None:
    """Return the height of the low plants on each cell [cm], None for bare ground.

    Raises:
        ValueError: If it is not of the grid's shape.
    """
    heights = arrays.get("cover")
    if heights is None:
        return None
    if heights.dtype != np.uint8 or heights.shape != surface.shape:
        raise ValueError(f"cover: expected uint8, one value a cell, got shape {heights.shape}")
    return heights.astype(np.uint8)


def _objects(arrays: dict[str, NDArray[np.generic]]) -> list[SceneObject]:
    """Return the objects of arrays.

    Raises:
        ValueError: If indices are out of bounds, or a class is unknown.
    """
    vertices = arrays["vertices"].astype(np.float32)
    triangles = arrays["triangles"].astype(np.uint32)
    kinds = [SemanticClass(int(kind)) for kind in arrays["kinds"].astype(np.uint8)]
    spans = []
    for name, rows in (("vertex", vertices), ("triangle", triangles)):
        starts = arrays[f"{name}_starts"].astype(np.int64).tolist()
        whole = len(starts) == len(kinds) + 1 and starts[0] == 0 and starts[-1] == len(rows)
        if not whole or starts != sorted(starts) or rows.shape[1] != 3:
            raise ValueError(f"{name}: expected {len(kinds)} objects")
        spans.append(list(pairwise(starts)))
    objects = []
    for kind, (v0, v1), (t0, t1) in zip(kinds, *spans, strict=True):
        if t0 == t1 or triangles[t0:t1].max() >= v1 - v0:
            raise ValueError("triangles: expected indices of the object's own vertices")
        objects.append(SceneObject(kind, vertices[v0:v1], triangles[t0:t1]))
    if not (np.abs(vertices) <= _FARTHEST).all():
        raise ValueError(f"vertices: expected values within {_FARTHEST:.0f} m, got others")
    return objects


def _joined(arrays: list[NDArray[np.generic]], kind: type[np.generic]) -> NDArray[np.generic]:
    """Return arrays of three columns one after the other."""
    return np.concatenate([np.zeros((0, 3)), *arrays]).astype(kind)


def _starts(counts: list[int]) -> NDArray[np.int64]:
    """Return where each of some arrays begins, and the last one ends."""
    return np.cumsum([0, *counts], dtype=np.int64)
