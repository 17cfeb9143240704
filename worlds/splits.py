"""Which world seeds are for what, so that nothing is judged where it has learnt."""

TRAINING_SEEDS = tuple(range(100))
"""World seeds that learning to steer draws its episodes from."""

VALIDATION_SEEDS = tuple(range(100, 132))
"""World seeds in which learning tries its policies, to keep the best."""

EVALUATION_SEED = 1_000_000
"""First world seed of the judges, ten thousand for each seed of an evaluation."""

EVALUATIONS = 10_000
"""Number of evaluation seeds, and of the trials that each of them has worlds for."""

DATASET_SEED = 1_000_000_000
"""First world seed of labelled clouds, a hundred thousand for each seed of a data set."""


def evaluation_world(seed: int, trial: int) -> int:
    """Return the world seed of a trial.

    Raises:
        ValueError: If seed or trial would reach the worlds of others.
    """
    if not (0 <= seed < EVALUATIONS and 0 <= trial < EVALUATIONS):
        raise ValueError(f"seed, trial: expected 0 to 9999, got {seed}, {trial}")
    return EVALUATION_SEED + seed * EVALUATIONS + trial


def dataset_world(seed: int, number: int) -> int:
    """Return the world seed of a labelled cloud.

    Raises:
        ValueError: If ``number`` would reach the next data set.
    """
    if not (seed >= 0 and 0 <= number < 100_000):
        raise ValueError(f"clouds: expected seed >= 0 and 0 to 99999 clouds, got {seed}, {number}")
    return DATASET_SEED + seed * 100_000 + number
