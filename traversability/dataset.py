"""Data set of labelled clouds: a manifest with hashes and splits, and the cells for training."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from traversability.cloud import PointCloud
from traversability.features import cell_features
from traversability.files import read_cloud
from traversability.grid import PolarGrid
from traversability.labels import (
    CellState,
    beyond_doubt,
    label_cells,
    nontraversable,
    object_points,
)

MANIFEST = "manifest.json"
"""Name of the manifest's file in the folder of a data set."""

Split = Literal["train", "validation"]
"""Name of a part of a data set."""


class DatasetError(ValueError):
    """A folder that holds no data set of labelled clouds."""


class CloudEntry(BaseModel):
    """One cloud of a data set.

    Attributes:
        file: Name of the cloud's file in the folder.
        sha256: SHA-256 of the file.
        split: Split that the cloud belongs to.
        world: Preset of the cloud's world.
        world_seed: Seed of the cloud's world; a world belongs to one split only.
        points: Number of points.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str = Field(pattern=r"^[A-Za-z0-9_.-]+$")
    sha256: str = Field(pattern=r"^[0-9a-f]{64}$")
    split: Split
    world: str
    world_seed: int
    points: int = Field(ge=0)


class Manifest(BaseModel):
    """Contents of a data set and the configuration that it was made with.

    Attributes:
        version: Version of the manifest's format.
        seed: Seed of the whole set.
        config: Resolved configuration, ready for JSON.
        config_sha256: Hash of the configuration; see ``config_hash``.
        clouds: Clouds in the order of their files.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    version: Literal[1] = 1
    seed: int
    config: dict[str, Any]
    config_sha256: str
    clouds: tuple[CloudEntry, ...]

    def of(self, split: Split) -> tuple[CloudEntry, ...]:
        """Return the clouds of a split, in order."""
        return tuple(entry for entry in self.clouds if entry.split == split)

    def to_bytes(self) -> bytes:
        """Return the bytes of the manifest's file."""
        return (
            json.dumps(self.model_dump(mode="json"), indent=1, sort_keys=True, allow_nan=False)
            + "\n"
        ).encode()


def config_hash(config: dict[str, Any]) -> str:
    """Return the SHA-256 of a configuration."""
    return hashlib.sha256(json.dumps(config, sort_keys=True).encode()).hexdigest()


