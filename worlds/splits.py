"""Splits of the world seeds: what is trained or chosen on some worlds is judged on others.

The ranges are disjoint: training below 100, validation below 132, judging from 500 million to 900
million, data sets from a billion on. All other seeds are development. Those of ``evaluation_world``
are, too, since they were looked at many times.

Judging seeds are addressed by a release and drawn once: ``docs/results/ledger.md``. Whatever makes
a world or a room of a seed for another purpose passes ``refuse_judging``.
"""

import re
from typing import Literal

Split = Literal["training", "validation", "development", "judging", "data set"]
"""Purpose of a world seed."""

TRAINING_SEEDS = tuple(range(100))
"""World seeds of the episodes of reinforcement learning."""

VALIDATION_SEEDS = tuple(range(100, 132))
"""World seeds on which candidate policies are compared during training."""

DEVELOPMENT_SEEDS = tuple(range(7300, 7324))
"""World seeds for comparisons between changes; release figures come from the judging split."""

DEVELOPMENT_SEED = DEVELOPMENT_SEEDS[0]
"""Seed of commands that show or time something and are given none."""

EVALUATION_START = 1_000_000
"""First world seed of evaluations that develop: ``EVALUATIONS`` worlds for each seed."""

EVALUATIONS = 10_000
"""Number of evaluation seeds, and of trials of each."""

JUDGING_START = 500_000_000
"""First judging seed: ``JUDGING_TRIALS`` worlds for each release."""

JUDGING_TRIALS = 4_000
"""Number of judging worlds of a release."""

DATASET_START = 1_000_000_000
"""First world seed of labelled clouds: ``DATASET_CLOUDS`` worlds for each data set."""

DATASET_CLOUDS = 100_000
"""Largest number of clouds of a data set."""

_RELEASE = re.compile(r"(0|[1-9])\.(0|[1-9]\d?)\.(0|[1-9]\d?)", re.ASCII)
"""Form of a release: one digit, and two numbers below 100."""

_RELEASES = 100_000
"""Number of releases of this form."""


class JudgingSeedError(ValueError):
    """Raised for a judging seed that is not named by its release."""


def evaluation_world(seed: int, trial: int) -> int:
    """Return the world seed of a trial that develops.

    Args:
        seed: Seed of the evaluation, below ``EVALUATIONS``.
        trial: Index of the trial, below ``EVALUATIONS``.

    Raises:
        ValueError: If seed or trial are out of bounds, where they would select another split.
    """
    if not (0 <= seed < EVALUATIONS and 0 <= trial < EVALUATIONS):
        raise ValueError(f"seed, trial: expected 0 to {EVALUATIONS - 1}, got {seed}, {trial}")
    return EVALUATION_START + seed * EVALUATIONS + trial


def judging_world(release: str, trial: int) -> int:
    """Return the world seed of a trial that judges a release.

    Args:
        release: Release as ``0.2.0``.
        trial: Index of the trial, below ``JUDGING_TRIALS``.

    Raises:
        ValueError: If the release is no version, or the trial is out of bounds.
    """
    parts = _RELEASE.fullmatch(release)
    if parts is None:
        raise ValueError(
            f"release: expected a version of three numbers as 0.2.0, the first below 10 and the "
            f"others below 100, got {release!r}"
        )
    if not 0 <= trial < JUDGING_TRIALS:
        raise ValueError(f"trial: expected 0 to {JUDGING_TRIALS - 1}, got {trial}")
    major, minor, patch = map(int, parts.groups())
    number = (major * 100 + minor) * 100 + patch
    return JUDGING_START + number * JUDGING_TRIALS + trial


def judged_release(seed: int) -> str | None:
    """Return the release that a seed judges, None for a seed of another split."""
    number = (seed - JUDGING_START) // JUDGING_TRIALS
    if not 0 <= number < _RELEASES:
        return None
    return f"{number // 10_000}.{number // 100 % 100}.{number % 100}"


def split_of(seed: int) -> Split:
    """Return the split of a world seed.

    Raises:
        ValueError: If the seed is negative.
    """
    if seed < 0:
        raise ValueError(f"seed: expected 0 or more, got {seed}")
    if judged_release(seed) is not None:
        return "judging"
    if seed >= DATASET_START:
        return "data set"
    if seed in TRAINING_SEEDS:
        return "training"
    return "validation" if seed in VALIDATION_SEEDS else "development"


def refuse_judging(seed: int, release: str | None = None) -> None:
    """Refuse a judging seed, but for the release that it judges.

    Args:
        seed: Seed of a world, a room or a suite.
        release: Release that is judged; None for training, tuning, pictures and all else.

    Raises:
        JudgingSeedError: If it is a judging seed of another release, or of any without one.
    """
    judged = judged_release(seed)
    if judged is not None and judged != release:
        raise JudgingSeedError(
            f"seed: expected one that does not judge a release, got {seed}, which judges "
            f"{judged}; take another seed (development: {DEVELOPMENT_SEEDS[0]} to "
            f"{DEVELOPMENT_SEEDS[-1]}), or judge with evaluate --release {judged}"
        )


def dataset_world(seed: int, number: int) -> int:
    """Return the world seed of a labelled cloud.

    Args:
        seed: Seed of the data set.
        number: Index of the cloud, below ``DATASET_CLOUDS``.

    Raises:
        ValueError: If seed or number are out of bounds, where they would select another data set.
    """
    if not (seed >= 0 and 0 <= number < DATASET_CLOUDS):
        raise ValueError(
            f"clouds: expected seed >= 0 and 0 to {DATASET_CLOUDS - 1} clouds, got {seed}, {number}"
        )
    return DATASET_START + seed * DATASET_CLOUDS + number
