"""Tables of semantic classes: which class numbers are free, blocked or unknown.

A table is a TOML file with the sections ``free``, ``blocked`` and ``unknown``, each of lines
``NUMBER = "name"``; see ``class_tables``. ``labels_at`` names files of labels beside a cloud, with
``{stem}``, ``{parent}`` and ``{grandparent}`` of the cloud's own path; ``rename`` holds parts of
the stem that the label file has instead.
"""

import tomllib
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from traversability.cloud import PointCloud
from traversability.decoding import DecodedCloud, Labelling

_KINDS = ("free", "blocked", "unknown")


class ClassTableError(ValueError):
    """A table of classes that does not exist or cannot be used, or labels that it does not fit."""


class Judged(NamedTuple):
    """Points of a cloud, judged by their classes.

    Attributes:
        bad: True for points of blocked classes, bool, shape (n,).
        known: True for points of free and blocked classes, bool, shape (n,).
        strangers: Class numbers that the table does not hold; their points are unknown.
    """

    bad: NDArray[np.bool_]
    known: NDArray[np.bool_]
    strangers: tuple[int, ...]


class _File(BaseModel):
    """Content of a table's file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    free: dict[int, str]
    blocked: dict[int, str]
    unknown: dict[int, str] = {}
    labels_at: tuple[str, ...] = ()
    rename: dict[str, str] = {}

    @model_validator(mode="after")
    def _check_once(self) -> Self:
        """Refuse a class in two sections, and a table without a section to score by."""
        numbers = [number for kind in _KINDS for number in getattr(self, kind)]
        twice = sorted({number for number in numbers if numbers.count(number) > 1})
        if twice:
            raise ValueError(f"expected each class in one section, got {twice[0]} in two")
        if not (self.free and self.blocked):
            raise ValueError("expected classes in both sections, free and blocked")
        return self


@dataclass(frozen=True)
class ClassTable:
    """Meaning of class numbers.

    Attributes:
        name: Name of the table, or of its file.
        free: Class numbers that the robot may drive on.
        blocked: Class numbers that it must not drive on.
        unknown: Class numbers that say nothing.
        labels_at: Paths of a label file from the folder of its cloud.
        rename: Parts of a cloud's stem, and what the label file has instead.
    """

    name: str
    free: tuple[int, ...]
    blocked: tuple[int, ...]
    unknown: tuple[int, ...] = ()
    labels_at: tuple[str, ...] = ()
    rename: tuple[tuple[str, str], ...] = ()

    def judge(self, classes: NDArray[np.integer]) -> Judged:
        """Return which points are bad and which are known.

        Args:
            classes: Class of each point, any integer, shape (n,).
        """
        bad = np.isin(classes, self.blocked)
        known = bad | np.isin(classes, self.free)
        strangers = np.unique(classes[~known & ~np.isin(classes, self.unknown)])
        return Judged(bad, known, tuple(strangers.tolist()))

    def file_beside(self, cloud: Path) -> Path | None:
        """Return the file with the labels of a cloud's file, None if there is none.

        Args:
            cloud: Path of the cloud.
        """
        stem = cloud.stem
        for part, other in self.rename:
            stem = stem.replace(part, other)
        place = cloud.resolve()
        names = {"parent": place.parent.name, "grandparent": place.parent.parent.name}
        for pattern in ("{stem}.label", *self.labels_at):
            labels = cloud.parent / pattern.format(stem=stem, **names)
            if labels.is_file():
                return labels
        return None

    def apply(self, decoded: DecodedCloud) -> DecodedCloud:
        """Return a cloud whose ``nontraversable`` follows from its classes, with remarks.

        Points of unknown classes stay, and are not bad; ``judge`` says which they are.

        Args:
            decoded: Cloud with classes.

        Raises:
            ClassTableError: If it has none.
        """
        cloud = decoded.cloud
        if cloud.classes is None:
            raise ClassTableError(
                "labels: expected a column label, class or classification, or a file NAME.label "
                "beside the cloud, got neither"
            )
        judged = self.judge(cloud.classes)
        codes = tuple(np.unique(cloud.classes).tolist())
        unlabelled = int((~judged.known).sum())
        marked: PointCloud = replace(cloud, nontraversable=judged.bad)
        labelling = Labelling(self.free, False, codes, unlabelled)
        return replace(decoded, cloud=marked, labelling=labelling).noting(*self._remarks(judged))

    def _remarks(self, judged: Judged) -> list[str]:
        """Return sentences about classes that are not in the table, and points that are unknown."""
        remarks = []
        if judged.strangers:
            shown = ", ".join(map(str, judged.strangers[:8]))
            more = " and more" if len(judged.strangers) > 8 else ""
            remarks.append(
                f"labels {shown}{more} are not in the table {self.name}: treated as unknown; is it "
                "the right table for --labels?"
            )
        share = 1 - float(judged.known.mean()) if len(judged.known) else 0.0
        if share > 0:
            remarks.append(f"labels: {100 * share:.0f} % of the points are of unknown classes")
        return remarks


def class_table_names() -> list[str]:
    """Return the names of the tables of the package."""
    folder = files("traversability").joinpath("class_tables")
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir())


@cache
def load_class_table(name: str) -> ClassTable:
    """Return a table of the package by its name, or that of a file.

    Args:
        name: ``goose``, ``rellis``, ``semantickitti``, or the path of a TOML file.

    Raises:
        ClassTableError: If there is no such table, or its file is wrong.
        OSError: If the file cannot be read.
    """
    known = class_table_names()
    if name in known:
        data = files("traversability").joinpath("class_tables", f"{name}.toml").read_bytes()
    elif Path(name).is_file():
        data = Path(name).read_bytes()
    else:
        raise ClassTableError(
            f"labels: expected {', '.join(known)} or a TOML file of classes, got {name!r}"
        )
    return _table(Path(name).name, data)


def _table(name: str, data: bytes) -> ClassTable:
    """Return the table of a file's bytes.

    Raises:
        ClassTableError: If it is none.
    """
    try:
        content: dict[str, Any] = tomllib.loads(data.decode())
    except (ValueError, RecursionError) as error:  # Also numbers of 5,000 digits, and depth.
        raise ClassTableError(f"{name}: expected TOML, got {error}") from error
    try:
        parsed = _File.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise ClassTableError(
            f"{name}: {place + ': ' if place else ''}{first['msg']}; expected sections free, "
            'blocked and unknown of lines NUMBER = "name"'
        ) from error
    kinds = {kind: tuple(getattr(parsed, kind)) for kind in _KINDS}
    rename = tuple(parsed.rename.items())
    return ClassTable(name, **kinds, labels_at=parsed.labels_at, rename=rename)
