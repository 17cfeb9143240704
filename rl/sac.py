"""Soft actor-critic on whole episodes (Haarnoja et al. 2018), with the paper's layer sizes.

The paper names actor and critic, not the update. Its one-step update collapses into circling on
some seeds; this one does not, and learns from each decision many times (assumption).
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from rl.goal_laws import ProportionalPolicy
from rl.learner import BaseLearnerConfig, Learner
from rl.networks import (
    Actor,
    SquashedGaussianActor,
    StateCritic,
    TwinCritic,
    polyak_update,
)
from rl.point_set_actor import PointSetActor
from rl.policy import Policy
from rl.replay import Renderer, Replay
from rl.spaces import ActionSpec, ObservationSpec
from rl.training import Episode


class ActorConfig(BaseModel):
    """Settings of the actor's network.

    Attributes:
        kind: Architecture: ``mlp``, or ``points`` for a set of points (Zhang et al., SPN).
        width: Number H of hidden units of a point (assumption).
        features: Number K of global features of the points (paper: 2 to 50, 20 did best).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["mlp", "points"] = "mlp"
    width: int = Field(default=64, ge=8, multiple_of=8)
    features: int = Field(default=20, ge=1)

    def make(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None,
    ) -> SquashedGaussianActor:
        """Return a fresh network; arguments as for ``rl.networks.Actor``."""
        if self.kind == "mlp":
            return Actor(observations, actions, hidden, terms)
        return PointSetActor(observations, actions, hidden, terms, self.width, self.features)


class SacConfig(BaseLearnerConfig):
    """Settings of the learner (assumptions but for the networks).

    Attributes:
        algorithm: Name of the algorithm.
        actor: Settings of the actor's network.
        actor_terms: Names of the observation's terms that the actor reads: for ``mlp`` None reads
            all, for ``points`` they are those of goal and velocities, None for ``goal`` and
            ``velocity``.
        critic_terms: Names of the terms that the critics read, None for all.
        critic_hidden: Width of the critics' hidden layers, None for ``hidden``.
        learning_rate: Adam learning rate.
        gamma: Discount of a decision.
        tau: Share of the critics that moves into their targets at each step.
        batch_size: Number of decisions of a gradient step.
        updates_per_step: Number of gradient steps for each new decision.
        actor_every: Number of gradient steps of the critics for one of actor and temperature.
        warmup_episodes: Number of first episodes that the proportional controller plays (SPN: 100).
        state_value: True to learn the value of states too, and to bootstrap from its target
            network in the place of the critics' (Haarnoja et al. 2018, first version; SPN).
        target_entropy: Entropy of the actions that the temperature is adapted to [nat].
        temperature: Initial weight of the entropy.
        learn_temperature: False to keep the temperature as it is.
        min_temperature: Least temperature that is learnt.
        ema_rate: Share of the actor that moves into its running average at each step; the average
            is the policy that is kept.
        reward_scale: Factor of the rewards.
        buffer_size: Number of decisions that are remembered.
    """

    algorithm: Literal["sac"] = "sac"
    actor: ActorConfig = ActorConfig()
    actor_terms: tuple[str, ...] | None = None
    critic_terms: tuple[str, ...] | None = None
    critic_hidden: tuple[int, ...] | None = None
    learning_rate: float = Field(default=5e-4, gt=0)
    gamma: float = Field(default=0.98, gt=0, lt=1)
    tau: float = Field(default=0.005, gt=0, le=1)
    batch_size: int = Field(default=256, ge=8)
    updates_per_step: float = Field(default=0.3, gt=0)
    actor_every: int = Field(default=1, ge=1)
    warmup_episodes: int = Field(default=0, ge=0)
    state_value: bool = False
    target_entropy: float = Field(default=-0.5)
    temperature: float = Field(default=0.1, gt=0)
    learn_temperature: bool = True
    min_temperature: float = Field(default=0.0, ge=0)
    ema_rate: float = Field(default=0.001, gt=0, le=1)
    reward_scale: float = Field(default=1 / 50, gt=0)
    buffer_size: int = Field(default=200_000, ge=1000)


