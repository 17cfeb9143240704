"""Soft actor-critic on whole episodes (Haarnoja et al. 2018), with the paper's layer sizes.

The paper names actor and critic, not the update. Its one-step update collapses into circling on
some seeds; this one does not, and learns from each decision many times (assumption).
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import Field
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from rl.learner import BaseLearnerConfig, Learner
from rl.networks import Actor, TwinCritic, polyak_update
from rl.policy import Policy
from rl.replay import Replay
from rl.spaces import ActionSpec, ObservationSpec
from rl.training import Episode


class SacConfig(BaseLearnerConfig):
    """Settings of the learner (assumptions but for the networks).

    Attributes:
        algorithm: Name of the algorithm.
        learning_rate: Adam learning rate.
        gamma: Discount of a decision.
        tau: Share of the critics that moves into their targets at each step.
        batch_size: Number of decisions of a gradient step.
        updates_per_step: Number of gradient steps for each new decision.
        target_entropy: Entropy of the actions that the temperature is adapted to [nat].
        temperature: Initial weight of the entropy.
        ema_rate: Share of the actor that moves into its running average at each step; the average
            is the policy that is kept.
        reward_scale: Factor of the rewards.
        buffer_size: Number of decisions that are remembered.
    """

    algorithm: Literal["sac"] = "sac"
    learning_rate: float = Field(default=5e-4, gt=0)
    gamma: float = Field(default=0.98, gt=0, lt=1)
    tau: float = Field(default=0.005, gt=0, le=1)
    batch_size: int = Field(default=256, ge=8)
    updates_per_step: float = Field(default=0.3, gt=0)
    target_entropy: float = Field(default=-0.5)
    temperature: float = Field(default=0.1, gt=0)
    ema_rate: float = Field(default=0.001, gt=0, le=1)
    reward_scale: float = Field(default=1 / 50, gt=0)
    buffer_size: int = Field(default=200_000, ge=1000)


class SoftActorCritic(Learner):
    """Actor, twin critics, their targets, temperature, optimisers and replay buffer."""

    def __init__(
        self, observations: ObservationSpec, actions: ActionSpec, config: SacConfig, seed: int
    ) -> None:
        """Draw fresh networks.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            config: Settings.
            seed: Seed of the weights.

        Raises:
            DeviceError: If torch does not find the device.
        """
        super().__init__(config.device)
        self.config = config
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor = Actor(observations, actions, config.hidden)
            self.average = Actor(observations, actions, config.hidden)
            self.critics = TwinCritic(observations, actions, config.hidden)
            self.targets = TwinCritic(observations, actions, config.hidden)
        self.average.load_state_dict(self.actor.state_dict())
        self.targets.load_state_dict(self.critics.state_dict())
        self.average.requires_grad_(False)
        self.targets.requires_grad_(False)
        temperature = torch.tensor(float(np.log(config.temperature)), device=self.device)
        self.log_temperature = torch.nn.Parameter(temperature)
        self._keep(
            actor=self.actor,
            average=self.average,
            critics=self.critics,
            targets=self.targets,
            temperature=self.log_temperature,
        )
        self.replay = Replay(observations.size, actions.size, config.buffer_size)
        self._optimise("actor", self.actor.parameters(), config.learning_rate)
        self._optimise("critics", self.critics.parameters(), config.learning_rate)
        self._optimise("temperature", [self.log_temperature], config.learning_rate)

    def behaviour_policy(self) -> Policy:
        """Return the present actor, which plays the episodes to learn from."""
        return self.actor.policy({})

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the running average of the actors as a complete policy."""
        return self.average.policy(info)

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, lr_scale: float = 1.0
    ) -> dict[str, float]:
        """Remember episodes and learn.

        Args:
            episodes: New ones.
            rng: Draws of minibatches and actions.
            lr_scale: Share of the learning rate.

        Returns:
            Mean critic loss, value and entropy of the actions, and the temperature.
        """
        for name in self._optimisers:
            self._set_learning_rate(name, self.config.learning_rate * lr_scale)
        fresh = sum(self.replay.add(episode, self.config.reward_scale) for episode in episodes)
        noise = torch.Generator(self.device).manual_seed(int(rng.integers(2**31)))
        count = max(1, round(fresh * self.config.updates_per_step))
        figures = torch.zeros(3, device=self.device)
        for _ in range(count):
            batch = self.replay.sample(self.config.batch_size, rng)
            batch = {name: column.to(self.device) for name, column in batch.items()}
            figures += self._update(batch, noise)
        loss, value, entropy = (figures / count).tolist()
        return {
            "critic_loss": loss,
            "value": value,
            "entropy": entropy,
            "temperature": float(self.log_temperature.detach().exp()),
        }

    def _update(self, batch: dict[str, Tensor], noise: torch.Generator) -> Tensor:
        """Take one gradient step of critics, actor and temperature.

        Returns:
            Critic loss, mean value and entropy, shape (3,), on the device.
        """
        config, states = self.config, batch["states"]
        alpha = self.log_temperature.detach().exp()
        # Soft Bellman target: the smaller of both targets, plus the entropy of the next action.
        with torch.no_grad():
            next_actions, next_log_p = self.actor.sample(batch["next_states"], noise)
            next_q = self.targets(batch["next_states"], next_actions).amin(dim=0)
            next_value = next_q - alpha * next_log_p
            td_target = batch["rewards"] + config.gamma * (1 - batch["terminated"]) * next_value
        q = self.critics(states, batch["actions"])
        critic_loss = smooth_l1_loss(q, td_target.expand_as(q))
        self._step("critics", 2 * critic_loss)
        # The actor climbs the smaller critic; the critics only pass the gradient on.
        actions, log_p = self.actor.sample(states, noise)
        self.critics.requires_grad_(False)
        q_pi = self.critics(states, actions).amin(dim=0)
        self._step("actor", (alpha * log_p - q_pi).mean())
        self.critics.requires_grad_(True)
        # The temperature rises where the entropy is below its target.
        entropy_error = (log_p.detach() + config.target_entropy).mean()
        self._step("temperature", -self.log_temperature * entropy_error)
        polyak_update(self.targets, self.critics, config.tau)
        polyak_update(self.average, self.actor, config.ema_rate)
        return torch.stack([critic_loss, q.mean(), -log_p.mean()]).detach()

    def to_bytes(self, progress: dict[str, Any], others: Mapping[str, Tensor]) -> bytes:
        """Return everything that learning needs to go on, what is remembered and ``others``."""
        return super().to_bytes(progress, {**self.replay.tensors(), **others})

    def restore(self, data: bytes) -> dict[str, Tensor]:
        """Take up the state of ``to_bytes`` and return its tensors.

        Raises:
            CheckpointError: If the bytes are no checkpoint of such a learner.
        """
        tensors = super().restore(data)
        self.replay.restore(tensors)
        return tensors
