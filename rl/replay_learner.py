"""Base of learners that remember decisions and learn from each many times."""

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import Field
from torch import Tensor
from torch.nn.functional import mse_loss, smooth_l1_loss

from rl.goal_laws import ProportionalPolicy
from rl.learner import BaseLearnerConfig, Learner
from rl.policy import Policy
from rl.replay import Renderer, Replay
from rl.spaces import ActionSpec, ObservationSpec
from rl.training import Episode


class ReplayLearnerConfig(BaseLearnerConfig):
    """Settings that learners with a replay buffer have in common.

    Attributes:
        actor_terms: Names of the observation's terms that the actor reads, None for all.
        critic_terms: Names of the terms that the critics read, None for all.
        critic_hidden: Width of the critics' hidden layers, None for ``hidden``.
        normalised: True to normalise the critics' hidden layers; False for plain dense ones (SPN,
            Fujimoto et al. 2018).
        loss: Loss of the critics: ``squared``, or ``huber``, which grows in a line beyond 1.
        learning_rate: Adam learning rate.
        gamma: Discount of a decision.
        tau: Share of the networks that moves into their targets at each step.
        batch_size: Number of decisions of a gradient step.
        updates_per_step: Number of gradient steps for each new decision.
        policy_delay: Number of gradient steps of the critics for one of the actor.
        warmup_episodes: Number of first episodes that the proportional controller plays (SPN: 100).
        buffer_size: Number of decisions that are remembered.
    """

    actor_terms: tuple[str, ...] | None = None
    critic_terms: tuple[str, ...] | None = None
    critic_hidden: tuple[int, ...] | None = None
    normalised: bool = True
    loss: Literal["squared", "huber"] = "huber"
    learning_rate: float = Field(default=5e-4, gt=0)
    gamma: float = Field(default=0.98, gt=0, lt=1)
    tau: float = Field(default=0.005, gt=0, le=1)
    batch_size: int = Field(default=256, ge=8)
    updates_per_step: float = Field(default=0.3, gt=0)
    policy_delay: int = Field(default=1, ge=1)
    warmup_episodes: int = Field(default=0, ge=0)
    buffer_size: int = Field(default=200_000, ge=1000)


class ReplayLearner(Learner):
    """Replay buffer, count of the gradient steps, and the policy of the warm-up.

    A subclass takes a gradient step, ``_update``, and names its figures.

    Attributes:
        replay: Decisions that are remembered.
    """

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        config: ReplayLearnerConfig,
        renderer: Renderer | None,
    ) -> None:
        """Begin without networks and memories.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            config: Settings.
            renderer: Renderer of the observations if episodes hold situations.

        Raises:
            DeviceError: If torch does not find the device.
            ValueError: If the controller of the warm-up cannot read the observation.
        """
        super().__init__(config.device)
        self._settings = config
        self.replay = Replay(observations.size, actions.size, config.buffer_size, renderer)
        self._updates = 0
        self._warmup: Policy | None = None
        if config.warmup_episodes:
            self._warmup = ProportionalPolicy({}, observations, actions)

    @abstractmethod
    def _exploring_policy(self) -> Policy:
        """Return the present actor, which explores."""

    @abstractmethod
    def _update(self, batch: dict[str, Tensor], noise: torch.Generator) -> Tensor:
        """Take one gradient step of the critics and, when it is due, of the actor.

        Args:
            batch: Columns of decisions; see ``Replay.sample``.
            noise: Draws of actions.

        Returns:
            Critic loss, mean value and the actor's figure, shape (3,), on the device; the last is 0
            where the actor takes no step.
        """

    @abstractmethod
    def _figures(self, critic_loss: float, value: float, of_actor: float) -> dict[str, float]:
        """Return the figures of an update by name, from the means of those of its steps."""

    def _critic_loss(self, values: Tensor, targets: Tensor) -> Tensor:
        """Return the mean loss of values against their targets, both of the same shape."""
        loss = mse_loss if self._settings.loss == "squared" else smooth_l1_loss
        return loss(values, targets)

    @property
    def _is_actor_due(self) -> bool:
        """True if the actor takes a step with the next one of the critics."""
        return self._updates % self._settings.policy_delay == 0

    def behaviour_policy(self) -> Policy:
        """Return what plays the episodes to learn from: the present actor after the warm-up."""
        if self._warmup is not None and self.replay.episodes < self._settings.warmup_episodes:
            return self._warmup
        return self._exploring_policy()

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, lr_scale: float = 1.0
    ) -> dict[str, float]:
        """Remember episodes and learn.

        Args:
            episodes: New ones.
            rng: Draws of minibatches and actions.
            lr_scale: Share of the learning rate.

        Returns:
            Figures of the steps by name.
        """
        config = self._settings
        for name in self._optimisers:
            self._set_learning_rate(name, config.learning_rate * lr_scale)
        fresh = sum(self.replay.add(episode, config.reward_scale) for episode in episodes)
        noise = torch.Generator(self.device).manual_seed(int(rng.integers(2**31)))
        count = max(1, round(fresh * config.updates_per_step))
        figures, actor_steps = torch.zeros(3, device=self.device), 0
        for _ in range(count):
            batch = self.replay.sample(config.batch_size, rng)
            batch = {name: column.to(self.device) for name, column in batch.items()}
            actor_steps += self._is_actor_due
            figures += self._update(batch, noise)
            self._updates += 1
        loss, value, of_actor = figures.tolist()
        return self._figures(loss / count, value / count, of_actor / max(actor_steps, 1))

    def to_bytes(self, progress: dict[str, Any], others: Mapping[str, Tensor]) -> bytes:
        """Return everything that learning needs to go on, what is remembered and ``others``."""
        updates = {"updates": torch.tensor(self._updates)}
        return super().to_bytes(progress, {**self.replay.tensors(), **updates, **others})

    def restore(self, data: bytes) -> dict[str, Tensor]:
        """Take up the state of ``to_bytes`` and return its tensors.

        Raises:
            CheckpointError: If the bytes are no checkpoint of such a learner.
        """
        tensors = super().restore(data)
        self.replay.restore(tensors)
        self._updates = int(tensors["updates"])
        return tensors
