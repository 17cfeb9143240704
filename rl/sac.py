"""Soft actor-critic on whole episodes (Haarnoja et al. 2018), with the paper's layer sizes.

The paper names actor and critic, not the update. Its one-step update collapses into circling on
some seeds; this one does not, and learns from each decision many times (assumption).
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from rl.learner import Device, Learner
from rl.networks import Actor, TwinCritic
from rl.policy import Policy
from rl.replay import Replay
from rl.spaces import ObservationLayout
from rl.training import Episode


class SacConfig(BaseModel):
    """Numbers of the learner (assumptions but for the networks).

    Attributes:
        algorithm: Its name.
        hidden: Width of the hidden layers (paper: 200, 200).
        learning_rate: Of Adam.
        discount: Of a decision.
        smoothing: Share of the critics that moves into their targets at each step.
        minibatch: Decisions of a gradient step.
        steps_per_decision: Gradient steps for each new decision.
        entropy: Wanted entropy of the actions [nat].
        temperature: First weight of the entropy.
        averaging: Share of the actor that moves into its running average at each step; the average
            is the policy that is kept.
        hold: Control steps that an action is held while training; judged at 10 Hz.
        reward_scale: Rewards are multiplied by this.
        batch: Episodes of a generation.
        capacity: Decisions that are remembered.
        device: Where gradients are computed; see ``rl.learner``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    algorithm: Literal["sac"] = "sac"
    hidden: tuple[int, ...] = (200, 200)
    learning_rate: float = Field(default=5e-4, gt=0)
    discount: float = Field(default=0.98, gt=0, lt=1)
    smoothing: float = Field(default=0.005, gt=0, le=1)
    minibatch: int = Field(default=256, ge=8)
    steps_per_decision: float = Field(default=0.3, gt=0)
    entropy: float = Field(default=-0.5)
    temperature: float = Field(default=0.1, gt=0)
    averaging: float = Field(default=0.001, gt=0, le=1)
    hold: int = Field(default=5, ge=1)
    reward_scale: float = Field(default=1 / 50, gt=0)
    batch: int = Field(default=8, ge=1)
    capacity: int = Field(default=200_000, ge=1000)
    device: Device = "cpu"


class SoftActorCritic(Learner):
    """Actor, twin critics, their targets, temperature, optimisers and memory."""

    def __init__(
        self,
        layout: ObservationLayout,
        max_range: float,
        limit: float,
        config: SacConfig,
        seed: int,
    ) -> None:
        """Draw fresh networks.

        Args:
            layout: The state.
            max_range: Largest range of the state [m].
            limit: Largest yaw rate [rad/s].
            config: Numbers.
            seed: Of the weights.

        Raises:
            DeviceError: If torch does not find the device.
        """
        super().__init__(config.device)
        self.config = config
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor = Actor(layout, max_range, limit, config.hidden)
            self.average = Actor(layout, max_range, limit, config.hidden)
            self.critics = TwinCritic(layout, limit, config.hidden)
            self.targets = TwinCritic(layout, limit, config.hidden)
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
        self.replay = Replay(layout.size, config.capacity)
        self._optimise("actor", self.actor.parameters(), config.learning_rate)
        self._optimise("critics", self.critics.parameters(), config.learning_rate)
        self._optimise("temperature", [self.log_temperature], config.learning_rate)

    def explorer(self, dead_zone: float) -> Policy:
        """Return the present actor, which plays the episodes to learn from."""
        return self.actor.policy(dead_zone, {})

    def policy(self, dead_zone: float, info: dict[str, Any]) -> Policy:
        """Return the average of the latest actors as a complete policy."""
        return self.average.policy(dead_zone, info)

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, pace: float = 1.0
    ) -> dict[str, float]:
        """Remember episodes and learn.

        Args:
            episodes: New ones.
            rng: Draws minibatches and actions.
            pace: Share of the learning rate.

        Returns:
            Mean critic loss, value and entropy of the actions, and the temperature.
        """
        for name in self._optimisers:
            self._set_rate(name, self.config.learning_rate * pace)
        fresh = sum(self.replay.add(episode, self.config.reward_scale) for episode in episodes)
        noise = torch.Generator(self.device).manual_seed(int(rng.integers(2**31)))
        count = max(1, round(fresh * self.config.steps_per_decision))
        figures = torch.zeros(3, device=self.device)
        for _ in range(count):
            rows = self.replay.draw(self.config.minibatch, rng)
            rows = {name: column.to(self.device) for name, column in rows.items()}
            figures += self._descend(rows, noise)
        loss, value, entropy = (figures / count).tolist()
        return {
            "critic_loss": loss,
            "value": value,
            "entropy": entropy,
            "temperature": float(self.log_temperature.detach().exp()),
        }

    def _descend(self, rows: dict[str, Tensor], noise: torch.Generator) -> Tensor:
        """Take one gradient step of critics, actor and temperature.

        Returns:
            Critic loss, mean value and entropy, shape (3,), which nobody waits for.
        """
        config = self.config
        temperature = self.log_temperature.detach().exp()
        with torch.no_grad():
            actions, log_p = self.actor.sample(rows["next_states"], noise)
            later = self.targets(rows["next_states"], actions).amin(dim=0) - temperature * log_p
            wanted = rows["rewards"] + config.discount * (1 - rows["terminated"]) * later
        values = self.critics(rows["states"], rows["actions"])
        critic_loss = torch.nn.functional.smooth_l1_loss(values, wanted.expand_as(values))
        self._step("critics", 2 * critic_loss)
        actions, log_p = self.actor.sample(rows["states"], noise)
        self.critics.requires_grad_(False)  # The critics only pass the gradient on.
        gain = self.critics(rows["states"], actions).amin(dim=0)
        self._step("actor", (temperature * log_p - gain).mean())
        self.critics.requires_grad_(True)
        surplus = (log_p.detach() + config.entropy).mean()
        self._step("temperature", -self.log_temperature * surplus)
        _follow(self.targets, self.critics, config.smoothing)
        _follow(self.average, self.actor, config.averaging)
        return torch.stack([critic_loss, values.mean(), -log_p.mean()]).detach()

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


@torch.no_grad()
def _follow(follower: torch.nn.Module, leader: torch.nn.Module, share: float) -> None:
    """Move a share of one network's numbers into another's."""
    for slow, fast in zip(follower.parameters(), leader.parameters(), strict=True):
        slow.lerp_(fast, share)