def read_manifest(folder: Path) -> Manifest:
    """Return the manifest of a folder.

    Args:
        folder: Folder of the data set.

    Raises:
        DatasetError: If there is none, it is damaged, or a world is on both sides of the split.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise DatasetError(
            f"{path}: expected the manifest of labelled clouds, got no such file; make some with "
            "`andabata clouds generate`"
        )
    try:
        manifest = Manifest.model_validate_json(path.read_bytes())
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise DatasetError(
            f"{path}: {place}: expected a manifest of version 1, got: {first['msg']}; make the "
            "clouds again"
        ) from error
    sides: dict[tuple[str, int], Split] = {}
    for entry in manifest.clouds:
        if sides.setdefault((entry.world, entry.world_seed), entry.split) != entry.split:
            raise DatasetError(
                f"{path}: expected each world on one side of the split, got {entry.world} "
                f"{entry.world_seed} on both"
            )
    return manifest


def every_second_world(manifest: Manifest, split: Split) -> tuple[Manifest, Manifest]:
    """Return the clouds of a split in two halves that have no world in common.

    Args:
        manifest: Manifest of the data set.
        split: Split to halve.

    Returns:
        Two manifests: the worlds at even and at odd places, in the order of their first clouds.
    """
    entries = manifest.of(split)
    worlds = {(entry.world, entry.world_seed): None for entry in entries}
    first = set(list(worlds)[::2])
    halves = [
        tuple(entry for entry in entries if ((entry.world, entry.world_seed) in first) == wanted)
        for wanted in (True, False)
    ]
    one, other = (manifest.model_copy(update={"clouds": half}) for half in halves)
    return one, other


def read_clouds(
    folder: Path, manifest: Manifest, split: Split, on_cloud: Callable[[], object] | None = None
) -> Iterator[PointCloud]:
    """Yield the labelled clouds of a split, their hashes checked.

    Args:
        folder: Folder of the data set.
        manifest: Manifest of the data set.
        split: Split whose clouds are read.
        on_cloud: Callback after each cloud has been used, for progress bars.

    Raises:
        DatasetError: If a file is missing, is not the one of the manifest, or has no labels.
    """
    for entry in manifest.of(split):
        path = folder / entry.file
        if not path.is_file():
            raise DatasetError(f"{path}: expected a cloud of the manifest, got no such file")
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        if sha256 != entry.sha256:
            raise DatasetError(
                f"{path}: expected SHA-256 {entry.sha256[:12]}..., got {sha256[:12]}...; the file "
                "was changed or damaged, make the clouds again"
            )
        cloud = read_cloud(path)
        if cloud.nontraversable is None:
            raise DatasetError(f"{path}: expected labelled points, got none")
        yield cloud
        if on_cloud:
            on_cloud()


@dataclass(frozen=True)
class CellSamples:
    """Labelled cells of several clouds, without the empty ones.

    Attributes:
        features: Features in the order of ``ALL_FEATURES``, float32, shape (n, f).
        blocked: True for non-traversable cells, bool, shape (n,).
        clear: True for cells whose label is beyond doubt: it is the same with the limits moved by
            their margins and with 5 to 30 % of bad points for 15 %. bool, shape (n,).
        n_empty: Number of empty cells that were left out.
        ring: Ring of each cell, int32, shape (n,).
        cloud: Number of the cloud of each cell, int32, shape (n,).
        world: Seed of the world of each cell, int64, shape (n,).
    """

    features: NDArray[np.float32]
    blocked: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    n_empty: int
    ring: NDArray[np.int32]
    cloud: NDArray[np.int32]
    world: NDArray[np.int64]

    def select(self, mask: NDArray[np.bool_]) -> "CellSamples":
        """Return some of the cells.

        Args:
            mask: True for the cells to return, bool, shape (n,).
        """
        columns = ("features", "blocked", "clear", "ring", "cloud", "world")
        return replace(self, **{name: getattr(self, name)[mask] for name in columns})


def cell_samples(
    clouds: Iterable[PointCloud], grid: PolarGrid, worlds: Sequence[int] | None = None
) -> CellSamples:
    """Return the cells of labelled clouds that are not empty.

    Args:
        clouds: Labelled clouds in ``base_footprint``.
        grid: Polar grid of cells.
        worlds: Seed of each cloud's world; None if each cloud has a world of its own.

    Raises:
        ValueError: If there are no clouds, or one has no labels.
    """
    parts: list[tuple[NDArray[Any], ...]] = []
    n_empty = 0
    for number, cloud in enumerate(clouds):
        cells = cell_features(cloud.points, grid)
        states = label_cells(
            cloud.points, nontraversable(cloud), grid, objects=object_points(cloud)
        )
        known = states != CellState.EMPTY
        n = int(known.sum())
        n_empty += known.size - n
        parts.append(
            (
                cells.values[known],
                states[known] == CellState.NON_TRAVERSABLE,
                beyond_doubt(cloud, grid)[known],
                np.nonzero(known)[1].astype(np.int32),
                np.full(n, number, dtype=np.int32),
                np.full(n, worlds[number] if worlds is not None else number, dtype=np.int64),
            )
        )
    if not parts:
        raise ValueError("clouds: expected at least one, got none")
    features, blocked, clear, ring, cloud_, world = (
        np.concatenate(part) for part in zip(*parts, strict=True)
    )
    return CellSamples(features, blocked, clear, n_empty, ring, cloud_, world)


def join_samples(parts: Sequence[CellSamples]) -> CellSamples:
    """Return the cells of several data sets in one; their clouds are numbered on.

    Args:
        parts: Cells of each data set, at least one.
    """
    first, *rest = parts
    for part in rest:
        columns = ("features", "blocked", "clear", "ring", "world")
        joined = {
            name: np.concatenate([getattr(first, name), getattr(part, name)]) for name in columns
        }
        joined["cloud"] = np.concatenate([first.cloud, part.cloud + first.cloud.max() + 1])
        first = replace(first, n_empty=first.n_empty + part.n_empty, **joined)
    return first


def split_samples(
    folder: Path,
    manifest: Manifest,
    split: Split,
    grid: PolarGrid,
    on_cloud: Callable[[], object] | None = None,
) -> CellSamples:
    """Return the labelled cells of a split of a data set; see ``cell_samples``.

    Args:
        folder: Folder of the data set.
        manifest: Manifest of the data set.
        split: Split whose cells are returned.
        grid: Polar grid of cells.
        on_cloud: Callback after each cloud has been used.

    Raises:
        DatasetError: If a cloud is missing, is not the one of the manifest, or has no labels.
        ValueError: If the split has no clouds.
    """
    worlds = [entry.world_seed for entry in manifest.of(split)]
    return cell_samples(read_clouds(folder, manifest, split, on_cloud), grid, worlds)


def dataset_card(manifest: Manifest, cells: Mapping[Split, NDArray[np.int64]]) -> str:
    """Return the card of a data set, in Markdown.

    Args:
        manifest: Manifest of the data set.
        cells: Numbers of empty, free and blocked cells of each split, and of hits, false alarms and
            misses of the quantile rule on them, shape (6,).
    """
    lines = [
        "# Labelled clouds",
        "",
        "Synthetic clouds of a rotating 2D laser, each point labelled by its class or, on the",
        "ground, by the true slope and step under it. Written by `andabata clouds generate`.",
        "",
        f"* Seed {manifest.seed}, configuration `{manifest.config_sha256[:12]}` (in `{MANIFEST}`).",
        "* A world is on one side of the split only.",
        "* Difficulty: F1 (blocked) of a one-line rule, by which a point is an obstacle when",
        "  it stands 0.2 m over the lower quartile of its cell.",
        "* numpy reads the files. `stamps` and `severity` are the differences of neighbouring",
        "  numbers' bits, the least bytes first; with `a = numpy.load(file)[name]` and `u4`, `f4`",
        "  for `severity`, the numbers are",
        '  `numpy.ascontiguousarray(a.T).view("<u8").cumsum(dtype="<u8").view("<f8")`.',
        "",
        "| split | clouds | worlds | points | free cells | blocked cells | empty cells "
        "| rule's F1 |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for split, (empty, free, blocked, tp, fp, fn) in cells.items():
        entries = manifest.of(split)
        worlds = len({(entry.world, entry.world_seed) for entry in entries})
        points = sum(entry.points for entry in entries)
        rule = round(2 * tp / max(2 * tp + fp + fn, 1), 3)
        row = (split, len(entries), worlds, points, free, blocked, empty, rule)
        lines.append(f"| {' | '.join(str(cell) for cell in row)} |")
    return "\n".join(lines) + "\n"