class SoftActorCritic(Learner):
    """Actor, twin critics, their targets, temperature, optimisers and replay buffer."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        config: SacConfig,
        seed: int,
        renderer: Renderer | None = None,
    ) -> None:
        """Draw fresh networks.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            config: Settings.
            seed: Seed of the weights.
            renderer: Renderer of the observations if episodes hold situations.

        Raises:
            DeviceError: If torch does not find the device.
            KeyError: If the observation has no term of a name.
            ValueError: If the actor or the controller of the warm-up cannot read the observation.
        """
        super().__init__(config.device)
        self.config = config
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self._make_networks(observations, actions)
        temperature = torch.tensor(float(np.log(config.temperature)), device=self.device)
        self.log_temperature = torch.nn.Parameter(temperature)
        self._keep(
            actor=self.actor,
            average=self.average,
            critics=self.critics,
            targets=self.targets,
            temperature=self.log_temperature,
        )
        self.replay = Replay(observations.size, actions.size, config.buffer_size, renderer)
        self._optimise("actor", self.actor.parameters(), config.learning_rate)
        self._optimise("critics", self.critics.parameters(), config.learning_rate)
        self._optimise("temperature", [self.log_temperature], config.learning_rate)
        if self.state_value is not None:
            self._keep(state_value=self.state_value)
            self._optimise("state_value", self.state_value.parameters(), config.learning_rate)
        self._updates = 0
        self._warmup: Policy | None = None
        if config.warmup_episodes:
            self._warmup = ProportionalPolicy({}, observations, actions)

    def _make_networks(self, observations: ObservationSpec, actions: ActionSpec) -> None:
        """Draw the networks, and targets that begin as their networks."""
        config = self.config
        actor = (observations, actions, config.hidden, config.actor_terms)
        hidden = config.hidden if config.critic_hidden is None else config.critic_hidden
        critics = (observations, actions, hidden, config.critic_terms)
        self.actor, self.average = config.actor.make(*actor), config.actor.make(*actor)
        self.critics = TwinCritic(*critics)
        self.state_value: StateCritic | None = None
        self.targets: TwinCritic | StateCritic
        if config.state_value:
            self.state_value, self.targets = (
                StateCritic(observations, hidden, config.critic_terms) for _ in range(2)
            )
            self.targets.load_state_dict(self.state_value.state_dict())
        else:
            self.targets = TwinCritic(*critics)
            self.targets.load_state_dict(self.critics.state_dict())
        self.average.load_state_dict(self.actor.state_dict())
        self.average.requires_grad_(False)
        self.targets.requires_grad_(False)

    def behaviour_policy(self) -> Policy:
        """Return what plays the episodes to learn from: the present actor after the warm-up."""
        if self._warmup is not None and self.replay.episodes < self.config.warmup_episodes:
            return self._warmup
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
        figures, actor_steps = torch.zeros(3, device=self.device), 0
        for _ in range(count):
            batch = self.replay.sample(self.config.batch_size, rng)
            batch = {name: column.to(self.device) for name, column in batch.items()}
            actor_steps += self._updates % self.config.actor_every == 0
            figures += self._update(batch, noise)
            self._updates += 1
        loss, value, entropy = figures.tolist()
        return {
            "critic_loss": loss / count,
            "value": value / count,
            "entropy": entropy / max(actor_steps, 1),
            "temperature": float(self.log_temperature.detach().exp()),
        }

    def _update(self, batch: dict[str, Tensor], noise: torch.Generator) -> Tensor:
        """Take one gradient step of the critics and, when due, of actor and temperature.

        Returns:
            Critic loss, mean value and entropy, shape (3,), on the device; the entropy is 0 where
            the actor takes no step.
        """
        config, states = self.config, batch["states"]
        alpha = self.log_temperature.detach().exp()
        with torch.no_grad():
            next_value = self._next_value(batch["next_states"], alpha, noise)
            td_target = batch["rewards"] + config.gamma * (1 - batch["terminated"]) * next_value
        q = self.critics(states, batch["actions"])
        critic_loss = smooth_l1_loss(q, td_target.expand_as(q))
        self._step("critics", 2 * critic_loss)
        entropy = torch.zeros_like(critic_loss)
        if self._updates % config.actor_every == 0:
            entropy = self._update_actor(states, alpha, noise)
            polyak_update(self.average, self.actor, config.ema_rate)
        if self.state_value is None:
            polyak_update(self.targets, self.critics, config.tau)
        else:
            self._update_state_value(self.state_value, states, alpha, noise)
            polyak_update(self.targets, self.state_value, config.tau)
        return torch.stack([critic_loss, q.mean(), entropy]).detach()

    def _next_value(self, next_states: Tensor, alpha: Tensor, noise: torch.Generator) -> Tensor:
        """Return the soft value of the next states, shape (n,), by the target networks.

        It is the smaller of both critics plus the entropy of the next action, or what the network
        of the state's value says.
        """
        if isinstance(self.targets, StateCritic):
            return self.targets(next_states)
        next_actions, next_log_p = self.actor.sample(next_states, noise)
        next_q = self.targets(next_states, next_actions).amin(dim=0)
        return next_q - alpha * next_log_p

    def _update_actor(self, states: Tensor, alpha: Tensor, noise: torch.Generator) -> Tensor:
        """Take one gradient step of actor and temperature; return the mean entropy."""
        # The actor climbs the smaller critic; the critics only pass the gradient on.
        actions, log_p = self.actor.sample(states, noise)
        self.critics.requires_grad_(False)
        q_pi = self.critics(states, actions).amin(dim=0)
        self._step("actor", (alpha * log_p - q_pi).mean())
        self.critics.requires_grad_(True)
        if self.config.learn_temperature:
            # The temperature rises where the entropy is below its target.
            entropy_error = (log_p.detach() + self.config.target_entropy).mean()
            self._step("temperature", -self.log_temperature * entropy_error)
            if self.config.min_temperature:
                with torch.no_grad():
                    self.log_temperature.clamp_(min=math.log(self.config.min_temperature))
        return -log_p.mean()

    def _update_state_value(
        self, state_value: StateCritic, states: Tensor, alpha: Tensor, noise: torch.Generator
    ) -> None:
        """Take one gradient step of the state's value towards the actor's own soft value."""
        with torch.no_grad():
            actions, log_p = self.actor.sample(states, noise)
            target = self.critics(states, actions).amin(dim=0) - alpha * log_p
        self._step("state_value", smooth_l1_loss(state_value(states), target))

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
