"""What a student of an imitation decided in drives that it has not learned from, and its price."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.map_observation import action_table
from andabata.training.dagger import kept_round
from andabata.training.imitation import ImitationConfig, check_labels, no_rounds
from andabata.training.map_labels import MapLabels
from rl.policies.crop_prices import CropPricesPolicy
from rl.policy import Policy, load_policy


class JudgedDecisions(NamedTuple):
    """Labels of a round's drives, priced by a policy that has not learned from them.

    Attributes:
        labels: Labels.
        policy: Policy of the round before; that of the only round where there is one alone.
        given: Prices that it gives all actions [s], float32, shape (n, a).
        regrets: Price of its choices beyond the best action's by the teacher [s], shape (n,).
        table: Speed [m/s] and yaw rate [rad/s] of each action, shape (a, 2).
        clip: Largest price beyond the best action's that it learns [s].
    """

    labels: MapLabels
    policy: Policy
    given: NDArray[np.float32]
    regrets: NDArray[np.float32]
    table: NDArray[np.float64]
    clip: float


def judge_decisions(folder: Path) -> JudgedDecisions:
    """Return what the last round of a folder of ``imitate`` labelled, and a policy's prices of it.

    Args:
        folder: Folder of the rounds.

    Raises:
        ValueError: If it holds no finished round of an imitation.
    """
    last = len(list(folder.glob("round-*.safetensors"))) - 1
    files = [folder / f"round-{max(last - 1, 0)}.safetensors", folder / f"round-{last}.npz"]
    if last < 0 or not all(file.exists() for file in files):
        raise ValueError(no_rounds(folder))
    policy = load_policy(files[0])
    if not isinstance(policy, CropPricesPolicy):
        raise ValueError(
            f"{folder}: expected rounds of `andabata policy imitate`, got a policy of architecture "
            f"{policy.architecture}; name a folder of that command"
        )
    kept = kept_round(files[1])
    labels = MapLabels(kept["observations"], kept["prices"])
    config = ImitationConfig.model_validate(policy.info["config"])
    check_labels(labels)
    given = np.array([policy.prices(row.astype(np.float32)) for row in labels.observations])
    chosen = given.argmin(axis=1)[:, None]
    beyond = labels.prices - labels.prices.min(axis=1, keepdims=True)
    regrets = np.take_along_axis(beyond, chosen, axis=1)[:, 0]
    table = action_table(config.driving.simulated_robot.robot)
    return JudgedDecisions(labels, policy, given, regrets, table, config.clip)


def dearest(regrets: NDArray[np.float32], count: int, apart: int = 100) -> list[int]:
    """Return the numbers of the dearest decisions, none within some others of a dearer one.

    Args:
        regrets: Price of each decision beyond the best action's [s], in the order of the drives.
        count: Largest number of decisions.
        apart: Number of decisions between two of them: a drive repeats its mistakes.
    """
    chosen: list[int] = []
    for k in np.argsort(-regrets, kind="stable").tolist():
        if len(chosen) < count and all(abs(k - other) >= apart for other in chosen):
            chosen.append(k)
    return chosen
