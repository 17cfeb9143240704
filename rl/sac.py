"""Soft actor-critic on whole episodes (Haarnoja et al. 2018), with the paper's layer sizes.

The paper names actor and critic, not the update. Its one-step update collapses into circling on
some seeds; this one does not, and learns from each decision many times (assumption).
"""

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from rl.critics import StateCritic, TwinCritic
from rl.networks import Actor, SquashedGaussianActor, polyak_update
from rl.point_set_actor import PointSetActor
from rl.policy import Policy
from rl.replay import Renderer
from rl.replay_learner import ReplayLearner, ReplayLearnerConfig
from rl.spaces import ActionSpec, ObservationSpec


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


class SacConfig(ReplayLearnerConfig):
    """Settings of the learner (assumptions but for the networks).

    Attributes:
        algorithm: Name of the algorithm.
        actor: Settings of the actor's network.
        actor_terms: Names of the observation's terms that the actor reads: for ``mlp`` None reads
            all, for ``points`` they are those of goal and velocities, None for ``goal`` and
            ``velocity``.
        state_value: True to learn the value of states too, and to bootstrap from its target
            network in the place of the critics' (Haarnoja et al. 2018, first version; SPN).
        target_entropy: Entropy of the actions that the temperature is adapted to [nat].
        temperature: Initial weight of the entropy.
        learn_temperature: False to keep the temperature as it is.
        min_temperature: Least temperature that is learnt.
        ema_rate: Share of the actor that moves into its running average at each step; the average
            is the policy that is kept.
        reward_scale: Factor of the rewards.
    """

    algorithm: Literal["sac"] = "sac"
    actor: ActorConfig = ActorConfig()
    state_value: bool = False
    target_entropy: float = Field(default=-0.5)
    temperature: float = Field(default=0.1, gt=0)
    learn_temperature: bool = True
    min_temperature: float = Field(default=0.0, ge=0)
    ema_rate: float = Field(default=0.001, gt=0, le=1)
    reward_scale: float = Field(default=1 / 50, gt=0)


class SoftActorCritic(ReplayLearner):
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
        super().__init__(observations, actions, config, renderer)
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
        self._optimise("actor", self.actor.parameters(), config.learning_rate)
        self._optimise("critics", self.critics.parameters(), config.learning_rate)
        self._optimise("temperature", [self.log_temperature], config.learning_rate)
        if self.state_value is not None:
            self._keep(state_value=self.state_value)
            self._optimise("state_value", self.state_value.parameters(), config.learning_rate)

    def _make_networks(self, observations: ObservationSpec, actions: ActionSpec) -> None:
        """Draw the networks, and targets that begin as their networks."""
        config = self.config
        actor = (observations, actions, config.hidden, config.actor_terms)
        hidden = config.hidden if config.critic_hidden is None else config.critic_hidden
        critics = (observations, actions, hidden, config.critic_terms)
        self.actor, self.average = config.actor.make(*actor), config.actor.make(*actor)
        self.critics = TwinCritic(*critics, normalised=config.normalised)
        self.state_value: StateCritic | None = None
        self.targets: TwinCritic | StateCritic
        if config.state_value:
            values = (observations, hidden, config.critic_terms)
            self.state_value, self.targets = (
                StateCritic(*values, config.normalised) for _ in range(2)
            )
            self.targets.load_state_dict(self.state_value.state_dict())
        else:
            self.targets = TwinCritic(*critics, normalised=config.normalised)
            self.targets.load_state_dict(self.critics.state_dict())
        self.average.load_state_dict(self.actor.state_dict())
        self.average.requires_grad_(False)
        self.targets.requires_grad_(False)

    def _exploring_policy(self) -> Policy:
        """Return the present actor, which explores."""
        return self.actor.policy({})

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the running average of the actors as a complete policy."""
        return self.average.policy(info)

    def _figures(self, critic_loss: float, value: float, of_actor: float) -> dict[str, float]:
        """Return mean critic loss, value and entropy of the actions, and the temperature."""
        return {
            "critic_loss": critic_loss,
            "value": value,
            "entropy": of_actor,
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
        critic_loss = self._critic_loss(q, td_target.expand_as(q))
        self._step("critics", 2 * critic_loss)
        entropy = torch.zeros_like(critic_loss)
        if self._is_actor_due:
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
        # The actor climbs the smaller critic.
        actions, log_p = self.actor.sample(states, noise)
        q_pi = self.critics(states, actions).amin(dim=0)
        self._step("actor", (alpha * log_p - q_pi).mean())
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
        self._step("state_value", self._critic_loss(state_value(states), target))
