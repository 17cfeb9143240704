"""Distillation of the sampling MPC into a policy (DAgger; Ross, Gordon and Bagnell 2011).

Each round drives in generated fields by turns of the expert and of the last policy, and labels
every state with the expert's command; then a network is fitted to all labels so far. What the
policy gets into by its own mistakes is labelled, too, which drives of the expert alone never show.
"""

import io
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.engine_processes import run_tasks
from andabata.navigation.planar.distilled_observation import ACTIONS, OBSERVATIONS, mirrored
from andabata.runs import atomic_io
from andabata.runs.folder import commit, make_folder
from andabata.runs.strict_json import dumps
from andabata.training.expert_labels import (
    LabelledDrive,
    LabelledDriveConfig,
    Labels,
    drive_and_label,
)
from rl.policy import Policy, load_policy


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
        if len(self.expert_shares) != len(self.drives) or min(self.drives) < 1:
            raise ValueError(
                f"drives, expert_shares: expected one number for each round, 1 drive at least, got "
                f"{self.drives} and {self.expert_shares}"
            )
        if self.expert_shares[0] != 1.0 or not all(0 <= share <= 1 for share in self.expert_shares):
            raise ValueError(
                f"expert_shares: expected 1 in the first round, which has no policy, and shares "
                f"from 0 to 1, got {self.expert_shares}"
            )
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
    _check_folder(config, seed, folder)
    labels_by_round: list[Labels] = []
    results: list[RoundResult] = []
    policy: Policy | None = None
    for k in range(len(config.drives)):
        labels, reached = _labels(config, seed, folder, k, policy, workers, on_drive)
        labels_by_round.append(labels)
        file = folder / f"round-{k}.safetensors"
        if file.exists():
            policy = load_policy(file)
        else:
            # Labels of all rounds (DAgger, Ross et al. 2011): fitted to the last round's alone, a
            # policy forgets the states that the rounds before had led it to.
            together = Labels(
                *(np.concatenate(parts) for parts in zip(*labels_by_round, strict=True))
            )
            info = {"config": config.model_dump(mode="json"), "seed": seed, "commit": commit()}
            info |= {"round": k, "labels": len(together.shares), "reached": reached}
            is_last = k == len(config.drives) - 1
            epochs = config.last_epochs if is_last else config.epochs
            policy = fit(together, config, epochs, seed, info, policy)
            atomic_io.write(file, policy.to_bytes())
        results.append(
            RoundResult(k, policy.info["labels"], policy.info["reached"], policy.info["loss"])
        )
    assert policy is not None
    return policy, results


def _labels(
    config: DistillationConfig,
    seed: int,
    folder: Path,
    k: int,
    policy: Policy | None,
    workers: int,
    on_drive: Callable[[int, int], None] | None,
) -> tuple[Labels, float]:
    """Return the labels of a round from its file, or drive them, and the share that arrived."""
    file = folder / f"round-{k}.npz"
    if not file.exists():
        first = sum(config.drives[:k])
        drives = [
            LabelledDrive(first + n, config.expert_shares[k]) for n in range(config.drives[k])
        ]
        data = None if policy is None else policy.to_bytes()
        work = partial(drive_and_label, config.driving, seed, data)
        driven = []
        for _, one in run_tasks(work, drives, workers):
            driven.append(one)
            if on_drive is not None:
                on_drive(k, 1)
        buffer = io.BytesIO()
        np.savez(
            buffer,
            observations=np.concatenate([labels.observations for labels, _ in driven]),
            shares=np.concatenate([labels.shares for labels, _ in driven]),
            reached=np.mean([arrived for _, arrived in driven]),
        )
        atomic_io.write(file, buffer.getvalue())
    elif on_drive is not None:
        on_drive(k, config.drives[k])
    with np.load(file, allow_pickle=False) as kept:
        return Labels(kept["observations"], kept["shares"]), float(kept["reached"])


def _check_folder(config: DistillationConfig, seed: int, folder: Path) -> None:
    """Write what a folder holds, or refuse one that holds something else.

    Raises:
        ValueError: If it holds another distillation.
    """
    file = make_folder(folder) / "distillation.json"
    description = dumps({"config": config.model_dump(mode="json"), "seed": seed}, indent=1)
    if file.exists() and file.read_text() != description:
        raise ValueError(
            f"{folder}: expected a distillation with these settings and this seed, got another "
            "one; give another --out"
        )
    atomic_io.write(file, description.encode())


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
