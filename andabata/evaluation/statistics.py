"""Figures of repeated trials."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, stdtrit

Z95 = 1.959964
"""Quantile of the normal distribution that bounds 95 % on both sides."""


def wilson_interval(successes: int, trials: int, z: float = Z95) -> tuple[float, float]:
    """Return the Wilson score interval of a success rate (Wilson 1927).

    Args:
        successes: Trials that succeeded.
        trials: All trials.
        z: Quantile of the normal distribution; the default gives 95 %.

    Raises:
        ValueError: If the counts are impossible.
    """
    if not 0 <= successes <= trials or trials < 1:
        raise ValueError(f"trials: expected 0 <= successes <= trials, got {successes} of {trials}")
    return _wilson(successes / trials, trials, z)


def _wilson(rate: float, trials: float, z: float) -> tuple[float, float]:
    """Return the Wilson score interval of a rate, closed at 0 and at 1."""
    middle = rate + z * z / (2 * trials)
    spread = z * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    low, high = (middle - spread) / scale, (middle + spread) / scale
    # The ends are 0 and 1 there but for rounding, which would show as -0.000.
    return (0.0 if rate == 0 else low), (1.0 if rate == 1 else high)


def clustered_interval(successes: NDArray[np.bool_], z: float = Z95) -> tuple[float, float]:
    """Return an interval of the success rate of several policies that drive the same tasks.

    What is hard for one policy is hard for the others, so the trials count as fewer, as many as
    would spread the rate like the tasks do; then it is Wilson's interval (Korn and Graubard 1998).
    The interval is that of these policies on other tasks of the kind.

    Args:
        successes: True for success, shape (policies, tasks).
        z: Quantile of the normal distribution; the default gives 95 %.

    Raises:
        ValueError: If there is no policy or no task.
    """
    policies, tasks = _checked(successes).shape
    trials, by_task = policies * tasks, successes.mean(axis=0)
    rate = float(by_task.mean())
    spread = float(by_task.var(ddof=1)) / tasks if tasks > 1 else 0.0
    # Tasks that all end alike say nothing of their spread.
    effective = rate * (1 - rate) / spread if spread > 0 else float(tasks)
    return _wilson(rate, min(max(effective, tasks), trials), z)


class Difference(NamedTuple):
    """Difference of two success rates with its interval.

    Attributes:
        mean: Second rate minus first.
        low: Lower end of the interval.
        high: Upper end of the interval.
    """

    mean: float
    low: float
    high: float


class Mean(NamedTuple):
    """Mean with its interval.

    Attributes:
        mean: Mean.
        low: Lower end of the interval, None if one task says nothing of the spread.
        high: Upper end of the interval, or None.
    """

    mean: float
    low: float | None
    high: float | None


def clustered_mean(values: NDArray[np.float64], level: float = 0.95) -> Mean:
    """Return the mean of a measure of repeated trials with the interval of other tasks of the kind.

    Trials of a task are alike, so it is the means of the tasks that spread; the interval is
    Student's over them.

    Args:
        values: Measure of each trial, shape (trials, tasks).
        level: Probability of the interval.

    Raises:
        ValueError: If there is no trial or no task.
    """
    if values.ndim != 2 or not values.size:
        raise ValueError(f"values: expected trials x tasks, got shape {values.shape}")
    by_task = values.mean(axis=0)
    mean, count = float(by_task.mean()), len(by_task)
    if count < 2:
        return Mean(mean, None, None)
    # Quantile of Student's distribution; scipy.stats has it too, and takes 0.3 s to import.
    quantile = float(stdtrit(count - 1, (1 + level) / 2))
    reach = quantile * float(by_task.std(ddof=1)) / math.sqrt(count)
    return Mean(mean, mean - reach, mean + reach)


def paired_difference(
    first: NDArray[np.bool_], second: NDArray[np.bool_], z: float = Z95
) -> Difference:
    """Return how much more often the second of two ways succeeds on the same tasks.

    The difference of a task is -1, 0 or 1, or its mean over the policies that drive it. The
    interval is the one of Agresti and Min (2005), which counts two tasks more: it is never empty,
    also where no task differs.

    Args:
        first: True for success, shape (tasks,) or (policies, tasks).
        second: Successes of the same policies and tasks in the second way, of the same shape.
        z: Quantile of the normal distribution; the default gives 95 %.

    Raises:
        ValueError: If the shapes differ, or there is no task.
    """
    one, other = (_checked(np.atleast_2d(ways)) for ways in (first, second))
    if one.shape != other.shape:
        raise ValueError(
            f"pairs: expected the same policies and tasks, got {one.shape} and {other.shape}"
        )
    by_task = (other.astype(np.float64) - one.astype(np.float64)).mean(axis=0)
    middle, variance = _with_two_more(by_task)
    return _limited(float(by_task.mean()), middle, z * math.sqrt(variance))


class McNemar(NamedTuple):
    """Exact test of two ways on the same tasks.

    Attributes:
        gained: Number of tasks that the second way does better.
        lost: Number of tasks that the first way does better.
        p_value: Probability of a split as uneven as this or more, if both ways are as good.
    """

    gained: int
    lost: int
    p_value: float


def mcnemar(first: NDArray[np.bool_], second: NDArray[np.bool_]) -> McNemar:
    """Return McNemar's exact test of two ways on the same tasks (McNemar 1947).

    Tasks that end alike say nothing. With several trials of a task it is the sign test of the
    difference of its rates: trials of a task are no tasks.

    Args:
        first: True for success, shape (trials, tasks).
        second: Successes of the second way on the same tasks, shape (other trials, tasks).

    Raises:
        ValueError: If the numbers of tasks differ, or there is no task.
    """
    by_task = _gains(_checked(first), _checked(second))
    gained, lost = int((by_task > 0).sum()), int((by_task < 0).sum())
    # The smaller tail, twice: the binomial with an even chance is symmetric.
    tail = float(bdtr(min(gained, lost), gained + lost, 0.5)) if gained + lost else 1.0
    return McNemar(gained, lost, min(2.0 * tail, 1.0))


def paired_bootstrap(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    rng: np.random.Generator,
    level: float = 0.95,
    resamples: int = 10_000,
) -> Difference:
    """Return the difference of two means on the same tasks, with an interval of resampled tasks.

    Args:
        first: Measure, shape (trials, tasks).
        second: Measure of the second way on the same tasks, shape (other trials, tasks).
        rng: Source of the resampling.
        level: Probability of the interval, that of percentiles (Efron 1979).
        resamples: Number of times that the tasks are drawn again.

    Raises:
        ValueError: If the numbers of tasks differ, or there is no task.
    """
    by_task = _gains(first, second)
    drawn = rng.integers(len(by_task), size=(resamples, len(by_task)))
    tails = (0.5 - level / 2, 0.5 + level / 2)
    low, high = np.quantile(by_task[drawn].mean(axis=1), tails).tolist()
    return Difference(float(by_task.mean()), low, high)


def _gains(first: NDArray[Any], second: NDArray[Any]) -> NDArray[np.float64]:
    """Return the gain of each task in the mean over its trials, shape (tasks,).

    Raises:
        ValueError: If the numbers of tasks differ, or there is no task.
    """
    if first.shape[1] != second.shape[1] or not first.size or not second.size:
        raise ValueError(f"pairs: expected the same tasks, got {first.shape} and {second.shape}")
    return np.asarray(second.mean(axis=0) - first.mean(axis=0), dtype=np.float64)


def group_difference(
    first: NDArray[np.bool_], second: NDArray[np.bool_], z: float = Z95
) -> Difference:
    """Return how much more often a second group of policies succeeds on the same tasks.

    A group are seeds of one training. The interval is that of other seeds on other tasks of the
    kind: the tasks count as in ``paired_difference``, and each group of several seeds adds the
    spread of its own. A group of one is that policy alone.

    Args:
        first: True for success, shape (policies, tasks).
        second: Successes of the second group on the same tasks, shape (other policies, tasks).
        z: Quantile of the normal distribution; the default gives 95 %.

    Raises:
        ValueError: If the numbers of tasks differ, or there is no task.
    """
    one, other = _checked(first), _checked(second)
    by_task = _gains(one, other)
    middle, variance = _with_two_more(by_task)
    for rates in (one.mean(axis=1), other.mean(axis=1)):
        variance += float(rates.var(ddof=1)) / len(rates) if len(rates) > 1 else 0.0
    return _limited(float(by_task.mean()), middle, z * math.sqrt(variance))


def _with_two_more(by_task: NDArray[np.float64]) -> tuple[float, float]:
    """Return the mean of differences and its variance with two tasks more (Agresti and Min 2005).

    These two have half a difference of -1 and half a difference of 1 between them.
    """
    count = len(by_task) + 2
    middle = float(by_task.sum()) / count
    return middle, ((float((by_task**2).sum()) + 1) / count - middle**2) / count


def _limited(mean: float, middle: float, reach: float) -> Difference:
    """Return a difference with an interval around a middle, within -1 and 1."""
    return Difference(mean, max(middle - reach, -1.0), min(middle + reach, 1.0))


def _checked(successes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return successes after a check of their shape."""
    if successes.ndim != 2 or not successes.size:
        raise ValueError(f"successes: expected policies x tasks, got shape {successes.shape}")
    return successes
