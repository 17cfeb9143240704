"""The paper's learner: actor and critic, one step of temporal difference at a time (section 4.2).

Published are the networks, the critic's 36th input and that both are updated at each step; learning
rates, discount, optimiser and the distribution of the actions are ours (assumptions).
"""

import copy
import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import Tensor
from torch.nn.functional import smooth_l1_loss

from rl.critics import ValueCritic
from rl.learner import BaseLearnerConfig, Learner
from rl.networks import Actor
from rl.policy import Policy
from rl.replay import Renderer
from rl.spaces import ActionSpec, ObservationSpec
from rl.training import Episode


class ActorCriticConfig(BaseLearnerConfig):
    """Settings of the learner.

    Attributes:
        algorithm: Name of the algorithm.
        critic: Input of the critic: ``reward-input``, the reward that came with the state as the
            36th input (as printed), ``state``, the usual value of a state, or ``action-input``, the
            action as the 36th input. The last learns from the value of the action that came next,
            and its value of the actor's best action is the baseline (assumption).
        actor_rate: Adam learning rate of the actor.
        critic_rate: Adam learning rate of the critic.
        gamma: Discount of a decision.
        action_repeat: Number of control steps that an action is held for while learning (paper: 1,
            with which it learns nothing here).
        reward_scale: Factor of the rewards.
        max_td_error: Temporal differences are clipped here.
        clip_range: Share by which the probability of an action may move from the behaviour policy's
            before it is pushed no further that way. The paper's robot learns at each step with the
            actor that drives; these learn after whole episodes (assumption, as Schulman et al. 2017
            do).
    """

    algorithm: Literal["actor-critic"] = "actor-critic"
    critic: Literal["reward-input", "state", "action-input"] = "reward-input"
    actor_rate: float = Field(default=1e-3, gt=0)
    critic_rate: float = Field(default=3e-3, gt=0)
    gamma: float = Field(default=0.9, gt=0, lt=1)
    reward_scale: float = Field(default=0.1, gt=0)
    max_td_error: float = Field(default=10.0, gt=0)
    clip_range: float = Field(default=0.2, gt=0)


