"""Labels beside KITTI's clouds, in SemanticKITTI's layout."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from traversability.class_table import load_class_table
from traversability.cloud import PointCloud
from traversability.decoding import Labelling
from traversability.formats.error import FormatError
from traversability.formats.table import Columns

_KITTI = "semantickitti"
"""Table of the classes, where no file beside the cloud names them."""


def kitti_labels(cloud: PointCloud) -> bytes:
    """Return the label file beside a KITTI file: uint32, the class in the lower half.

    Raises:
        ValueError: If the cloud has no classes, or some that do not fit.
    """
    if cloud.classes is None:
        raise ValueError("classes: expected labelled points, got none")
    instances = np.zeros(len(cloud), np.int64) if cloud.instances is None else cloud.instances
    for name, column in (("classes", cloud.classes), ("instances", instances)):
        if len(column) and (column.min() < 0 or column.max() > 0xFFFF):
            raise ValueError(
                f"{name}: expected 0 to 65535 in a label file, got {column.min()} to {column.max()}"
            )
    return (cloud.classes.astype("<u4") | instances.astype("<u4") << 16).tobytes()


def labelled(table: Columns, beside: Path) -> tuple[Columns, Labelling]:
    """Return the labelled points with classes, instances and which are non-traversable.

    Args:
        table: Columns of the points by name, shape (n,) each.
        beside: File of the labels, in ``labels/`` of its sequence.

    Raises:
        FormatError: If the labels do not fit the points.
    """
    count = len(table["x"])
    labels = read_labels(beside, count)
    classes, instances = labels & 0xFFFF, labels >> 16
    traversable = _traversable(beside.parent.parent)
    assumed = traversable is None
    kitti = load_class_table(_KITTI)
    good = kitti.free if traversable is None else tuple(traversable)
    known = ~np.isin(classes, kitti.unknown if assumed else ())
    table = table | {"classes": classes, "nontraversable": ~np.isin(classes, good)}
    if instances.any():
        table["instances"] = instances
    labelling = Labelling(
        good, assumed, tuple(np.unique(classes).tolist()), int(count - known.sum())
    )
    return {name: column[known] for name, column in table.items()}, labelling


def read_labels(file: Path, count: int) -> NDArray[np.int64]:
    """Return the labels of a file, as wide as its size shows; SemanticKITTI's are uint32.

    Args:
        file: File of the labels.
        count: Number of points.

    Raises:
        FormatError: If they are too few or too many, or do not fit.
    """
    data = file.read_bytes()
    width = len(data) // count if count and len(data) % count == 0 else 4
    if width not in (1, 2, 4, 8) or len(data) != width * count:
        raise FormatError(f"{file.name}: expected {count} labels, got {len(data) // 4}")
    labels = np.frombuffer(data, dtype=f"<u{width}")
    if width == 8 and (labels > 0xFFFFFFFF).any():
        raise FormatError(f"{file.name}: expected labels of 32 bits, got {labels.max()}")
    return labels.astype(np.int64)


def _traversable(folder: Path) -> list[int] | None:
    """Return the classes that ``traversable.txt`` of a sequence names, or None without it."""
    file = folder / "traversable.txt"
    if not file.is_file():
        return None
    try:
        return [int(word) for word in file.read_text().split()]
    except ValueError as error:
        raise FormatError(f"{file.name}: expected class numbers, got {error}") from error
