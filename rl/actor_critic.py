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
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from rl.learner import Device, Learner
from rl.networks import Actor, ValueCritic
from rl.policy import Policy
from rl.spaces import ObservationLayout
from rl.training import Episode


class ActorCriticConfig(BaseModel):
    """Numbers of the learner.

    Attributes:
        algorithm: Its name.
        hidden: Width of the hidden layers (paper: 200, 200).
        critic: ``reward-input``, the reward that came with the state as the critic's 36th input (as
            printed), or ``state``, the usual value of a state.
        actor_rate: Learning rate of the actor, of Adam.
        critic_rate: Of the critic.
        discount: Of a decision.
        hold: Control steps that an action is held while learning (paper: 1, with which it learns
            nothing here).
        reward_scale: Rewards are multiplied by this.
        largest_difference: Temporal differences are cut off here.
        trust: An action whose probability has moved by this share since the episode was driven is
            pushed no further that way. The paper's robot learns at each step with the actor that
            drives; these learn after whole episodes (assumption, as Schulman et al. 2017 do).
        batch: Episodes that are played side by side.
        device: Where gradients are computed; see ``rl.learner``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    algorithm: Literal["actor-critic"] = "actor-critic"
    hidden: tuple[int, ...] = (200, 200)
    critic: Literal["reward-input", "state"] = "reward-input"
    actor_rate: float = Field(default=1e-3, gt=0)
    critic_rate: float = Field(default=3e-3, gt=0)
    discount: float = Field(default=0.9, gt=0, lt=1)
    hold: int = Field(default=5, ge=1)
    reward_scale: float = Field(default=0.1, gt=0)
    largest_difference: float = Field(default=10.0, gt=0)
    trust: float = Field(default=0.2, gt=0)
    batch: int = Field(default=8, ge=1)
    device: Device = "cpu"


class ActorCritic(Learner):
    """Actor, critic and their optimisers."""

    def __init__(
        self,
        layout: ObservationLayout,
        max_range: float,
        limit: float,
        config: ActorCriticConfig,
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
            takes_reward = config.critic == "reward-input"
            self.critic = ValueCritic(layout, limit, config.hidden, takes_reward)
        self._keep(actor=self.actor, critic=self.critic)
        self._optimise("actor", self.actor.parameters(), config.actor_rate)
        self._optimise("critic", self.critic.parameters(), config.critic_rate)

    def explorer(self, dead_zone: float) -> Policy:
        """Return the present actor, which plays the episodes to learn from."""
        return self.actor.policy(dead_zone, {})

    def policy(self, dead_zone: float, info: dict[str, Any]) -> Policy:
        """Return the present actor as a complete policy."""
        return self.actor.policy(dead_zone, info)

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, pace: float = 1.0
    ) -> dict[str, float]:
        """Learn from episodes as from robots that drive side by side, one decision after another.

        Args:
            episodes: New ones.
            rng: Not needed: decisions are taken in their own order.
            pace: Share of the learning rates.

        Returns:
            Mean critic loss, mean value and mean spread of the actions.
        """
        self._set_rate("actor", self.config.actor_rate * pace)
        self._set_rate("critic", self.config.critic_rate * pace)
        figures = torch.zeros(3, device=self.device)
        longest = max(len(episode.actions) for episode in episodes)
        driver = copy.deepcopy(self.actor)
        for moment in range(longest):
            rows = _decisions(episodes, moment, self.config.reward_scale)
            rows = {name: column.to(self.device) for name, column in rows.items()}
            figures += self._descend(rows, driver)
        loss, value, spread = (figures / longest).tolist()
        return {"critic_loss": loss, "value": value, "spread": spread}

    def _descend(self, rows: dict[str, Tensor], driver: Actor) -> Tensor:
        """Take one step of critic and actor along the temporal difference, near the driver.

        Returns:
            Critic loss, mean value and mean spread of the actions, shape (3,).
        """
        config = self.config
        values = self.critic(rows["states"], rows["rewards_before"])
        with torch.no_grad():
            later = self.critic(rows["next_states"], rows["rewards"])
            wanted = rows["rewards"] + config.discount * (1 - rows["terminated"]) * later
            most = config.largest_difference
            difference = (wanted - values).clamp(-most, most)
        critic_loss = torch.nn.functional.smooth_l1_loss(values, wanted)
        self._step("critic", critic_loss)
        log_p = self.actor.log_probability(rows["states"], rows["actions"])
        with torch.no_grad():
            moved = log_p - driver.log_probability(rows["states"], rows["actions"])
            near = moved * difference.sign() < math.log1p(config.trust)
        self._step("actor", -(near * difference * log_p).mean())
        with torch.no_grad():
            spread = self.actor(rows["states"])[1].mean()
        return torch.stack([critic_loss, values.mean(), spread]).detach()


def _decisions(episodes: Sequence[Episode], moment: int, scale: float) -> dict[str, Tensor]:
    """Return the decision of a moment of each episode that lasts so long, as columns."""
    going = [episode for episode in episodes if moment < len(episode.actions)]
    columns: dict[str, list[NDArray[np.float32] | float]] = {
        "states": [episode.states[moment] for episode in going],
        "next_states": [_next_state(episode, moment) for episode in going],
        "actions": [episode.actions[moment] for episode in going],
        "rewards": [scale * episode.rewards[moment] for episode in going],
        "rewards_before": [
            scale * episode.rewards[moment - 1] if moment else 0.0 for episode in going
        ],
        "terminated": [
            float(episode.terminated and moment == len(episode.actions) - 1) for episode in going
        ],
    }
    return {
        name: torch.from_numpy(np.array(column, dtype=np.float32))
        for name, column in columns.items()
    }


def _next_state(episode: Episode, moment: int) -> NDArray[np.float32]:
    """Return the state after a decision."""
    last = moment == len(episode.actions) - 1
    return episode.last_state if last else episode.states[moment + 1]
