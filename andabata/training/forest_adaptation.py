"""Adaptation of a cell classifier to recorded drives, and what it gains and costs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.datasets.drive_labeller import DriveSamples
from andabata.datasets.drive_path import DriveLabelsConfig
from traversability.dataset import CellSamples, join_samples
from traversability.forest import Forest
from traversability.forest_adaptation import AdaptationConfig, adapt_forest, sample_scores
from traversability.scores import CellScores

SYNTHETIC, OWN = "validation_clouds", "held_out_drive"
"""Names of the cells that a forest is scored on before and after."""


class DriveAdaptationConfig(BaseModel):
    """Settings of the adaptation to recorded drives.

    Attributes:
        labels: Settings of the labels.
        forest: Parameters of the correction of the forest.
        learned_share: Share of each recording, from its begin, that is learned from.
        gap: Time between that part and the one that is held out [s].
        recall_loss: Largest loss of recall, on the validation clouds or on the part that is held
            out, with which a forest is kept.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    labels: DriveLabelsConfig = Field(default_factory=DriveLabelsConfig)
    forest: AdaptationConfig = Field(default_factory=AdaptationConfig)
    learned_share: float = Field(default=0.6, gt=0, lt=1)
    gap: float = Field(default=15.0, ge=0)
    recall_loss: float = Field(default=0.005, ge=0, le=1)


class RecallLostError(ValueError):
    """An adaptation that loses too much recall."""


@dataclass(frozen=True)
class Adaptation:
    """Adapted forest with its scores.

    Attributes:
        forest: The forest.
        before: Scores of the first forest on ``SYNTHETIC`` and ``OWN`` cells.
        after: Scores of the adapted one.
        learned: Number of own cells that were learned from.
    """

    forest: Forest
    before: dict[str, CellScores]
    after: dict[str, CellScores]
    learned: int

    def check(self, config: DriveAdaptationConfig) -> None:
        """Refuse a forest that misses more blocked cells than before.

        Raises:
            RecallLostError: If recall is lost beyond the limit on either part.
        """
        for name, before in self.before.items():
            after = self.after[name]
            # A drive crosses free ground, hardly anything that blocks: fewer false alarms could
            # be bought with misses that none of its labels shows.
            if before.recall - after.recall > config.recall_loss:  # False without blocked cells.
                raise RecallLostError(
                    f"{name}: expected a loss of recall of at most {config.recall_loss:g}, got "
                    f"{before.recall - after.recall:.4f} ({before.recall:.4f} to "
                    f"{after.recall:.4f}); no forest was written; give more clouds with --and, or "
                    "a lower forest.own_share in a file for --adaptation"
                )

    def as_dict(self) -> dict[str, Any]:
        """Return counts and scores before and after, ready for JSON."""
        return {
            name: {
                "before": _figures(self.before[name]),
                "after": _figures(self.after[name]),
            }
            for name in self.before
        } | {"learned_cells": self.learned}


def adapt_to_drives(
    forest: Forest,
    drives: Sequence[DriveSamples],
    synthetic: CellSamples,
    validation: CellSamples,
    config: DriveAdaptationConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> Adaptation:
    """Adapt a forest to the first part of each drive, and score it on the last and on clouds.

    Args:
        forest: Boosted forest.
        drives: Labelled cells of each drive, at least one.
        synthetic: Cells of synthetic clouds to learn from beside.
        validation: Cells of synthetic clouds of other worlds.
        config: Settings.
        seed: Seed of the draws.
        summary: Account of where the cells come from, kept with the forest.

    Raises:
        ValueError: If a part of the drives is empty, or the forest cannot be adapted.
    """
    learned, held = (
        join_samples(part)
        for part in zip(*(split_in_time(drive, config) for drive in drives), strict=True)
    )
    for name, part in (("learned", learned), ("held-out", held)):
        if not len(part.blocked):
            raise ValueError(
                f"drive: expected labelled cells in the {name} part, got none; record a minute or "
                "more, or change learned_share and gap"
            )
    adapted = adapt_forest(forest, synthetic, learned, config.forest, seed, summary)
    parts = {SYNTHETIC: validation, OWN: held}
    before, after = (
        {name: sample_scores(each, cells) for name, cells in parts.items()}
        for each in (forest, adapted)
    )
    return Adaptation(adapted, before, after, len(learned.blocked))


def split_in_time(
    drive: DriveSamples, config: DriveAdaptationConfig
) -> tuple[CellSamples, CellSamples]:
    """Return the cells of a drive before and after a gap in time.

    Args:
        drive: Labelled cells.
        config: Share of the first part, and the gap.
    """
    stamps = drive.stamps
    # By time, not by chance: clouds of neighbouring seconds show the same ground, so that a part
    # drawn by chance would be known to the forest.
    end = stamps[0] + config.learned_share * (stamps[-1] - stamps[0])
    first, last = stamps <= end, stamps > end + config.gap
    return drive.cells.select(first[drive.cells.cloud]), drive.cells.select(last[drive.cells.cloud])


def _figures(scores: CellScores) -> dict[str, Any]:
    """Return recall and share of false alarms, None without such cells, and the numbers."""
    blocked, free = scores.tp + scores.fn, scores.tn + scores.fp
    return {
        "recall": scores.recall if blocked else None,
        "false_alarms": scores.fp / free if free else None,
        "blocked_cells": blocked,
        "free_cells": free,
    }


def adaptation_text(data: dict[str, Any]) -> str:
    """Return a table of ``Adaptation.as_dict``."""
    lines = [f"{'cells':20}{'free':>8}{'blocked':>9}{'false alarms':>22}{'recall':>20}"]
    for name in (SYNTHETIC, OWN):
        before, after = data[name]["before"], data[name]["after"]
        counts = f"{before['free_cells']:8d}{before['blocked_cells']:9d}"
        both = [
            f"{_share(before[key])} -> {_share(after[key])}" for key in ("false_alarms", "recall")
        ]
        lines.append(f"{name.replace('_', ' '):20}{counts}{both[0]:>22}{both[1]:>20}")
    return "\n".join(lines)


def _share(share: float | None) -> str:
    """Return a share in three digits, or "none"."""
    return "none" if share is None or np.isnan(share) else f"{share:.3f}"
