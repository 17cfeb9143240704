"""Tracks, goals and satellite fixes as GeoJSON (RFC 7946): longitude, latitude, altitude."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.exports.tracks import Track, TrackError
from andabata.machine.geo_reference import GeoReference
from andabata.records.messages import NS
from andabata.runs.strict_json import dumps

_DEGREES, _METRES = 9, 3
"""Decimals of an angle, a tenth of a millimetre on the ground, and of an altitude."""


def feature_collection(features: list[dict[str, Any]]) -> bytes:
    """Return features as a GeoJSON file.

    Raises:
        TrackError: If there are none.
    """
    if not features:
        raise TrackError("features: expected a track, goals or fixes, got none; choose --topic")
    return dumps({"type": "FeatureCollection", "features": features}).encode()


def track_feature(track: Track, reference: GeoReference | None) -> dict[str, Any]:
    """Return a track of the map as a line.

    Args:
        track: The track.
        reference: Geo reference of the map; None if it is unknown.

    Raises:
        TrackError: If the track is not in the map, or the map has no place on Earth.
    """
    if track.frame != "map":
        raise TrackError(
            f"{track.name}: expected poses in the frame map for GeoJSON, got {track.frame!r}, "
            "which drifts and has no north; choose a topic in map, or the fixes, by --topic"
        )
    places = _geodetic(track.positions, _known(reference, track.name))
    about: dict[str, Any] = {"name": track.name, "length_m": round(track.length, _METRES)}
    if track.stamps_ns is not None:
        begin, end = int(track.stamps_ns[0]), int(track.stamps_ns[-1])
        about |= {"begin": _time(begin), "end": _time(end)}
        about["duration_s"] = round((end - begin) / NS, _METRES)
    return _line(places, about)


def goal_features(
    goals: NDArray[np.float64], reference: GeoReference | None, height: float
) -> list[dict[str, Any]]:
    """Return goals in the map as points.

    Args:
        goals: Goals [m], shape (k, 2).
        reference: Geo reference of the map; None if it is unknown.
        height: Height in the map that stands in for the ground's [m].

    Raises:
        TrackError: If the map has no place on Earth.
    """
    if not len(goals):
        return []
    full = np.column_stack([goals, np.full(len(goals), height)])
    places = _geodetic(full, _known(reference, "goals"))
    return [
        _feature("Point", place[:2], {"name": f"goal {k}"}) for k, place in enumerate(places, 1)
    ]


def fix_feature(name: str, fixes: NDArray[np.float64]) -> dict[str, Any]:
    """Return satellite fixes as a line; they need no datum.

    Args:
        name: Topic of the fixes.
        fixes: Rows as in ``SensorReadings.gnss``, those that can be used, shape (k, 5).
    """
    altitudes_known = bool(np.isfinite(fixes[:, 3]).all())
    columns = [2, 1, 3] if altitudes_known else [2, 1]
    return _line(_rounded(fixes[:, columns]), {"name": name, "fixes": len(fixes)})


def _known(reference: GeoReference | None, name: str) -> GeoReference:
    """Return the geo reference.

    Raises:
        TrackError: If there is none.
    """
    if reference is None:
        raise TrackError(
            f"{name}: expected a datum that places the map on Earth, got none; give its origin by "
            "--datum LAT,LON, or write .tum, .ply or .las, which need none"
        )
    return reference


def _geodetic(points: NDArray[np.float64], reference: GeoReference) -> list[list[float]]:
    """Return longitude, latitude and, where it is known, altitude of points of the map [m]."""
    coordinates = reference.to_geodetic(points)[:, [1, 0, 2]]
    return _rounded(coordinates if reference.altitude is not None else coordinates[:, :2])


def _rounded(places: NDArray[np.float64]) -> list[list[float]]:
    """Return longitudes, latitudes and altitudes with the decimals that mean something."""
    decimals = (_DEGREES, _DEGREES, _METRES)
    return [
        [round(float(value), n) for value, n in zip(row, decimals, strict=False)] for row in places
    ]


def _line(places: list[list[float]], about: dict[str, Any]) -> dict[str, Any]:
    """Return places as a line; a single one, which makes no line, as a point."""
    if len(places) == 1:
        return _feature("Point", places[0], about)
    return _feature("LineString", places, about)


def _feature(kind: str, coordinates: list[Any], about: dict[str, Any]) -> dict[str, Any]:
    """Return a feature."""
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "geometry": geometry, "properties": about}


def _time(stamp_ns: int) -> str:
    """Return a stamp [ns] after ISO 8601, to the millisecond."""
    return datetime.fromtimestamp(stamp_ns / NS, UTC).isoformat(timespec="milliseconds")
