"""Imitation of a teacher that knows the true map by a policy that sees the robot's map.

The student learns what each action costs beyond the best one, not which action the teacher takes:
where the map does not show what the teacher knows, the mean over what it may hide weighs risks.
"""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.navigation.map_observation import (
    action_shares,
    action_table,
    map_actions,
    mirrored_actions,
    mirrored_observations,
)
from andabata.runs.folder import commit
from andabata.training.dagger import Arrays, check_rounds, drive_round, kept_round, run_rounds
from andabata.training.map_labels import MapLabels, MapLabelsConfig, drive_and_label
from rl.policies.crop_prices import crop_terms, number_terms
from rl.policy import Policy, load_policy


class ImitationConfig(BaseModel):
    """Settings of an imitation.

    Attributes:
        driving: Settings of the drives.
        drives: Number of drives of each round; as many rounds as numbers.
        teacher_shares: Share of the time that the teacher steers in each round; all of it in the
            first.
        reads: Names of the terms of the observation that the student reads, None for all.
        hidden: Width of each dense layer.
        epochs: Number of passes over all labels in each round.
        batch_size: Number of labels in a step.
        learning_rate: Adam learning rate at the begin of a round; it falls to zero along a cosine.
        clip: Largest price beyond the best action's that is learned [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    driving: MapLabelsConfig = Field(default_factory=MapLabelsConfig)
    drives: tuple[int, ...] = Field(default=(80, 80, 80, 80, 80), min_length=1)
    teacher_shares: tuple[float, ...] = (1.0, 0.4, 0.2, 0.1, 0.1)
    reads: tuple[str, ...] | None = None
    hidden: tuple[int, ...] = (128, 128)
    epochs: int = Field(default=8, ge=1)
    batch_size: int = Field(default=64, ge=1)
    learning_rate: float = Field(default=1e-3, gt=0)
    clip: float = Field(default=8.0, gt=0)

    @model_validator(mode="after")
    def _check_rounds(self) -> Self:
        """Refuse rounds without drives or without a driver."""
        check_rounds(self.drives, self.teacher_shares, "teacher_shares")
        return self

    @model_validator(mode="after")
    def _check_reads(self) -> Self:
        """Refuse a student without a crop or without numbers, and unknown terms."""
        known = [term.name for term in self.driving.observations.terms]
        if self.reads is not None:
            read = self.driving.observations.only([name for name in self.reads if name in known])
            if set(self.reads) - set(known) or not crop_terms(read) or not number_terms(read):
                raise ValueError(
                    f"reads: expected map_near, map_far or both, and others of {', '.join(known)}, "
                    f"got {', '.join(self.reads)}"
                )
        return self


class ImitationRound(NamedTuple):
    """What a round came to.

    Attributes:
        round: Number of the round.
        labels: Number of labels so far.
        goals: Number of goals that its drives tried.
        reached: Share of them that were reached.
        loss: Mean loss of the last pass.
        regret: Mean price of the student's choice beyond the best action's, over labels that it
            was fitted to, each at most ``clip`` [s].
    """

    round: int
    labels: int
    goals: int
    reached: float
    loss: float
    regret: float


def imitate(
    config: ImitationConfig,
    seed: int,
    folder: Path,
    workers: int = 1,
    on_drive: Callable[[int, int], None] | None = None,
) -> tuple[Policy, list[ImitationRound]]:
    """Teach a policy, and return it with what the rounds came to.

    Each finished round is a file of labels and one of the policy, from which an imitation that was
    killed goes on.

    Args:
        config: Settings.
        seed: Seed of all drives and of the network.
        folder: Folder of the rounds.
        workers: Number of processes; the result does not depend on it.
        on_drive: Function that is called with the round and a number of drives that are done.

    Raises:
        ValueError: If the folder holds something else, or its files are damaged.
    """
    policies = run_rounds(
        folder,
        {"config": config.model_dump(mode="json"), "seed": seed},
        len(config.drives),
        lambda k, policy: _labels(config, seed, k, policy, workers, on_drive),
        lambda k, rounds, start: _fitted(config, seed, k, rounds, start),
        lambda k: None if on_drive is None else on_drive(k, config.drives[k]),
    )
    names = ImitationRound._fields
    results = [ImitationRound(*(policy.info[name] for name in names)) for policy in policies]
    return policies[-1], results


def _labels(
    config: ImitationConfig,
    seed: int,
    k: int,
    policy: Policy | None,
    workers: int,
    on_drive: Callable[[int, int], None] | None,
) -> Arrays:
    """Return the labels of a round, and how many goals its drives tried and reached."""
    first = sum(config.drives[:k])
    data = None if policy is None else policy.to_bytes()
    work = partial(drive_and_label, config.driving, seed, data, config.teacher_shares[k])
    told = (lambda: None) if on_drive is None else partial(on_drive, k, 1)
    driven = drive_round(work, range(first, first + config.drives[k]), workers, told)
    outcomes = [outcome for one in driven for outcome in one.outcomes]
    return {
        "observations": np.concatenate([one.labels.observations for one in driven]),
        "prices": np.concatenate([one.labels.prices for one in driven]),
        "goals": np.array(len(outcomes)),
        "reached": np.array(outcomes.count("goal")),
    }


def _fitted(
    config: ImitationConfig, seed: int, k: int, rounds: list[Arrays], start: Policy | None
) -> Policy:
    """Return the policy of a round, fitted to the labels of all rounds."""
    labels = MapLabels(
        *(np.concatenate([one[name] for one in rounds]) for name in ("observations", "prices"))
    )
    tried = int(rounds[-1]["goals"])
    info = {"config": config.model_dump(mode="json"), "seed": seed, "commit": commit()}
    info |= {"round": k, "labels": len(labels.prices), "goals": tried}
    info["reached"] = int(rounds[-1]["reached"]) / max(tried, 1)
    return fit(labels, config, seed, info, start)


def labelled_config(folder: Path) -> ImitationConfig:
    """Return the settings of the rounds in a folder of ``imitate``.

    Raises:
        ValueError: If it holds no finished round.
    """
    first = folder / "round-0.safetensors"
    if not first.exists():
        raise ValueError(no_rounds(folder))
    return ImitationConfig.model_validate(load_policy(first).info["config"])


def refit(config: ImitationConfig, seed: int, folder: Path) -> tuple[Policy, ImitationRound]:
    """Return a policy that is fitted from fresh weights to labels which are there already.

    Args:
        config: Settings; labels are those of its first rounds, as many as ``drives`` has numbers.
        seed: Seed of the network and of the order.
        folder: Folder of the rounds.

    Raises:
        ValueError: If the folder has not as many finished rounds, or they were driven with other
            settings.
    """
    if labelled_config(folder).driving != config.driving:
        raise ValueError(
            f"driving: expected the settings of {folder}, got others; leave `driving` as it is, "
            "or make labels of your own without --labels"
        )
    files = [folder / f"round-{k}.npz" for k in range(len(config.drives))]
    if missing := [file for file in files if not file.exists()]:
        raise ValueError(
            f"{missing[0]}: expected {len(files)} finished rounds, got fewer; give as many "
            f"numbers of `drives` and `teacher_shares` as {folder} has rounds"
        )
    rounds = [kept_round(file) for file in files]
    policy = _fitted(config, seed, len(rounds) - 1, rounds, None)
    return policy, ImitationRound(*(policy.info[name] for name in ImitationRound._fields))


def fit(
    labels: MapLabels,
    config: ImitationConfig,
    seed: int,
    info: dict[str, Any],
    start: Policy | None = None,
) -> Policy:
    """Return a policy that is fitted to what each action costs beyond the best one.

    Each batch is taken as it is or with left and right exchanged, at random.

    Args:
        labels: Labels.
        config: Settings.
        seed: Seed of the weights and of the order.
        info: Description for the policy, to which its loss and regret are added.
        start: Policy from whose weights to begin, None for fresh ones.

    Raises:
        ValueError: If there are no labels.
    """
    import torch

    from rl.crop_actor import CropActor
    from rl.networks import use_one_thread

    check_labels(labels)
    use_one_thread()
    torch.manual_seed(seed)
    rng = np.random.default_rng([seed, len(labels.prices)])
    robot, spec = config.driving.simulated_robot.robot, config.driving.observations
    actor = CropActor(spec, map_actions(robot), action_shares(robot), config.hidden, config.reads)
    if start is not None:
        actor.load(start)
    optimizer = torch.optim.Adam(actor.parameters(), lr=config.learning_rate)
    count = len(labels.prices)
    batches = math.ceil(count / config.batch_size)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, config.epochs * batches)
    images = mirrored_actions(action_table(robot))
    loss_of = torch.nn.functional.smooth_l1_loss
    total = regret = 0.0
    for _ in range(config.epochs):
        total = regret = 0.0
        for rows in np.array_split(rng.permutation(count), batches):
            seen, wanted = labels.observations[rows].astype(np.float32), labels.prices[rows]
            if rng.random() < 0.5:
                seen, wanted = mirrored_observations(seen, spec), wanted[:, images]
            beyond = torch.from_numpy(beyond_best(wanted, config.clip))
            given = actor(torch.from_numpy(seen))
            loss = loss_of(given, beyond)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item() / batches
            chosen = given.detach().argmin(dim=1, keepdim=True)
            regret += beyond.gather(1, chosen).mean().item() / batches
    return actor.policy(info | {"loss": round(total, 6), "regret": round(regret, 6)})


def check_labels(labels: MapLabels) -> None:
    """Refuse labels without a decision.

    Raises:
        ValueError: If there are none.
    """
    if not len(labels.prices):
        raise ValueError(
            "drives: expected decisions to learn from, got none: a robot decides from its first "
            "scan on, 2 to 3 s after its start; give a longer driving.terminations.time_limit"
        )


def beyond_best(prices: NDArray[np.float32], clip: float) -> NDArray[np.float32]:
    """Return what each action costs beyond the best one [s], at most ``clip``, shape (n, a)."""
    return np.minimum(prices - prices.min(axis=1, keepdims=True), np.float32(clip))


def no_rounds(folder: Path) -> str:
    """Return the error about a folder without a finished round."""
    return (
        f"{folder}: expected rounds of an imitation, got none that is finished; make them with "
        f"`andabata policy imitate --out {folder}`"
    )
