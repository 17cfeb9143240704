"""Scores of a cell classifier under their right names; red (non-traversable) is the positive class.

The paper prints the accuracy as "precision"; here each figure bears the name of its formula.
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
"""Names of the figures, in the order of the tables."""


@dataclass(frozen=True)
class CellScores:
    """A confusion matrix of judged cells.

    Attributes:
        tp: Red cells called red.
        tn: Green cells called green.
        fp: Green cells called red.
        fn: Red cells called green: the dangerous ones.
    """

    tp: int
    tn: int
    fp: int
    fn: int

    @classmethod
    def of(cls, truth: NDArray[np.uint8], predicted: NDArray[np.uint8]) -> "CellScores":
        """Compare cell states of any shape; cells that either side calls empty don't count.

        Raises:
            ValueError: If the shapes differ.
        """
        if truth.shape != predicted.shape:
            raise ValueError(f"predicted: expected shape {truth.shape}, got {predicted.shape}")
        judged = (truth != CellState.EMPTY) & (predicted != CellState.EMPTY)
        red, called = ((cells == CellState.NON_TRAVERSABLE)[judged] for cells in (truth, predicted))
        return cls(
            tp=int((red & called).sum()),
            tn=int((~red & ~called).sum()),
            fp=int((~red & called).sum()),
            fn=int((red & ~called).sum()),
        )

    @property
    def accuracy(self) -> float:
        """Share of all cells that are right."""
        return _share(self.tp + self.tn, self.fp + self.fn)

    @property
    def precision(self) -> float:
        """Share of the cells called red that are red."""
        return _share(self.tp, self.fp)

    @property
    def recall(self) -> float:
        """Share of the red cells that are called red."""
        return _share(self.tp, self.fn)

    @property
    def specificity(self) -> float:
        """Share of the green cells that are called green."""
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
        """Intersection over union of the red cells."""
        return _share(self.tp, self.fp + self.fn)

    def as_dict(self) -> dict[str, Any]:
        """Return all figures by name, and the confusion matrix."""
        figures: dict[str, Any] = {name: getattr(self, name) for name in FIGURES}
        confusion = {"tp": self.tp, "tn": self.tn, "fp": self.fp, "fn": self.fn}
        return figures | {"confusion": confusion}


def range_errors(
    truth: NDArray[np.uint8], predicted: NDArray[np.uint8], grid: PolarGrid
) -> dict[str, float]:
    """Return the shares of sectors whose virtual range is wrong by more than one ring.

    Args:
        truth: Cell states, shape (..., n_sectors, n_rings).
        predicted: Likewise.
        grid: The cells.

    Returns:
        ``too_long``, the dangerous ones, and ``too_short``, of the sectors with a judged cell.
    """
    first = [
        np.where(red.any(axis=-1), red.argmax(axis=-1), grid.n_rings)
        for red in (cells == CellState.NON_TRAVERSABLE for cells in (truth, predicted))
    ]
    known = (truth != CellState.EMPTY).any(axis=-1)
    excess = (first[1] - first[0])[known]
    return {"too_long": float((excess > 1).mean()), "too_short": float((excess < -1).mean())}


PAPER = CellScores(tp=340, tn=780, fp=82, fn=210)
"""The paper's own confusion matrix on its five validation clouds (Table 1)."""


def _share(right: int, wrong: int) -> float:
    """Return right / (right + wrong); NaN of nothing."""
    return right / (right + wrong) if right + wrong else float("nan")
