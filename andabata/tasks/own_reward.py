"""The off-road reward of a step: the paper's terms, or those of a user's own function."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.own_code import OwnCodeError, load_own
from andabata.tasks.rewards import RewardConfig, paper_reward

Terms = dict[str, NDArray[np.float64]]
"""Terms of the reward by name, float64, shape (n,) each; their sum is the reward."""


class RewardInput(NamedTuple):
    """One control step of n robots, as a reward sees it.

    Attributes:
        ranges: Finite free ranges after the step [m], float32, shape (n, sectors), sector 0 behind,
            then counter-clockwise.
        distance_before: Distance before the step to what attracts [m], shape (n,): the goal, or the
            sub-goal of the robot's planner.
        distance: Distance to the same after the step [m], shape (n,).
        yaw_rates: Executed yaw rates of this step and of the one before [rad/s], shape (n, 2).
        endings: ``andabata.tasks.terminations.Ending`` of each drive with this step, shape (n,).
    """

    ranges: NDArray[np.float32]
    distance_before: NDArray[np.float64]
    distance: NDArray[np.float64]
    yaw_rates: NDArray[np.float64]
    endings: NDArray[np.int64]


def offroad_reward(config: RewardConfig) -> Callable[[RewardInput], Terms]:
    """Return the function that gives the terms of a step's reward.

    Raises:
        OwnCodeError: If the user's own function cannot be used.
    """
    if config.function is None:
        return partial(_paper_terms, config)
    return partial(_own_terms, config.function, load_own(config.function, ()))


def _paper_terms(config: RewardConfig, step: RewardInput) -> Terms:
    """Return the paper's terms of a step."""
    return paper_reward(config, step.ranges, step.distance_before, step.distance, step.endings)


def _own_terms(name: str, function: Callable[..., Any], step: RewardInput) -> Terms:
    """Return the terms that a user's own function gives for a step.

    Raises:
        OwnCodeError: If they are no finite numbers by name, one of each robot.
    """
    terms = function(step)
    if not isinstance(terms, Mapping) or not terms:
        raise OwnCodeError(
            f"{name}: expected a dict of the reward's terms by name, got {type(terms).__name__}"
            f"{'' if terms else ', empty'}; return one array of numbers for each"
        )
    checked = {str(key): np.asarray(term, dtype=np.float64) for key, term in terms.items()}
    for key, term in checked.items():
        fits = term.shape == step.distance.shape
        if not fits or not np.isfinite(term).all():
            got = "others" if fits else f"an array of shape {term.shape}"
            raise OwnCodeError(
                f"{name}: expected {len(step.distance)} finite numbers of the term {key!r}, one of "
                f"each robot, got {got}; see the shapes of andabata.tasks.own_reward.RewardInput"
            )
    return checked
