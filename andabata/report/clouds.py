"""Report of data sets of labelled clouds, with Figures 3 and 5 of Sanchez et al. (2023)."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from andabata.models import shipped_forest
from andabata.report.blocks import Fact, Plot, Table, Text
from andabata.report.columns import several
from andabata.report.folder import read_about
from andabata.report.page import Page, Section
from andabata.report.plots.perception import labelled_figure, scan_figure
from andabata.scanning.scan import ScanConfig, scan_cloud
from traversability.dataset import CloudEntry, Manifest, Split, read_clouds, read_manifest
from traversability.grid import PolarGrid
from traversability.labels import label_cells, nontraversable

Row = dict[str, Any]

PAPER_CLOUDS = {"clouds": 15, "free": 2922, "blocked": 1191, "empty": 687}
"""Clouds and cells of the paper: ten clouds for training, five for validation (section 3)."""

_SHOWN = 4
"""Number of clouds that are shown, each of another kind of world."""

_SPLITS: tuple[Split, Split] = ("train", "validation")

_SPLITS_TEXT = (
    "A world is on one side of the split only. The rule calls a point an obstacle that stands "
    "0.2 m over the lower quartile of its cell: its F1 says how hard the clouds are."
)

_EXAMPLES_TEXT = "Points by their label, and the cells that follow from them (Fig. 3)."

_NOT_COUNTED = "Cells were not counted: the clouds are of an earlier version; make them again."


def report_clouds(folder: Path) -> tuple[Page, Row]:
    """Return a page about a data set of labelled clouds, and its figures.

    Args:
        folder: Folder of the data set.

    Raises:
        DatasetError: If there is no data set, or it is damaged.
    """
    manifest = read_manifest(folder)
    cells = read_about(folder).get("cells") or {}
    splits = [split for split in _SPLITS if manifest.of(split)]
    rows = [_split_row(split, manifest.of(split), cells.get(split)) for split in splits]
    kinds = dict.fromkeys(entry.world for entry in manifest.clouds)
    worlds = [_world_row(world, manifest) for world in kinds]
    table = Table([*rows, {"split": "paper, both", **PAPER_CLOUDS}] if cells else rows)
    sections = [
        Section("Splits", _SPLITS_TEXT, table, None if cells else Text(_NOT_COUNTED)),
        Section("Worlds", "", Table(worlds)),
        Section("Examples", _EXAMPLES_TEXT, *_examples(folder, manifest)),
    ]
    lead = f"{len(manifest.clouds)} clouds, seed {manifest.seed}."
    page = Page("Labelled clouds", lead, [_fact(row) for row in rows], sections)
    return page, {"splits": rows, "worlds": worlds}


def _split_row(split: str, entries: Sequence[CloudEntry], cells: Row | None) -> Row:
    """Return the figures of a split."""
    row: Row = {
        "split": split,
        "clouds": len(entries),
        "worlds": len({(entry.world, entry.world_seed) for entry in entries}),
        "points": sum(entry.points for entry in entries) / len(entries),
    }
    if cells is None:
        return row
    hits, wrong = cells["rule_hits"], cells["rule_false_alarms"] + cells["rule_misses"]
    rule = 2 * hits / max(2 * hits + wrong, 1)
    return row | {name: cells[name] for name in ("free", "blocked", "empty")} | {"rule_f1": rule}


def _world_row(world: str, manifest: Manifest) -> Row:
    """Return how many clouds a kind of world has."""
    mine = [entry for entry in manifest.clouds if entry.world == world]
    return {
        "world": world,
        **{split: sum(entry.split == split for entry in mine) for split in _SPLITS},
        "points": sum(entry.points for entry in mine) / len(mine),
    }


def _examples(folder: Path, manifest: Manifest) -> Iterator[Plot]:
    """Yield one cloud of several kinds of world with its labels, and the first as it is scanned."""
    first = {entry.world: entry for entry in reversed(manifest.clouds)}
    chosen = sorted(first.values(), key=lambda entry: entry.file)[:_SHOWN]
    grid = PolarGrid()
    for entry in chosen:
        one = manifest.model_copy(update={"clouds": (entry,)})
        (cloud,) = read_clouds(folder, one, entry.split)
        labels = nontraversable(cloud)
        cells = label_cells(cloud.points, labels, grid)
        title = f"{entry.world} {entry.world_seed}"
        figure = labelled_figure(cloud.points, labels, cells, grid, title)
        yield Plot(figure, f"labels-{entry.world}", f"{entry.file}: {title} (Fig. 3)")
        if entry is chosen[0]:
            figure = scan_figure(scan_cloud(cloud, ScanConfig(), shipped_forest()), title)
            caption = f"{entry.file}: what the shipped classifier makes of it (Fig. 5)"
            yield Plot(figure, "scan", caption)


def _fact(row: Row) -> Fact:
    """Return the size of a split."""
    text = f"of {row['worlds']} worlds, {row['points']:.0f} points each"
    return Fact(row["split"], several(row["clouds"], "cloud").lower(), text)
