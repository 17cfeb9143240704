"""Twin delayed deterministic policy gradient (TD3, Fujimoto et al. 2018) on whole episodes.

The learner of GDAE (Cimurs et al. 2022) and of the improved TD3 (Guo et al., section 2.1),
distinguished by their settings: where the critics take the action in (``Fusion``), how the
exploration noise decays, widths and rates. The defaults are ours (assumptions), but for the
smoothing of targets and the delay, which are Fujimoto's.
"""

from typing import Any, Literal

import torch
from pydantic import Field
from torch import Tensor

from rl.critics import Fusion, TwinCritic
from rl.networks import DeterministicActor, polyak_update
from rl.policies.deterministic import EXPLORATION
from rl.policies.exploration import Exploration, NoiseSchedule, RandomTurns
from rl.policy import Policy
from rl.replay import Renderer
from rl.replay_learner import ReplayLearner, ReplayLearnerConfig
from rl.spaces import ActionSpec, ObservationSpec


class Td3Config(ReplayLearnerConfig):
    """Settings of the learner.

    Attributes:
        algorithm: Name of the algorithm.
        fusion: Way in which the critics bring state and action together.
        gamma: Discount of a decision (GDAE: 0.99999).
        tau: Share of the networks that moves into their targets with each step of the actor (GDAE:
            0.005).
        batch_size: Number of decisions of a gradient step (GDAE: 40).
        updates_per_step: Number of gradient steps for each new decision (GDAE: 1).
        policy_delay: Number of gradient steps of the critics for one of the actor and of all
            targets: the delay.
        loss: Loss of the critics (Fujimoto et al.: ``squared``).
        target_noise: Standard deviation of the noise on the targets' actions, in shares.
        target_noise_clip: Bound of that noise.
        noise: Schedule of the exploration's noise.
        random_turns: Random turns near obstacles, or None.
        policy_network: Network that is the policy: the ``actor``, or its ``target``, its running
            average.
    """

    algorithm: Literal["td3"] = "td3"
    fusion: Fusion = Fusion()
    gamma: float = Field(default=0.99, gt=0, lt=1)
    tau: float = Field(default=0.01, gt=0, le=1)
    batch_size: int = Field(default=128, ge=8)
    updates_per_step: float = Field(default=1 / 32, gt=0)
    policy_delay: int = Field(default=2, ge=1)
    loss: Literal["squared", "huber"] = "squared"
    target_noise: float = Field(default=0.2, ge=0)
    target_noise_clip: float = Field(default=0.5, ge=0)
    noise: NoiseSchedule = NoiseSchedule()
    random_turns: RandomTurns | None = None
    policy_network: Literal["actor", "target"] = "actor"


class TwinDelayed(ReplayLearner):
    """Actor, twin critics, their targets, optimisers and replay buffer."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        config: Td3Config,
        seed: int,
        renderer: Renderer | None = None,
    ) -> None:
        """Draw fresh networks, and targets that begin as their networks.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            config: Settings.
            seed: Seed of the weights.
            renderer: Renderer of the observations if episodes hold situations.

        Raises:
            DeviceError: If torch does not find the device.
            KeyError: If the observation has no term of a name.
            ValueError: If the fusion has no layer, or the controller of the warm-up cannot read the
                observation.
        """
        super().__init__(observations, actions, config, renderer)
        self.config = config
        hidden = config.hidden if config.critic_hidden is None else config.critic_hidden
        actor = (observations, actions, config.hidden, config.actor_terms)
        critics = (observations, actions, hidden, config.critic_terms)
        fusion = (config.fusion, config.normalised)
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor, self.target_actor = (DeterministicActor(*actor) for _ in range(2))
            self.critics, self.target_critics = (TwinCritic(*critics, *fusion) for _ in range(2))
        self.target_actor.load_state_dict(self.actor.state_dict())
        self.target_critics.load_state_dict(self.critics.state_dict())
        self._keep(
            actor=self.actor,
            target_actor=self.target_actor,
            critics=self.critics,
            target_critics=self.target_critics,
        )
        self._optimise("actor", self.actor.parameters(), config.learning_rate)
        learnt = [one for one in self.critics.parameters() if one.requires_grad]
        self._optimise("critics", learnt, config.learning_rate)

    @property
    def _sigma(self) -> float:
        """Standard deviation of the exploration's noise now."""
        return self.config.noise.sigma(self.replay.decisions)

    def _exploring_policy(self) -> Policy:
        """Return the present actor with the noise of its schedule."""
        exploration = Exploration(sigma=self._sigma, random_turns=self.config.random_turns)
        return self.actor.policy({EXPLORATION: exploration.model_dump(mode="json")})

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the actor, or its running average, as a complete policy without noise."""
        is_actor = self.config.policy_network == "actor"
        return (self.actor if is_actor else self.target_actor).policy(info)

    def _figures(self, critic_loss: float, value: float, of_actor: float) -> dict[str, float]:
        """Return mean critic loss, value and value of the actor's actions, and the noise."""
        return {
            "critic_loss": critic_loss,
            "value": value,
            "actor_value": of_actor,
            "noise": self._sigma,
        }

    def _update(self, batch: dict[str, Tensor], noise: torch.Generator) -> Tensor:
        """Take one gradient step of the critics and, when due, of the actor and all targets.

        Returns:
            Critic loss, mean value and mean value of the actor's actions, shape (3,), on the
            device; the last is 0 where the actor takes no step.
        """
        config, states = self.config, batch["states"]
        # The smaller of both targets' values; a time-out is no end, and bootstraps.
        with torch.no_grad():
            next_actions = self._smoothed_actions(batch["next_states"], noise)
            next_q = self.target_critics(batch["next_states"], next_actions).amin(dim=0)
            td_target = batch["rewards"] + config.gamma * (1 - batch["terminated"]) * next_q
        # Both critics descend to it.
        q = self.critics(states, batch["actions"])
        critic_loss = self._critic_loss(q, td_target.expand_as(q))
        self._step("critics", 2 * critic_loss)
        # With a delay the actor climbs the first critic, and the targets follow slowly.
        actor_value = torch.zeros_like(critic_loss)
        if self._is_actor_due:
            actor_value = self.critics.first(states, self.actor(states)).mean()
            self._step("actor", -actor_value)
            polyak_update(self.target_critics, self.critics, config.tau)
            polyak_update(self.target_actor, self.actor, config.tau)
        return torch.stack([critic_loss, q.mean(), actor_value]).detach()

    def _smoothed_actions(self, states: Tensor, noise: torch.Generator) -> Tensor:
        """Return the target actor's actions with clipped noise, shape (n, n_actions).

        Actions beside each other get values beside each other, so that no narrow peak of the
        critics is climbed.
        """
        config, actions = self.config, self.target_actor(states)
        normal = torch.randn(actions.shape, generator=noise, device=actions.device)
        bound = config.target_noise_clip
        smoothing = (config.target_noise * normal).clamp_(-bound, bound)
        return (actions + smoothing).clamp_(-1.0, 1.0)
