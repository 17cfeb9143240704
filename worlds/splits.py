"""Splits of the world seeds: what is trained on some worlds is evaluated on others.

The ranges are disjoint: training below 100, validation below 132, development from 7300 to 7323,
evaluation from a million on, and data sets from a billion on.
"""

TRAINING_SEEDS = tuple(range(100))
"""World seeds of the episodes of reinforcement learning."""

VALIDATION_SEEDS = tuple(range(100, 132))
"""World seeds on which candidate policies are compared during training."""

DEVELOPMENT_SEEDS = tuple(range(7300, 7324))
"""World seeds for comparisons between changes; release figures come from the evaluation split."""

DEVELOPMENT_SEED = DEVELOPMENT_SEEDS[0]
"""Seed of commands that show or time something and are given none: ``evaluation_world`` of it and
its like selects worlds to develop in, so that what is looked at every day does not judge."""

EVALUATION_START = 1_000_000
"""First world seed of evaluations: ``EVALUATIONS`` worlds for each evaluation seed."""

EVALUATIONS = 10_000
"""Number of evaluation seeds, and of trials of each."""

DATASET_START = 1_000_000_000
"""First world seed of labelled clouds: ``DATASET_CLOUDS`` worlds for each data set."""

DATASET_CLOUDS = 100_000
"""Largest number of clouds of a data set."""


def evaluation_world(seed: int, trial: int) -> int:
    """Return the world seed of a trial.

    Args:
        seed: Seed of the evaluation, below ``EVALUATIONS``.
        trial: Index of the trial, below ``EVALUATIONS``.

    Raises:
        ValueError: If seed or trial are out of bounds, where they would select another split.
    """
    if not (0 <= seed < EVALUATIONS and 0 <= trial < EVALUATIONS):
        raise ValueError(f"seed, trial: expected 0 to {EVALUATIONS - 1}, got {seed}, {trial}")
    return EVALUATION_START + seed * EVALUATIONS + trial


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
