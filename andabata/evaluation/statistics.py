"""Figures of repeated trials."""

import math


def wilson_interval(successes: int, trials: int, z: float = 1.959964) -> tuple[float, float]:
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
    rate = successes / trials
    middle = rate + z * z / (2 * trials)
    spread = z * math.sqrt(rate * (1 - rate) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    low, high = (middle - spread) / scale, (middle + spread) / scale
    return (0.0 if successes == 0 else low), (1.0 if successes == trials else high)
