"""Export of a recording, or of a drive's run folder, to one file of tracks.

=============== ===================================================================================
suffix          contents
=============== ===================================================================================
.tum            one track: times, positions and rotations, as evo and the TUM benchmarks have it
.geojson        tracks in the map, goals and fixes in WGS 84; refused where no datum is known
.ply .las .laz  one track as points with their times, in its own frame [m]
=============== ===================================================================================
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.exports import geojson
from andabata.exports.tracks import (
    DriveFolder,
    Track,
    bag_geo_reference,
    is_drive_folder,
    read_drive_folder,
    read_tracks,
    tum_text,
)
from andabata.localization.fix_check import check_fixes
from andabata.machine.geo_reference import GeoReference
from andabata.records import topics
from andabata.records.bags import Bag, LeftOut
from andabata.records.messages import NS, fix_of, header_ns
from andabata.runs import atomic_io
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes

GEOJSON, TUM, POINTS = ".geojson", ".tum", (".ply", ".las", ".laz")
SUFFIXES = (TUM, GEOJSON, *POINTS)
"""Suffixes of files that hold tracks."""


@dataclass(frozen=True)
class TrackExport:
    """Result of an export.

    Attributes:
        about: Facts of what was written, ready for JSON.
        left_out: Messages that could not be read.
        notes: Facts that a user should know although no message is missing.
    """

    about: dict[str, Any]
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = ()


def export_tracks(
    source: Path,
    out: Path,
    names: tuple[str, ...] | None = None,
    given: Mapping[str, float] | None = None,
) -> TrackExport:
    """Write the tracks of a recording or of a drive's run folder to a file.

    Args:
        source: Recording, or run folder.
        out: File to write; its suffix, one of ``SUFFIXES``, chooses the format.
        names: Topics of a recording; None for all of Odometry, and in GeoJSON for the fixes too.
            Files of one track take the first: the filter's.
        given: Fields of ``GeoReference`` that the user gives; they take precedence.

    Raises:
        BagError: If the recording has no such track.
        TrackError: If the folder holds no drive, or the format needs what the track lacks.
        OSError: If a file cannot be read or written.
    """
    if is_drive_folder(source):
        return _export_folder(read_drive_folder(source), out, given or {})
    with Bag(source, damaged=True) as bag:
        if out.suffix == GEOJSON:
            about = _write_geojson(out, *_bag_features(bag, names, given or {}))
        else:
            about = _write_track(out, read_tracks(bag, names)[0])
        return TrackExport(about, tuple(bag.left_out), tuple(bag.notes))


def _export_folder(folder: DriveFolder, out: Path, given: Mapping[str, float]) -> TrackExport:
    """Write the track of a drive's run folder."""
    if out.suffix != GEOJSON:
        return TrackExport(_write_track(out, folder.track))
    reference = _reference(folder.reference, given)
    features = [geojson.track_feature(folder.track, reference)]
    height = float(folder.track.positions[0, 2])
    features += geojson.goal_features(folder.goals, reference, height)
    return TrackExport(_write_geojson(out, features, [folder.track]))


def _reference(known: GeoReference | None, given: Mapping[str, float]) -> GeoReference | None:
    """Return the geo reference with what the user gives over what is known."""
    if not given:
        return known
    if known is None:
        return GeoReference(**{"altitude": None, **given})
    return GeoReference(**{**known.model_dump(), **given})


def _bag_features(
    bag: Bag, names: tuple[str, ...] | None, given: Mapping[str, float]
) -> tuple[list[dict[str, Any]], list[Track]]:
    """Return the features of a recording, and its tracks among them."""
    fix_topics = tuple(
        topic
        for topic, (kind, n) in bag.topics.items()
        if kind == topics.FIX.kind and n and (names is None or topic in names)
    )
    fixes = {name: rows for name in fix_topics if len(rows := _fixes(bag, name))}
    features = [geojson.fix_feature(name, rows) for name, rows in fixes.items()]
    wanted = None if names is None else tuple(name for name in names if name not in fix_topics)
    if wanted == ():
        return features, []
    tracks = read_tracks(bag, wanted)
    if wanted is None:  # Dead reckoning has no place on Earth: it is left out where others have.
        tracks = [track for track in tracks if track.frame == "map"] or tracks
    reference = _reference(bag_geo_reference(bag), given)
    lines = [geojson.track_feature(track, reference) for track in tracks]
    height = float(tracks[0].positions[0, 2])
    goals = geojson.goal_features(_goals(bag), reference, height) if wanted is None else []
    return [*lines, *features, *goals], tracks


def _fixes(bag: Bag, name: str) -> NDArray[np.float64]:
    """Return the fixes of a topic that can be used, shape (k, 5)."""
    rows = [
        [header_ns(message.content) / NS, *fix_of(message.content)]
        for message in bag.messages((name,))
    ]
    table = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return table[check_fixes(table).good]


def _goals(bag: Bag) -> NDArray[np.float64]:
    """Return the goals in the map, each once, in their order [m], shape (k, 2)."""
    goals: dict[tuple[float, float], None] = {}
    for message in bag.messages((topics.GOAL.ros1,)):
        if message.content.header.frame_id == "map":
            place = message.content.pose.position
            goals[float(place.x), float(place.y)] = None
    return np.array(list(goals), dtype=np.float64).reshape(-1, 2)


def _write_geojson(
    out: Path, features: list[dict[str, Any]], tracks: list[Track]
) -> dict[str, Any]:
    """Write features; return facts about them."""
    atomic_io.write(out, geojson.feature_collection(features))
    return {
        "file": str(out),
        "tracks": [track.name for track in tracks],
        "features": [each["properties"]["name"] for each in features],
    }


def _write_track(out: Path, track: Track) -> dict[str, Any]:
    """Write one track as poses or as points; return facts about it."""
    if out.suffix == TUM:
        data = tum_text(track).encode()
    else:
        stamps = None if track.stamps_ns is None else track.stamps_ns / NS
        columns = {} if stamps is None else {"stamps": stamps}
        cloud = PointCloud.from_coordinates(track.positions, track.frame, **columns)
        data = cloud_to_bytes(cloud, out.suffix[1:])
    atomic_io.write(out, data)
    return {
        "file": str(out),
        "tracks": [track.name],
        "frame": track.frame,
        "poses": len(track.positions),
        "length_m": round(track.length, 3),
    }
