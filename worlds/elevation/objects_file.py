"""Files of objects: GeoJSON points (RFC 7946) that say what stands where.

``kind`` names the object, and some kinds take sizes; what is not given is drawn. Other properties
are ignored.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from terrain.furniture import bench, bin_, lamp, table
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from terrain.plants import boulder, bush, fallen_trunk, grass, stone, tree
from terrain.stands import stand
from terrain.stems import sapling, shrub
from worlds.elevation.errors import ElevationError
from worlds.elevation.local_frame import WGS_84, LocalFrame
from worlds.natural import Maker

_STREAM = 1_000
"""Number of the stream of seeds of placed objects, which no preset has."""


class _Kind(NamedTuple):
    """Generator of a kind of object, and the sizes that it takes."""

    make: Maker
    sizes: tuple[str, ...] = ()


_KINDS: Mapping[str, _Kind] = MappingProxyType(
    {
        "tree": _Kind(tree, ("height", "radius", "crown_radius")),
        "bush": _Kind(bush, ("height", "radius")),
        "grass": _Kind(grass, ("height", "radius")),
        "rock": _Kind(boulder, ("height", "radius")),
        "log": _Kind(fallen_trunk, ("length", "radius", "yaw_deg")),
        "stone": _Kind(stone),
        "stand": _Kind(stand),
        "shrub": _Kind(shrub),
        "sapling": _Kind(sapling),
        "lamp": _Kind(lamp),
        "bench": _Kind(bench),
        "table": _Kind(table),
        "bin": _Kind(bin_),
    }
)

KINDS = tuple(_KINDS)
"""Kinds of objects."""


class _Properties(BaseModel):
    """Properties of a feature that are read.

    Attributes:
        kind: Kind of object.
        height: Height over the ground [m]; of a tree that of its trunk.
        radius: Radius at the ground [m]; of a tree or log that of the trunk.
        crown_radius: Radius of a tree's crown [m].
        length: Length of a log [m], one end of which is at its place.
        yaw_deg: Direction of a log from there [deg], 0 = east, counter-clockwise.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    kind: str
    height: float | None = Field(default=None, ge=0.02, le=60)
    radius: float | None = Field(default=None, ge=0.01, le=10)
    crown_radius: float | None = Field(default=None, ge=0.05, le=20)
    length: float | None = Field(default=None, ge=0.1, le=40)
    yaw_deg: float | None = Field(default=None, ge=-360, le=360)

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes that are given, by name."""
        return self.model_dump(exclude={"kind"}, exclude_none=True)


@dataclass(frozen=True)
class PlacedObject:
    """An object at a place.

    Attributes:
        kind: Kind of object, one of ``KINDS``.
        x: Map x [m].
        y: Map y [m].
        sizes: Arguments of its generator that are given.
    """

    kind: str
    x: float
    y: float
    sizes: Mapping[str, float]


def read_objects(path: Path, frame: LocalFrame | None) -> tuple[PlacedObject, ...]:
    """Return the objects of a GeoJSON file.

    Args:
        path: File.
        frame: Frame of the world on Earth; None if coordinates are the world's own, in metres.

    Raises:
        ElevationError: If it is not GeoJSON of points with known kinds and sizes.
        OSError: If it cannot be read.
    """
    data = _document(path)
    features = data.get("features") if data.get("type") == "FeatureCollection" else [data]
    if not isinstance(features, list) or not features:
        raise ElevationError(f"{path}: expected features, got none")
    properties = [_properties(path, k, each) for k, each in enumerate(features)]
    places = np.array([_place(path, k, each) for k, each in enumerate(features)])
    if frame is not None:
        places = _in_frame(path, data, places, frame)
    return tuple(
        PlacedObject(one.kind, x, y, _arguments(path, k, one))
        for k, (one, (x, y)) in enumerate(zip(properties, places.tolist(), strict=True))
    )


def check_inside(path: Path, objects: Sequence[PlacedObject], width: float, depth: float) -> None:
    """Refuse objects outside of a world.

    Args:
        path: File, for the error.
        objects: Objects.
        width: Extent of the world along x [m].
        depth: Extent of the world along y [m].

    Raises:
        ElevationError: If there is one; the text gives their number and the first.
    """
    outside = [
        k for k, each in enumerate(objects) if abs(each.x) > width / 2 or abs(each.y) > depth / 2
    ]
    if outside:
        first = objects[outside[0]]
        raise ElevationError(
            f"{path}: expected objects within {width / 2:g} m east and west and {depth / 2:g} m "
            f"north and south of the world's middle, got {len(outside)} of {len(objects)} outside, "
            f"the first feature {outside[0]} ({first.kind}) at x {first.x:.1f}, y {first.y:.1f} m; "
            f"remove them, or take a larger --size or another --at"
        )


def make_objects(
    objects: Sequence[PlacedObject], ground: Heightfield, seed: int
) -> list[SceneObject]:
    """Return the parts of objects on the ground; each draws what is not given from its own stream.

    Args:
        objects: Objects.
        ground: Ground of the world.
        seed: Seed of the world.
    """
    streams = np.random.SeedSequence([_STREAM, seed]).spawn(len(objects))
    parts: list[SceneObject] = []
    for each, stream in zip(objects, streams, strict=True):
        rng = np.random.default_rng(stream)
        parts += _KINDS[each.kind].make(ground, each.x, each.y, rng, **each.sizes)
    return parts


def _document(path: Path) -> dict[str, Any]:
    """Return the top object of a GeoJSON file.

    Raises:
        ElevationError: If it is not a collection of features, or a feature.
    """
    try:
        data = json.loads(path.read_bytes())
    except (ValueError, RecursionError) as error:
        raise ElevationError(f"{path}: expected GeoJSON, got no JSON ({error})") from error
    kind = data.get("type") if isinstance(data, dict) else None
    if kind not in ("FeatureCollection", "Feature"):
        raise ElevationError(f"{path}: expected a GeoJSON FeatureCollection, got {kind!r}")
    return dict(data)


def _properties(path: Path, number: int, feature: object) -> _Properties:
    """Return the properties of a feature.

    Raises:
        ElevationError: If a value is no size, or the kind is not known.
    """
    given = feature.get("properties") if isinstance(feature, dict) else None
    try:
        properties = _Properties.model_validate(given or {})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        name = ".".join(map(str, first["loc"])) or "properties"
        raise ElevationError(f"{path}: feature {number}: {name}: {first['msg']}") from error
    if properties.kind not in _KINDS:
        raise ElevationError(
            f"{path}: feature {number}: expected kind {', '.join(_KINDS)}, got {properties.kind!r}"
        )
    return properties


def _arguments(path: Path, number: int, properties: _Properties) -> dict[str, float]:
    """Return the sizes of an object as its generator takes them.

    Raises:
        ElevationError: If its kind does not take one of them.
    """
    sizes, known = properties.sizes, _KINDS[properties.kind].sizes
    for name in sizes:
        if name not in known:
            raise ElevationError(
                f"{path}: feature {number}: expected {', '.join(known) or 'no sizes'} of a "
                f"{properties.kind}, got {name}; remove it"
            )
    if "yaw_deg" in sizes:
        sizes["yaw"] = float(np.deg2rad(sizes.pop("yaw_deg")))
    return sizes


def _place(path: Path, number: int, feature: object) -> tuple[float, float]:
    """Return the coordinates of a point; a third one, the altitude, is that of the ground.

    Raises:
        ElevationError: If it is no point.
    """
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    values = geometry.get("coordinates") if isinstance(geometry, dict) else None
    if kind != "Point":
        raise ElevationError(f"{path}: feature {number}: expected a Point, got {kind!r}")
    try:
        x, y = (float(each) for each in list(values or ())[:2])
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise ElevationError(f"{path}: feature {number}: expected two coordinates, got {values!r}")
    return x, y


def _in_frame(
    path: Path, data: Mapping[str, Any], places: NDArray[np.float64], frame: LocalFrame
) -> NDArray[np.float64]:
    """Return places of a file in the frame of the world [m], shape (n, 2).

    Raises:
        ElevationError: If coordinates are not degrees, or their system is not known.
    """
    # A member of GeoJSON of 2008 that exporters still write.
    named = (data.get("crs") or {}).get("properties", {}).get("name")
    far = np.abs(places) > [360.0, 90.0]
    if named is None and far.any():
        number = int(far.any(axis=1).argmax())
        raise ElevationError(
            f"{path}: feature {number}: expected longitude and latitude in degrees, got "
            f"{places[number].tolist()}; convert it: ogr2ogr -t_srs EPSG:4326 degrees.geojson "
            f"{path.name}, or say that they are the world's metres"
        )
    try:
        x, y = frame.of(named or WGS_84, places[:, 0], places[:, 1])
    except ValueError as error:
        raise ElevationError(f"{path}: expected a known crs, got {named!r}") from error
    return np.column_stack([x, y])
