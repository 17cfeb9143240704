"""Exports of ``bag export``: the suffix of the output chooses what is written.

================ ==================================================================================
``--out``        contents
================ ==================================================================================
a folder         clouds as PLY, LAS, LAZ or PCD, everything else as CSV
.rrd             scene, map, plan and plots for rerun's viewer
.tum             one track with times and rotations
.geojson         tracks, goals and fixes in WGS 84
.ply .las .laz   one track as points
================ ==================================================================================
"""

import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from andabata.app.options.datum import datum_fields
from andabata.app.tables import left_out_notes
from andabata.configuration.usage import UsageError, one_word
from andabata.exports.rerun_file import SUFFIX as RERUN
from andabata.exports.rerun_file import export_rerun
from andabata.exports.topics import CLOUD_KINDS, export_bag
from andabata.exports.track_file import GEOJSON, POINTS, SUFFIXES, export_tracks
from andabata.exports.tracks import is_drive_folder
from andabata.records.bags import LeftOut

_FILES = (RERUN, *SUFFIXES)
# A folder may be called drive.2: what looks like a suffix begins with a letter and is short.
_LOOKS_LIKE_A_FILE = re.compile(r"\.[A-Za-z][A-Za-z0-9]{0,7}")


@dataclass(frozen=True)
class ExportRequest:
    """What to export.

    Attributes:
        source: Recording, or run folder of a drive.
        out: File or folder to write.
        topics: Topics to export; None for all that the format has room for.
        clouds: Format of the clouds in a folder; None for PLY.
        datum: Origin of the map as the user gives it; None for the recorded one.
    """

    source: Path
    out: Path
    topics: tuple[str, ...] | None = None
    clouds: str | None = None
    datum: str | None = None

    def check(self) -> None:
        """Check that the options fit each other.

        Raises:
            UsageError: If the suffix is unknown, or an option has no meaning with it.
        """
        suffix = self.out.suffix
        is_folder = suffix not in _FILES
        if is_folder and _LOOKS_LIKE_A_FILE.fullmatch(suffix) and not self.out.is_dir():
            raise UsageError(
                f"--out: expected a folder, or a file in {', '.join(_FILES)}, got {self.out}; for "
                "a folder choose a name without a suffix"
            )
        of_folder = (GEOJSON, *POINTS)
        if is_drive_folder(self.source) and suffix not in of_folder:
            raise UsageError(
                f"--out: expected a file in {', '.join(of_folder)} for a drive's run folder, which "
                "holds places without times and rotations, got "
                f"{self.out}; record the drive with --record for more"
            )
        if self.clouds is not None and not is_folder:
            raise UsageError(f"--clouds: expected with a folder only, got {self.out}")
        if self.clouds is not None:
            one_word(self.clouds, CLOUD_KINDS, "--clouds")
        if self.datum is not None and suffix != GEOJSON:
            raise UsageError(f"--datum: expected with {GEOJSON} only, got {self.out}")
        if self.topics is not None and suffix == RERUN:
            raise UsageError(f"--topic: expected no topic with {RERUN}, got {self.topics[0]}")


@dataclass(frozen=True)
class Exported:
    """What an export wrote.

    Attributes:
        data: Result, ready for JSON.
        text: Result in words.
        left_out: Messages that could not be read or written.
    """

    data: dict[str, Any]
    text: str
    left_out: tuple[LeftOut, ...]


def export(request: ExportRequest, on_message: Callable[[], None]) -> Exported:
    """Write what is asked for.

    Args:
        request: The request.
        on_message: Function called after each message.

    Raises:
        UsageError: If options contradict each other.
        BagError: If the recording lacks what is asked for.
        TrackError: If the format needs what the track lacks.
        RerunError: If rerun's SDK is not installed.
        OSError: If a file cannot be read or written.
    """
    request.check()
    if request.out.suffix == RERUN:
        return _to_rerun(request, on_message)
    if request.out.suffix in SUFFIXES:
        return _to_track(request)
    kind = request.clouds or CLOUD_KINDS[0]
    exported = export_bag(request.source, request.out, request.topics, on_message, kind)
    data = {"files": [str(path) for path in exported.files]}
    line = f"{len(exported.files)} files in {request.out}"
    return _exported(data, line, exported.left_out, exported.notes)


def _to_rerun(request: ExportRequest, on_message: Callable[[], None]) -> Exported:
    """Write a file for rerun; polar cells come from the shipped classifier."""
    # Loaded here: no other format needs cells, and the forest takes longer than the rest.
    from andabata.models import shipped_forest
    from traversability.grid import PolarGrid
    from traversability.scanner import TraversabilityScanner

    grid = PolarGrid()
    scanner = TraversabilityScanner(shipped_forest(), grid)
    exported = export_rerun(request.source, request.out, scanner.scan, grid, on_message)
    data = {"file": str(request.out), "entities": exported.entities}
    line = f"{len(exported.entities)} entities in {request.out}; open it by `rerun {request.out}`"
    return _exported(data, line, exported.left_out, exported.notes)


def _to_track(request: ExportRequest) -> Exported:
    """Write a file of tracks."""
    given = datum_fields(request.datum)
    exported = export_tracks(request.source, request.out, request.topics, given)
    names = exported.about.get("features") or exported.about["tracks"]
    line = f"{', '.join(names)} in {request.out}"
    return _exported(exported.about, line, exported.left_out, exported.notes)


def _exported(
    data: dict[str, Any], line: str, left_out: tuple[LeftOut, ...], notes: tuple[str, ...]
) -> Exported:
    """Return a result with what was left out."""
    data |= {"left_out": [asdict(each) for each in left_out], "notes": list(notes)}
    return Exported(data, "\n".join([line, *left_out_notes(left_out, notes)]), left_out)
