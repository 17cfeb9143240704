"""Distillation of the sampling MPC into a policy, in rounds of driving and fitting.

Each round drives in generated fields; every state is labelled with the expert's command.
"""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.navigation.planar.distilled_observation import ACTIONS, OBSERVATIONS, mirrored
from andabata.runs.folder import commit
from andabata.training.dagger import Arrays, check_rounds, drive_round, run_rounds
from andabata.training.expert_labels import (
    LabelledDrive,
    LabelledDriveConfig,
    Labels,
    drive_and_label,
)
from rl.policy import Policy


class DistillationConfig(BaseModel):
    """Settings of a distillation.

    Attributes:
        driving: Settings of the drives.
        drives: Number of drives of each round; as many rounds as numbers.
        expert_shares: Share of the time that the expert drives in each round; all of it in the
            first.
        hidden: Width of each hidden layer.
        epochs: Number of passes over all labels in each round.
        last_epochs: Number of passes in the last round.
        batch_size: Number of labels in a step.
        learning_rate: Adam learning rate at the begin of a round; it falls to zero along a cosine.
        smooth_l1_beta: Error of a share from which on the loss grows linearly, since the expert's
            commands have noise, and two ways round a post have no mean.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    driving: LabelledDriveConfig = LabelledDriveConfig()
    drives: tuple[int, ...] = Field(default=(100, 60, 60, 60, 60, 60, 60, 60), min_length=1)
    expert_shares: tuple[float, ...] = (1.0, 0.4, 0.2, 0.1, 0.0, 0.0, 0.0, 0.0)
    hidden: tuple[int, ...] = (256, 256)
    epochs: int = Field(default=10, ge=1)
    last_epochs: int = Field(default=40, ge=1)
    batch_size: int = Field(default=256, ge=1)
    learning_rate: float = Field(default=1e-3, gt=0)
    smooth_l1_beta: float = Field(default=0.1, gt=0)

    @model_validator(mode="after")
    def _check_rounds(self) -> Self:
        """Refuse rounds without drives or without a driver."""
        check_rounds(self.drives, self.expert_shares, "expert_shares")
        return self


class RoundResult(NamedTuple):
    """What a round came to.

    Attributes:
        round: Number of the round.
        labels: Number of labels so far.
        reached: Share of its drives that reached their goals.
        loss: Mean loss of the last pass.
    """

    round: int
    labels: int
    reached: float
    loss: float


def distill_mpc(
    config: DistillationConfig,
    seed: int,
    folder: Path,
    workers: int = 1,
    on_drive: Callable[[int, int], None] | None = None,
) -> tuple[Policy, list[RoundResult]]:
    """Distill the sampling MPC into a policy, and return it with what the rounds came to.

    Each finished round is a file of labels and one of the policy, from which a distillation that
    was killed goes on.

    Args:
        config: Settings.
        seed: Seed of all drives and of the network.
        folder: Folder of the rounds.
        workers: Number of processes; the result does not depend on it.
        on_drive: Function that is called with the round and a number of drives that are done.

    Raises:
        ValueError: If the folder holds another distillation, or its files are damaged.
    """
    policies = run_rounds(
        folder,
        {"config": config.model_dump(mode="json"), "seed": seed},
        len(config.drives),
        lambda k, policy: _labels(config, seed, k, policy, workers, on_drive),
        lambda k, rounds, start: _fitted(config, seed, k, rounds, start),
        lambda k: None if on_drive is None else on_drive(k, config.drives[k]),
    )
    infos = [policy.info for policy in policies]
    results = [
        RoundResult(k, info["labels"], info["reached"], info["loss"])
        for k, info in enumerate(infos)
    ]
    return policies[-1], results


def _labels(
    config: DistillationConfig,
    seed: int,
    k: int,
    policy: Policy | None,
    workers: int,
    on_drive: Callable[[int, int], None] | None,
) -> Arrays:
    """Return the labels of a round, and the share of its drives that arrived."""
    first = sum(config.drives[:k])
    drives = [LabelledDrive(first + n, config.expert_shares[k]) for n in range(config.drives[k])]
    data = None if policy is None else policy.to_bytes()
    work = partial(drive_and_label, config.driving, seed, data)
    told = (lambda: None) if on_drive is None else partial(on_drive, k, 1)
    driven = drive_round(work, drives, workers, told)
    return {
        "observations": np.concatenate([labels.observations for labels, _ in driven]),
        "shares": np.concatenate([labels.shares for labels, _ in driven]),
        "reached": np.array(np.mean([arrived for _, arrived in driven])),
    }


def _fitted(
    config: DistillationConfig, seed: int, k: int, rounds: list[Arrays], start: Policy | None
) -> Policy:
    """Return the policy of a round.

    Labels of all rounds: fitted to the last round's alone, a policy forgets the states that the
    rounds before had led it to.
    """
    observations, shares = (
        np.concatenate([one[name] for one in rounds]) for name in ("observations", "shares")
    )
    info = {"config": config.model_dump(mode="json"), "seed": seed, "commit": commit()}
    info |= {"round": k, "labels": len(shares), "reached": float(rounds[-1]["reached"])}
    epochs = config.last_epochs if k == len(config.drives) - 1 else config.epochs
    return fit(Labels(observations, shares), config, epochs, seed, info, start)


def fit(
    labels: Labels,
    config: DistillationConfig,
    epochs: int,
    seed: int,
    info: dict[str, Any],
    start: Policy | None = None,
) -> Policy:
    """Return a policy that is fitted to labels.

    Each label is taken as it is or with left and right exchanged, at random.

    Args:
        labels: Labels.
        config: Settings.
        epochs: Number of passes.
        seed: Seed of the weights and of the order.
        info: Description for the policy, to which its loss is added.
        start: Policy from whose weights to begin, None for fresh ones.
    """
    import torch

    from rl.networks import DeterministicActor, use_one_thread

    use_one_thread()
    torch.manual_seed(seed)
    rng = np.random.default_rng([seed, len(labels.shares)])
    actor = DeterministicActor(OBSERVATIONS, ACTIONS, config.hidden)
    # Going on from the last round lets the passes between rounds be few: ten, and forty at the end.
    if start is not None:
        weights = {f"linear.{name[5:]}": array for name, array in start.tensors().items()}
        actor.load_state_dict({name: torch.from_numpy(array) for name, array in weights.items()})
    optimizer = torch.optim.Adam(actor.parameters(), lr=config.learning_rate)
    both = (labels, Labels(*mirrored(*labels)))
    seen, taken = (torch.from_numpy(np.stack(pair)) for pair in zip(*both, strict=True))
    count = len(labels.shares)
    batches = math.ceil(count / config.batch_size)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, epochs * batches)
    # Wider networks, more passes, another seed and classified commands do not do better: see
    # docs/results/history/2026-11-27.md, narrow fields, labels and the shield.
    total = 0.0
    for _ in range(epochs):
        order, side = rng.permutation(count), rng.integers(2, size=count)
        total = 0.0
        for rows in np.array_split(order, batches):
            given = actor(seen[side[rows], rows])
            loss = torch.nn.functional.smooth_l1_loss(
                given, taken[side[rows], rows], beta=config.smooth_l1_beta
            )
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item() / batches
    return actor.policy(info | {"loss": round(total, 6)})
