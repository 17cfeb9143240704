"""Imports elevation models as worlds, with what stands on them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from andabata.app.world_summary import datum_text, size_text, world_summary
from andabata.configuration.usage import UsageError, numbers
from andabata.distribution import install_extra
from andabata.runs import atomic_io
from worlds import world_files
from worlds.elevation.errors import MissingRasterioError
from worlds.elevation.local_frame import MAX_LATITUDE
from worlds.elevation.objects_file import PlacedObject, check_inside, read_objects
from worlds.elevation.raster import SUFFIXES
from worlds.elevation.square import GroundSquare, read_square
from worlds.elevation.world import BARE, config_on, world_on

DEGREES, MAP = "degrees", "map"
"""Coordinates of objects: longitude and latitude, or metres to the east and north."""

_PRESET = "natural-test"
"""Preset of a world without given objects."""


@dataclass(frozen=True)
class ElevationRequest:
    """Which square of an elevation model to import, and what stands on it.

    Attributes:
        file: GeoTIFF.
        out: File to write; None for one in the current folder, named after the model.
        at: Latitude and longitude of the square's middle [deg]; None for the model's middle.
        size: Edge of the square [m].
        cell: Distance between the ground's grid lines [m]; None for the preset's own.
        crs: Coordinate reference system of a file that has none.
        preset: Natural preset, or ``none``; None for natural-test, without it where objects are
            given.
        difficulty: Difficulty from 0 to 1; None for the preset's own.
        objects: GeoJSON file of objects.
        objects_frame: ``degrees`` or ``map``.
        seed: Seed of everything random.
    """

    file: Path
    out: Path | None = None
    at: tuple[float, float] | None = None
    size: float = 120.0
    cell: float | None = None
    crs: str | None = None
    preset: str | None = None
    difficulty: float | None = None
    objects: Path | None = None
    objects_frame: str = DEGREES
    seed: int = 0


def is_elevation_model(file: Path) -> bool:
    """Return True if a file has the name of an elevation model."""
    return file.suffix.lower() in SUFFIXES


def place_of(text: str) -> tuple[float, float]:
    """Return the latitude and longitude of ``--at`` [deg].

    Raises:
        UsageError: If they are none.
    """
    latitude, longitude = numbers(text, 2, "--at")
    if not (abs(latitude) <= MAX_LATITUDE and abs(longitude) <= 180):
        raise UsageError(
            f"--at: expected LAT,LON in degrees, latitude within {MAX_LATITUDE:g} and longitude "
            f"within 180, got {text!r}"
        )
    return latitude, longitude


def import_elevation(request: ElevationRequest) -> dict[str, Any]:
    """Import an elevation model, write the world, and return what became of it, ready for JSON.

    Raises:
        ElevationError: If the model or the file of objects is not as expected.
        UsageError: If an option is not what it has to be, or rasterio is not installed.
        OSError: If a file cannot be read or written.
        ValueError: If the ground has no tasks, or there is no such preset.
    """
    out = request.out or Path(request.file.stem + world_files.SUFFIX)
    if out.suffix != world_files.SUFFIX:
        raise UsageError(f"--out: expected a file that ends in {world_files.SUFFIX}, got {out}")
    preset = request.preset or (_PRESET if request.objects is None else BARE)
    square = _square(request, preset)
    placed = _placed(request, square)
    name = "".join(each if each.isalnum() or each in "-_." else "_" for each in out.stem)
    world = world_on(name, square, preset, request.seed, request.difficulty, placed)
    atomic_io.write(out, world_files.world_to_bytes(world))
    return {
        "out": str(out),
        "form": "world",
        "crs": square.crs,
        "resolution_m": list(square.resolution),
        "preset": preset,
        "placed": len(placed),
        **world_summary(world),
        "warnings": list(square.remarks),
    }


def elevation_text(data: dict[str, Any]) -> str:
    """Return what became of an elevation model as text, a warning a line."""
    short, long = data["resolution_m"]
    lines = [
        f"{data['crs']}, cells of {short:.3g} x {long:.3g} m; preset {data['preset']}, seed "
        f"{data['seed']}; objects placed: {data['placed']}",
        size_text(data),
        datum_text(data["datum"]),
    ]
    lines += [f"warning: {warning}" for warning in data["warnings"]]
    return "\n".join([*lines, f"world: {data['out']}"])


def _square(request: ElevationRequest, preset: str) -> GroundSquare:
    """Return the square of ground.

    Raises:
        UsageError: If rasterio is not installed.
    """
    cell = request.cell or config_on(preset, request.size).cell
    try:
        return read_square(request.file, request.at, request.size, cell, request.crs)
    except MissingRasterioError as error:
        raise UsageError(
            f"{request.file}: expected rasterio to read a GeoTIFF, got none; install the extra "
            f"`gis` ({install_extra('gis')})"
        ) from error


def _placed(request: ElevationRequest, square: GroundSquare) -> tuple[PlacedObject, ...]:
    """Return the objects that are placed, all of them within the square."""
    if request.objects is None:
        return ()
    frame = square.frame if request.objects_frame == DEGREES else None
    placed = read_objects(request.objects, frame)
    check_inside(request.objects, placed, square.ground.width, square.ground.depth)
    return placed
