"""Scores of a cell classifier; blocked (non-traversable) is the positive class.

The paper prints the accuracy as "precision"; here each score has the name of its formula.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.grid import PolarGrid
from traversability.labels import CellState

FIGURES = (
    "accuracy",
    "precision",
    "recall",
    "specificity",
    "balanced_accuracy",
    "f1_red",
    "iou_red",
)
"""Names of the scores, in the order of the tables; ``_red`` is of the blocked cells."""


@dataclass(frozen=True)
class CellScores:
    """Confusion matrix of classified cells.

    Attributes:
        tp: Number of blocked cells classified as blocked.
        tn: Number of free cells classified as free.
        fp: Number of free cells classified as blocked, the false alarms.
        fn: Number of blocked cells classified as free, the dangerous misses.
    """

    tp: int
    tn: int
    fp: int
    fn: int

    @classmethod
    def of(cls, truth: NDArray[np.uint8], predicted: NDArray[np.uint8]) -> "CellScores":
        """Return the confusion matrix of cell states; cells that are empty in either don't count.

        Args:
            truth: True ``CellState`` of each cell, any shape.
            predicted: Predicted ``CellState`` of each cell, the same shape.

        Raises:
            ValueError: If the shapes differ.
        """
        if truth.shape != predicted.shape:
            raise ValueError(f"predicted: expected shape {truth.shape}, got {predicted.shape}")
        known = (truth != CellState.EMPTY) & (predicted != CellState.EMPTY)
        blocked, called = (
            (cells == CellState.NON_TRAVERSABLE)[known] for cells in (truth, predicted)
        )
        return cls(
            tp=int((blocked & called).sum()),
            tn=int((~blocked & ~called).sum()),
            fp=int((~blocked & called).sum()),
            fn=int((blocked & ~called).sum()),
        )

    @property
    def accuracy(self) -> float:
        """Share of all cells that are classified rightly."""
        return _share(self.tp + self.tn, self.fp + self.fn)

    @property
    def precision(self) -> float:
        """Share of the cells classified as blocked that are."""
        return _share(self.tp, self.fp)

    @property
    def recall(self) -> float:
        """Share of the blocked cells that are classified so."""
        return _share(self.tp, self.fn)

    @property
    def specificity(self) -> float:
        """Share of the free cells that are classified so."""
        return _share(self.tn, self.fp)

    @property
    def balanced_accuracy(self) -> float:
        """Mean of recall and specificity."""
        return (self.recall + self.specificity) / 2

    @property
    def f1_red(self) -> float:
        """Harmonic mean of precision and recall."""
        return _share(2 * self.tp, self.fp + self.fn)

    @property
    def iou_red(self) -> float:
        """Intersection over union of the blocked cells."""
        return _share(self.tp, self.fp + self.fn)

    def as_dict(self) -> dict[str, Any]:
        """Return all scores by name, and the confusion matrix, ready for JSON."""
        figures: dict[str, Any] = {name: getattr(self, name) for name in FIGURES}
        confusion = {"tp": self.tp, "tn": self.tn, "fp": self.fp, "fn": self.fn}
        return figures | {"confusion": confusion}


def range_errors(
    truth: NDArray[np.uint8], predicted: NDArray[np.uint8], grid: PolarGrid
) -> dict[str, float]:
    """Return the shares of sectors whose virtual range is wrong by more than one ring.

    Args:
        truth: True ``CellState`` of each cell, shape (..., n_sectors, n_rings).
        predicted: Predicted ``CellState`` of each cell, the same shape.
        grid: Polar grid of the cells.

    Returns:
        Shares ``too_long``, the dangerous ones, and ``too_short`` of the sectors with a cell that
        is not empty.
    """
    first = [
        np.where(blocked.any(axis=-1), blocked.argmax(axis=-1), grid.n_rings)
        for blocked in (cells == CellState.NON_TRAVERSABLE for cells in (truth, predicted))
    ]
    known = (truth != CellState.EMPTY).any(axis=-1)
    excess = (first[1] - first[0])[known]
    return {"too_long": float((excess > 1).mean()), "too_short": float((excess < -1).mean())}


PAPER = CellScores(tp=340, tn=780, fp=82, fn=210)
"""Confusion matrix of the paper on its five validation clouds (Table 1)."""


def _share(right: int, wrong: int) -> float:
    """Return right / (right + wrong), NaN if both are 0."""
    return right / (right + wrong) if right + wrong else float("nan")
