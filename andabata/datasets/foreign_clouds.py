"""Labelled clouds of other robots and data sets, named by a manifest, as cells for training.

The shipped classifiers are never trained on such clouds.
"""

import hashlib
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from traversability.class_table import load_class_table
from traversability.cloud import PointCloud
from traversability.dataset import CellSamples, DatasetError
from traversability.features import cell_features
from traversability.files import decode_cloud_file
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.two_truths import two_truths
from worlds.truth import TruthConfig


class ForeignCloud(BaseModel):
    """One labelled cloud, in the frame of its level sensor.

    Attributes:
        file: Path of the cloud from the folder of the manifest.
        sensor_height: Height of the sensor above the ground [m].
        labels: Table of its classes: a name, or the path of a TOML file from that folder.
        own_body: Distance from the sensor below which returns are the carrier's own [m].
        columns: Number of columns of a bin file; None infers it from the content.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str
    sensor_height: float = Field(gt=0, le=10)
    labels: str
    own_body: float = Field(default=0.0, ge=0, le=10)
    columns: int | None = Field(default=None, ge=3, le=16)


class ForeignManifest(BaseModel):
    """Manifest of labelled clouds, a TOML file with one table ``clouds`` for each.

    Attributes:
        clouds: The clouds.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    clouds: tuple[ForeignCloud, ...] = Field(min_length=1)


class ForeignSamples(NamedTuple):
    """Cells of the clouds of a manifest.

    Attributes:
        cells: Labelled cells; each cloud is a world of its own, with a negative number.
        sha256: Hash of the manifest's file.
        clouds: Number of clouds.
    """

    cells: CellSamples
    sha256: str
    clouds: int


def read_foreign_manifest(path: Path) -> ForeignManifest:
    """Return the manifest of a file.

    Args:
        path: TOML file.

    Raises:
        DatasetError: If it is no such manifest.
        OSError: If it cannot be read.
    """
    try:
        return ForeignManifest.model_validate(tomllib.loads(path.read_text()))
    except tomllib.TOMLDecodeError as error:
        raise DatasetError(f"{path}: expected TOML, got {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise DatasetError(
            f"{path}: {place}: {first['msg']}; expected [[clouds]] with file, sensor_height and "
            "labels"
        ) from error


def foreign_samples(
    path: Path, grid: PolarGrid, on_cloud: Callable[[], object] | None = None
) -> ForeignSamples:
    """Return the cells of a manifest's clouds whose labels decide them; see ``two_truths``.

    Args:
        path: Manifest.
        grid: Polar grid of cells.
        on_cloud: Callback after each cloud.

    Raises:
        DatasetError: If the manifest is wrong, or no cell of its clouds is labelled.
        ValueError: If a cloud or its labels cannot be read.
        OSError: If a file cannot be read.
    """
    manifest = read_foreign_manifest(path)
    parts = []
    for number, entry in enumerate(manifest.clouds):
        parts.append(_cells(path.parent, entry, number, grid))
        if on_cloud:
            on_cloud()
    names = ("features", "blocked", "clear", "ring", "cloud", "world")
    columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    if not len(columns["blocked"]):
        raise DatasetError(
            f"{path}: expected labelled cells, got none; are sensor_height and labels right?"
        )
    cells = CellSamples(n_empty=sum(part.n_empty for part in parts), **columns)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return ForeignSamples(cells, digest, len(parts))


def _cells(folder: Path, entry: ForeignCloud, number: int, grid: PolarGrid) -> CellSamples:
    """Return the labelled cells of one cloud."""
    own = folder / entry.labels
    table = load_class_table(str(own) if own.is_file() else entry.labels)
    cloud = decode_cloud_file(folder / entry.file, entry.columns, labels=table).cloud.absolute()
    cloud = _standing(cloud, entry)
    assert cloud.classes is not None  # A table was applied.
    bad, known, _ = table.judge(cloud.classes)
    truths = two_truths(cloud.points, bad, known, grid, TruthConfig().max_step)
    decided = truths.second != CellState.EMPTY
    cells = cell_features(cloud.points, grid)
    decided &= cells.counts >= grid.min_points
    n = int(decided.sum())
    return CellSamples(
        features=cells.values[decided],
        blocked=truths.second[decided] == CellState.NON_TRAVERSABLE,
        clear=np.ones(n, dtype=np.bool_),
        n_empty=decided.size - n,
        ring=np.nonzero(decided)[1].astype(np.int32),
        cloud=np.full(n, number, dtype=np.int32),
        world=np.full(n, -1 - number, dtype=np.int64),
    )


def _standing(cloud: PointCloud, entry: ForeignCloud) -> PointCloud:
    """Return a cloud in ``base_footprint``, without the carrier's own body."""
    far = np.linalg.norm(cloud.points, axis=1) >= entry.own_body
    kept = cloud.select(far)
    raised = kept.points + np.array([0.0, 0.0, entry.sensor_height])
    return replace(kept, points=raised.astype(np.float32), frame="base_footprint")
