"""Imports worlds of Gazebo into files that the evaluation of rooms and the drives take."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from andabata.app.world_summary import size_text, world_summary
from andabata.configuration.usage import UsageError, numbers
from andabata.runs import atomic_io
from worlds import world_files
from worlds.rooms import files as room_files
from worlds.rooms.room import Room
from worlds.sdf.ground import world_of
from worlds.sdf.room import SLAB, Bounds, is_flat, room_of
from worlds.sdf.world import SdfWorld, read_sdf

AUTO, ROOM, WORLD = "auto", "room", "world"
"""Forms of an import: by the ground, a room for planar lasers, a world of hills."""

_ENDS = (".gz", ".sdf", ".world")
"""Ends of the names of worlds of Gazebo."""

_MANY_EDGES = 2000
"""Number of slanted edges of a room from which its beams take much longer than usual."""


@dataclass(frozen=True)
class ImportRequest:
    """What to import, and as what.

    Attributes:
        file: World of Gazebo.
        out: File to write; None for one in the current folder, named after the world's file.
        folders: Folders of models.
        name: Name of the world in the file; None for the first one.
        form: ``auto``, ``room`` or ``world``.
        slab: Heights above the ground between which a room has obstacles [m]; None for 0.05 to 0.5.
        bounds: Rectangle of the world to take [m]; None for all of it.
        cell: Distance between the grid lines of a world's ground [m]; None for a fitting one.
        ground: Names of models whose shapes are ground.
        allow_missing: True to leave out what is not found.
    """

    file: Path
    out: Path | None = None
    folders: Sequence[Path] = ()
    name: str | None = None
    form: str = AUTO
    slab: tuple[float, float] | None = None
    bounds: Bounds | None = None
    cell: float | None = None
    ground: tuple[str, ...] = ()
    allow_missing: bool = False


def slab_of(text: str) -> tuple[float, float]:
    """Return the heights of ``--slab`` [m].

    Raises:
        UsageError: If they are not two, the least first.
    """
    low, high = numbers(text, 2, "--slab")
    if not low < high:
        raise UsageError(f"--slab: expected the least height first, got {text!r}")
    return low, high


def bounds_of(text: str) -> Bounds:
    """Return the rectangle of ``--bounds`` [m].

    Raises:
        UsageError: If it is none.
    """
    x_min, y_min, x_max, y_max = numbers(text, 4, "--bounds")
    if not (x_min < x_max and y_min < y_max):
        raise UsageError(f"--bounds: expected least x, y, then largest x, y, got {text!r}")
    return x_min, y_min, x_max, y_max


def import_world(request: ImportRequest) -> dict[str, Any]:
    """Import a world of Gazebo, write it, and return what became of it, ready for JSON.

    Raises:
        SdfError: If the world, or a file that it names, is not as SDF says, or missing.
        UsageError: If an option does not go with the form.
        OSError: If a file cannot be read or written.
    """
    read = read_sdf(request.file, request.folders, request.name, request.allow_missing)
    form = request.form
    if form == AUTO:
        # Who names ground wants its relief, however flat the world is.
        form = ROOM if is_flat(read) and not request.ground else WORLD
    _refuse_others(request, form)
    content, about, warnings = (_room if form == ROOM else _world)(read, request)
    suffix = room_files.SUFFIX if form == ROOM else world_files.SUFFIX
    out = request.out or Path(_stem(request.file) + suffix)
    # Commands tell rooms from worlds of hills by the suffix.
    if out.suffix != suffix:
        raise UsageError(f"--out: expected a file that ends in {suffix} for a {form}, got {out}")
    atomic_io.write(out, content)
    kinds = Counter(type(solid.shape).__name__.lower() for solid in read.solids)
    return {
        "out": str(out),
        "form": form,
        "name": read.name,
        "version": read.version,
        "shapes": dict(kinds),
        **about,
        "warnings": [*read.warnings, *warnings],
    }


def import_text(data: dict[str, Any]) -> str:
    """Return what became of a world as text, a warning a line."""
    shapes = ", ".join(f"{count} {kind}" for kind, count in data["shapes"].items()) or "none"
    lines = [f"{data['name']}, SDF {data['version']}; shapes that collide: {shapes}"]
    if data["form"] == ROOM:
        (x, y), (low, high) = data["half_m"], data["slab_m"]
        lines.append(
            f"room of {2 * x:.2f} x {2 * y:.2f} m, {low:g} to {high:g} m above the ground: "
            f"{data['boxes']} boxes, {data['circles']} circles, {data['edges']} slanted edges"
        )
    else:
        lines.append(size_text(data))
    x, y = data["origin_m"]
    lines.append(f"its middle was at ({x:g}, {y:g}); shapes outside of it: {data['outside']}")
    lines += [f"warning: {warning}" for warning in data["warnings"]]
    return "\n".join([*lines, f"{data['form']}: {data['out']}"])


_Made = tuple[bytes, dict[str, Any], list[str]]
"""Contents of a file, what is in it, and warnings."""


def _room(read: SdfWorld, request: ImportRequest) -> _Made:
    """Return a room's file."""
    slab = request.slab or SLAB
    imported = room_of(read, slab, request.bounds)
    plan = imported.plan
    edges = len(Room.of(read.name, plan).edges)
    about = {
        "boxes": len(plan.boxes),
        "circles": len(plan.circles),
        "outlines": len(plan.outlines),
        "edges": edges,
        "half_m": list(plan.half),
        "origin_m": list(plan.origin),
        "ground_m": imported.ground,
        "slab_m": list(slab),
        "outside": imported.outside,
    }
    warnings = []
    if edges > _MANY_EDGES:
        warnings.append(f"{edges} slanted edges: every beam and step takes longer; simplify meshes")
    return room_files.plan_to_toml(plan).encode(), about, warnings


def _world(read: SdfWorld, request: ImportRequest) -> _Made:
    """Return the file of a world of hills."""
    imported = world_of(read, request.bounds, request.cell, request.ground)
    about = world_summary(imported.world)
    # What was not generated has no seed, difficulty and datum, and its name stands above.
    for name in ("name", "seed", "difficulty", "datum"):
        del about[name]
    about |= {"origin_m": list(imported.origin), "outside": imported.outside}
    warnings = []
    if not imported.world.tasks:
        warnings.append("no start and goal with a safe way between them: the world has no tasks")
    return world_files.world_to_bytes(imported.world), about, warnings


def _refuse_others(request: ImportRequest, form: str) -> None:
    """Refuse options of the other form.

    Raises:
        UsageError: If one is given.
    """
    if form == WORLD and request.slab is not None:
        raise UsageError("--slab: expected none for a world of hills; give --form room")
    if form == ROOM and (request.cell is not None or request.ground):
        raise UsageError("--cell, --ground: expected none for a room; give --form world")


def _stem(file: Path) -> str:
    """Return a file's name without the ends of worlds."""
    name = file.name
    # A packed world has two of them: world_7.world.gz.
    while Path(name).suffix in _ENDS:
        name = Path(name).stem
    return name