class ActorCritic(Learner):
    """Actor, critic and their optimisers."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        config: ActorCriticConfig,
        seed: int,
        renderer: Renderer | None = None,
    ) -> None:
        """Draw fresh networks.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            config: Settings.
            seed: Seed of the weights.
            renderer: None: it learns from states, and remembers none.

        Raises:
            DeviceError: If torch does not find the device.
            ValueError: If there is a renderer.
        """
        if renderer is not None:
            raise ValueError(
                "algorithm: expected one with a replay buffer for situations, got 'actor-critic'; "
                "take 'sac' or 'td3'"
            )
        super().__init__(config.device)
        self.config = config
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor = Actor(observations, actions, config.hidden)
            beside = {"reward-input": 1, "state": 0, "action-input": actions.size}
            self.critic = ValueCritic(observations, config.hidden, beside[config.critic])
        self._keep(actor=self.actor, critic=self.critic)
        self._optimise("actor", self.actor.parameters(), config.actor_rate)
        self._optimise("critic", self.critic.parameters(), config.critic_rate)

    def behaviour_policy(self) -> Policy:
        """Return the present actor, which plays the episodes to learn from."""
        return self.actor.policy({})

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the present actor as a complete policy."""
        return self.actor.policy(info)

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, lr_scale: float = 1.0
    ) -> dict[str, float]:
        """Learn from episodes as from robots that drive side by side, one decision after another.

        Args:
            episodes: New ones.
            rng: Ignored: decisions are taken in their own order.
            lr_scale: Share of the learning rates.

        Returns:
            Mean critic loss, mean value and mean spread of the actions.
        """
        self._set_learning_rate("actor", self.config.actor_rate * lr_scale)
        self._set_learning_rate("critic", self.config.critic_rate * lr_scale)
        figures = torch.zeros(3, device=self.device)
        longest = max(len(episode.actions) for episode in episodes)
        behaviour_policy = copy.deepcopy(self.actor)
        for t in range(longest):
            batch = _decisions(episodes, t, self.config.reward_scale)
            batch = {name: column.to(self.device) for name, column in batch.items()}
            figures += self._update(batch, behaviour_policy)
        loss, value, spread = (figures / longest).tolist()
        return {"critic_loss": loss, "value": value, "spread": spread}

    def _update(self, batch: dict[str, Tensor], behaviour_policy: Actor) -> Tensor:
        """Take one step of critic and actor along the temporal difference.

        Returns:
            Critic loss, mean value and mean spread of the actions, shape (3,).
        """
        config, states, actions = self.config, batch["states"], batch["actions"]
        beside, after = self._beside(batch)
        values = self.critic(states, beside)
        with torch.no_grad():
            next_values = self.critic(batch["next_states"], after)
            td_target = batch["rewards"] + config.gamma * (1 - batch["terminated"]) * next_values
            limit = config.max_td_error
            # The value of the action itself holds all that is good in it: no baseline.
            by_action = config.critic == "action-input"
            baseline = self.critic(states, self._best(states)) if by_action else values
            td_error = (td_target - baseline).clamp(-limit, limit)
        critic_loss = smooth_l1_loss(values, td_target)
        self._step("critic", critic_loss)
        log_p = self.actor.log_probability(states, actions)
        # Only actions whose probability is still near the behaviour policy's are pushed further.
        with torch.no_grad():
            log_ratio = log_p - behaviour_policy.log_probability(states, actions)
            is_near = log_ratio * td_error.sign() < math.log1p(config.clip_range)
        self._step("actor", -(is_near * td_error * log_p).mean())
        with torch.no_grad():
            spread = self.actor(states)[1].mean()
        return torch.stack([critic_loss, values.mean(), spread]).detach()

    def _beside(self, batch: dict[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return what the critic reads beside the states and the next states, shape (n, k) each."""
        if self.config.critic == "reward-input":
            return batch["rewards_before"][:, None], batch["rewards"][:, None]
        if self.config.critic == "state":
            none = batch["actions"][:, :0]
            return none, none
        # After the last decision of an episode that was cut short no action was drawn.
        is_last = batch["is_last"][:, None] > 0
        after = torch.where(is_last, self._best(batch["next_states"]), batch["next_actions"])
        return batch["actions"], after

    @torch.no_grad()
    def _best(self, states: Tensor) -> Tensor:
        """Return the actor's best actions, shape (n, n_actions)."""
        return torch.tanh(self.actor(states)[0])


def _decisions(episodes: Sequence[Episode], t: int, reward_scale: float) -> dict[str, Tensor]:
    """Return decision ``t`` of each episode that lasts so long, as columns."""
    going = [episode for episode in episodes if t < len(episode.actions)]
    columns: dict[str, list[NDArray[np.float32] | float]] = {
        "states": [episode.states[t] for episode in going],
        "next_states": [_next_state(episode, t) for episode in going],
        "actions": [episode.actions[t] for episode in going],
        "next_actions": [
            episode.actions[min(t + 1, len(episode.actions) - 1)] for episode in going
        ],
        "is_last": [float(t == len(episode.actions) - 1) for episode in going],
        "rewards": [reward_scale * episode.rewards[t] for episode in going],
        "rewards_before": [
            reward_scale * episode.rewards[t - 1] if t else 0.0 for episode in going
        ],
        "terminated": [
            float(episode.terminated and t == len(episode.actions) - 1) for episode in going
        ],
    }
    return {
        name: torch.from_numpy(np.array(column, dtype=np.float32))
        for name, column in columns.items()
    }


def _next_state(episode: Episode, t: int) -> NDArray[np.float32]:
    """Return the state after decision ``t``."""
    last = t == len(episode.actions) - 1
    return episode.last_state if last else episode.states[t + 1]
