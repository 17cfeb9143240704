"""Report of drives, with Figures 5, 18 and 20 to 23 of Sanchez et al. (2023)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.models import shipped_forest
from andabata.report.blocks import Fact, Picture, Plot, Table, Text
from andabata.report.columns import word
from andabata.report.folder import read_about, read_result
from andabata.report.options import ReportOptions
from andabata.report.page import Page, Section
from andabata.report.plots.drive_estimate import estimate_figure, has_estimate
from andabata.report.plots.drive_traces import (
    Trace,
    headings_figure,
    motion_figure,
    stamps_of,
    trace_of,
)
from andabata.report.plots.drives import drive_figure, world_figure
from andabata.report.plots.perception import scan_figure
from andabata.report.run_folders import DRIVE, LAST_CLOUD, without_paths
from andabata.scanning.scan import ScanConfig, scan_cloud
from traversability.files import read_cloud
from worlds.catalogue import make_world
from worlds.world import World

Row = dict[str, Any]

_KEYS = ("controller", "world", "world_seed", "goals", "attempts", "path")

_PERIOD = 0.1
"""Time from one position of a path to the next [s]."""

_STAMPS = 8
"""Number of time stamps along a path, at most."""

_LARGEST_CLIP = 8_000_000
"""Largest clip that a page takes in [bytes]."""

_GOALS_TEXT = "In a row until one fails. SPL is success weighted by path length."

_ESTIMATE_TEXT = (
    "The robot's own estimate against the truth: an estimate that knows itself is within two sigma "
    "for 86 % of the time. Where its health was not ok the background is coloured."
)

_WORLD_TEXT = "Starts and goals of its tasks, forbidden ground by reason (Fig. 20)."

ATTEMPT_COLUMNS = (
    "goal",
    "outcome",
    "time_s",
    "distance_m",
    "shortest_m",
    "spl",
    "trespass_m",
    "min_clearance_m",
)
"""Columns of an attempt that are not folded."""


@dataclass(frozen=True)
class DriveRun:
    """A drive, read from its folder.

    Attributes:
        folder: Path of the folder.
        name: Name of the drive in the figures.
        data: Result of the drive.
    """

    folder: Path
    name: str
    data: Mapping[str, Any]

    @property
    def path(self) -> NDArray[np.float64]:
        """Positions [m], one a control step, shape (k, 3)."""
        return np.array(self.data["path"], dtype=np.float64)

    @property
    def trace(self) -> Trace | None:
        """Motion over time; None in folders of earlier versions."""
        found = self.data.get("trace")
        return trace_of(found) if found else None

    @property
    def clip(self) -> Path | None:
        """Clip of the drive, None if there is none, or it is too large for a page."""
        name = self.data.get("clip")
        places = [Path(name), self.folder / Path(name).name] if name else []
        there = [path for path in places if path.is_file() and path.suffix in (".gif", ".mp4")]
        return there[0] if there and there[0].stat().st_size <= _LARGEST_CLIP else None


def report_drives(folders: Sequence[Path], _: ReportOptions) -> tuple[Page, Row]:
    """Return a page about drives in one world, and its figures.

    Args:
        folders: Folders of the drives; several are compared.

    Raises:
        RunFolderError: If a folder holds no finished drive.
        ValueError: If the worlds differ.
    """
    runs = _read(folders)
    first = runs[0].data
    world = make_world(first["world"], first["world_seed"])
    where = f"{first['world']} {first['world_seed']}"
    title = "A drive" if len(runs) == 1 else f"{len(runs)} drives side by side"
    rows = [{"drive": run.name, **each} for run in runs for each in run.data["attempts"]]
    sections = [
        _paths(runs, world, where),
        _clips(runs),
        _goals(rows, len(runs) > 1),
        _motion(runs),
        _estimates(runs),
        _last_cloud(runs[0]),
        Section(
            "The world",
            _WORLD_TEXT,
            Plot(world_figure(world), "world", f"{where} from above and in 3D"),
        ),
    ]
    lead = "Measured by physics and the true map of the world."
    page = Page(f"{title} in {where}", lead, [_fact(run) for run in runs], sections)
    return page, {"drives": [without_paths(run.data) for run in runs], "goals": rows}


def _read(folders: Sequence[Path]) -> list[DriveRun]:
    """Return drives in one world, each with a name of its own.

    Raises:
        RunFolderError: If a folder holds no finished drive.
        ValueError: If the worlds differ.
    """
    found = {folder: read_result(folder, DRIVE, _KEYS) for folder in folders}
    first = found[folders[0]]
    for folder, data in found.items():
        read_about(folder)
        if any(data[key] != first[key] for key in ("world", "world_seed")):
            raise ValueError(
                f"{folder}: expected a drive in {first['world']} {first['world_seed']} as the "
                f"first, got {data['world']} {data['world_seed']}; give it a report of its own"
            )
    names = [data["controller"] for data in found.values()]
    return [
        DriveRun(folder, name if names.count(name) == 1 else f"{name}, {folder.name}", data)
        for name, (folder, data) in zip(names, found.items(), strict=True)
    ]


def _fact(run: DriveRun) -> Fact:
    """Return how many goals a drive reached, and how long it took."""
    attempts = run.data["attempts"]
    reached = sum(attempt["outcome"] == "goal" for attempt in attempts)
    time, way = (sum(attempt[key] for attempt in attempts) for key in ("time_s", "distance_m"))
    goals = len(run.data["goals"])
    return Fact(run.name, f"{reached} of {goals} goals", f"{time:.0f} s, {way:.0f} m")


def _paths(runs: Sequence[DriveRun], world: World, where: str) -> Section:
    """Return the paths on the true map, the first one with stamps (Fig. 18, 21, 22)."""
    first, *others = runs
    path = first.path
    every = max(_round_time(len(path) * _PERIOD / _STAMPS), 10.0)
    figure = drive_figure(
        world,
        path,
        first.data["goals"],
        f"{first.name} in {where}",
        {run.name: run.path for run in others},
        stamps=stamps_of(path, _PERIOD, every),
        name=first.name if others else "driven",
    )
    number = "Fig. 22" if others else "Fig. 18, 21"
    text = f"Time and distance stand beside the path, as in the paper's {number}."
    plot = Plot(figure, "path", f"Path on the true map ({number})", drawn=True, light=True)
    return Section("Path", text, plot)


def _round_time(seconds: float) -> float:
    """Return a time of about so many seconds that people count in [s]."""
    return min((10.0, 20.0, 30.0, 60.0, 120.0, 300.0), key=lambda one: abs(one - seconds))


def _clips(runs: Sequence[DriveRun]) -> Section:
    """Return the clips of drives that have some, else say how one is made (in place of Fig. 19)."""
    found = {run.name: run.clip for run in runs if run.clip is not None}
    text = "" if found else "There is none: drive --clip FILE.gif makes one."
    caption = "from behind the robot (Fig. 19)"
    films = [
        Picture(clip.read_bytes(), f"{name}: {caption}", clip.suffix[1:], f"clip-{name}")
        for name, clip in found.items()
    ]
    return Section("Moving picture", text, *films)


def _goals(rows: Sequence[Row], compared: bool) -> Section:
    """Return the attempts of the drives, and how those that failed ended."""
    columns = (*(("drive",) if compared else ()), *ATTEMPT_COLUMNS)
    failures = " ".join(_failure(row) for row in rows if row["outcome"] != "goal")
    table = Table(rows, columns, every="All columns")
    return Section("Goals", _GOALS_TEXT, table, Text(failures) if failures else None)


def _failure(row: Row) -> str:
    """Return how an attempt failed, in words."""
    touched = (word(row.get("contact", "")), row.get("walker", ""))
    contact = f" ({', '.join(filter(None, touched))})" if row.get("contact") else ""
    return f"{row['drive']}, goal {row['goal']}: {word(row['outcome'])}{contact}."


def _motion(runs: Sequence[DriveRun]) -> Section:
    """Return headings, steering, speed and error of the pose over time (Fig. 23)."""
    traces = {run.name: run.trace for run in runs}
    known = {name: trace for name, trace in traces.items() if trace is not None}
    if not known:
        return Section(
            "Motion", "The drive is of an earlier version, without its motion over time."
        )
    text = "Yaw rate, speed, and how far the estimated position is from the true one"
    return Section(
        "Motion",
        "True values, twice a second. Move over a line to read it.",
        Plot(headings_figure(known), "headings", "Heading over time (Fig. 23)", drawn=True),
        Plot(motion_figure(known), "motion", text, drawn=True),
    )


def _estimates(runs: Sequence[DriveRun]) -> Section | None:
    """Return what each robot believed of itself over time; None in earlier versions' folders."""
    traces = {run.name: run.trace for run in runs}
    plots = [
        Plot(estimate_figure(trace), f"estimate-{name}", f"{name}: errors of its own estimate")
        for name, trace in traces.items()
        if trace is not None and has_estimate(trace)
    ]
    return Section("What it believed", _ESTIMATE_TEXT, *plots) if plots else None


def _last_cloud(run: DriveRun) -> Section | None:
    """Return the last cloud with its cells and virtual ranges, by the shipped forest (Fig. 5)."""
    path = run.folder / LAST_CLOUD
    if not path.is_file():
        return None
    figure = scan_figure(scan_cloud(read_cloud(path), ScanConfig(), shipped_forest()), "last cloud")
    text = "Points, the state of each cell, and the virtual ranges (Fig. 5)."
    return Section("Last cloud", text, Plot(figure, "scan", f"Last cloud of {run.name} (Fig. 5)"))
