"""A batched actor-critic on whole episodes (Sanchez et al. 2023, section 4.2).

The paper names actor and critic, not the update. Ours (assumption): generalised advantages, a
clipped ratio and several passes over each batch (Schulman et al. 2017), since the paper's one-step
update collapses into circling on some seeds.
"""

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from rl.networks import Actor, Critic
from rl.observation import ObservationLayout
from rl.policy import Policy
from rl.training import Episode, Exploration


class ActorCriticConfig(BaseModel):
    """Numbers of the learner (assumptions but for the networks).

    Attributes:
        hidden: Width of the hidden layers (paper: 200, 200).
        learning_rate: Of Adam.
        discount: Of a decision.
        trace: Lambda of the generalised advantage.
        clip: Largest change of the ratio of probabilities.
        passes: Passes over each batch.
        minibatch: Decisions of a gradient step.
        entropy: Weight of the entropy of the actions.
        sigma: First standard deviation of the actions, a share of the steering limit.
        least_sigma: The standard deviation never falls below.
        hold: Control steps that an action is held while training; judged at 10 Hz.
        reward_scale: Rewards are multiplied by this.
        batch: Episodes of an update.
        largest_gradient: Norm to which gradients are cut.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hidden: tuple[int, ...] = (200, 200)
    learning_rate: float = Field(default=3e-4, gt=0)
    discount: float = Field(default=0.98, gt=0, lt=1)
    trace: float = Field(default=0.95, ge=0, le=1)
    clip: float = Field(default=0.2, gt=0)
    passes: int = Field(default=8, ge=1)
    minibatch: int = Field(default=256, ge=8)
    entropy: float = Field(default=0.0, ge=0)
    sigma: float = Field(default=0.6, gt=0)
    least_sigma: float = Field(default=0.2, gt=0)
    hold: int = Field(default=5, ge=1)
    reward_scale: float = Field(default=1 / 100, gt=0)
    batch: int = Field(default=16, ge=1)
    largest_gradient: float = Field(default=0.5, gt=0)


class ActorCritic:
    """Actor, critic and their optimiser."""

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
        """
        self._config = config
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(seed)
            self.actor = Actor(layout, max_range, limit, config.hidden)
            self.critic = Critic(layout, max_range, limit, config.hidden)
        self.log_sigma = torch.nn.Parameter(torch.tensor(float(np.log(config.sigma))))
        self._parameters = [*self.actor.parameters(), *self.critic.parameters(), self.log_sigma]
        self._optimiser = torch.optim.Adam(self._parameters, lr=config.learning_rate, eps=1e-5)

    @property
    def exploration(self) -> Exploration:
        """How to act while learning."""
        return Exploration(float(self.log_sigma.detach().exp()), self._config.hold)

    def policy(self, dead_zone: float, info: dict[str, Any]) -> Policy:
        """Return the actor as a complete policy."""
        return self.actor.policy(dead_zone, info)

    def update(
        self, episodes: Sequence[Episode], rng: np.random.Generator, pace: float = 1.0
    ) -> dict[str, float]:
        """Learn from a batch of episodes.

        Args:
            episodes: Played with the present actor.
            rng: Order of the minibatches.
            pace: Share of the learning rate.

        Returns:
            Means of actor and critic loss, and the standard deviation of the actions.
        """
        for group in self._optimiser.param_groups:
            group["lr"] = self._config.learning_rate * pace
        batch = self._prepare(episodes)
        losses = []
        count = len(batch["actions"])
        for _ in range(self._config.passes):
            order = rng.permutation(count)
            for begin in range(0, count, self._config.minibatch):
                rows = torch.from_numpy(order[begin : begin + self._config.minibatch])
                losses.append(self._descend({name: part[rows] for name, part in batch.items()}))
        actor_loss, critic_loss = np.mean(losses, axis=0)
        return {
            "actor_loss": float(actor_loss),
            "critic_loss": float(critic_loss),
            "sigma": self.exploration.sigma,
        }

    def _prepare(self, episodes: Sequence[Episode]) -> dict[str, Tensor]:
        """Return states, actions, advantages, value targets and old log-probabilities."""
        parts: dict[str, list[NDArray[Any]]] = {
            name: [] for name in ("states", "actions", "led", "advantages", "targets")
        }
        for episode in episodes:
            rewards = episode.rewards * self._config.reward_scale
            led = np.concatenate([[0.0], rewards]).astype(np.float32)
            states = np.concatenate([episode.states, episode.last_state[None]])
            values = self._values(states, led)
            if episode.terminated:
                values[-1] = 0.0
            advantages = self._advantages(rewards, values)
            parts["states"].append(episode.states)
            parts["actions"].append(episode.actions)
            parts["led"].append(led[:-1])
            parts["advantages"].append(advantages)
            parts["targets"].append(advantages + values[:-1])
        batch = {
            name: torch.from_numpy(np.concatenate(arrays).astype(np.float32))
            for name, arrays in parts.items()
        }
        advantages = batch["advantages"]
        batch["advantages"] = (advantages - advantages.mean()) / (advantages.std() + 1e-6)
        with torch.no_grad():
            batch["before"] = self._log_probability(batch["states"], batch["actions"])
        return batch

    def _values(self, states: NDArray[np.float32], led: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the critic's values, shape (n,)."""
        with torch.no_grad():
            values = self.critic(torch.from_numpy(states), torch.from_numpy(led))
        return values.numpy().astype(np.float64)

    def _advantages(
        self, rewards: NDArray[np.float64], values: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return generalised advantages, shape (t,), of values with one more entry."""
        discount, trace = self._config.discount, self._config.trace
        errors = rewards + discount * values[1:] - values[:-1]
        advantages = np.zeros_like(rewards)
        running = 0.0
        for t in range(len(rewards) - 1, -1, -1):
            running = errors[t] + discount * trace * running
            advantages[t] = running
        return advantages

    def _log_probability(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return the log-probability of actions up to a constant, shape (n,)."""
        deviation = (actions - self.actor(states)) / self.log_sigma.exp()
        return -deviation.square() / 2 - self.log_sigma

    def _descend(self, rows: dict[str, Tensor]) -> tuple[float, float]:
        """Take one gradient step and return both losses."""
        config = self._config
        ratio = (self._log_probability(rows["states"], rows["actions"]) - rows["before"]).exp()
        clipped = ratio.clamp(1 - config.clip, 1 + config.clip)
        gain = torch.minimum(ratio * rows["advantages"], clipped * rows["advantages"])
        actor_loss = -gain.mean() - config.entropy * self.log_sigma
        values = self.critic(rows["states"], rows["led"])
        critic_loss = torch.nn.functional.smooth_l1_loss(values, rows["targets"])
        self._optimiser.zero_grad()
        (actor_loss + critic_loss).backward()
        torch.nn.utils.clip_grad_norm_(self._parameters, config.largest_gradient)
        self._optimiser.step()
        with torch.no_grad():
            self.log_sigma.clamp_(min=float(np.log(config.least_sigma)))
        return float(actor_loss.detach()), float(critic_loss.detach())

    def to_bytes(self, progress: dict[str, Any]) -> bytes:
        """Return everything that learning needs to go on, as safetensors.

        Args:
            progress: Where the run stands, ready for JSON.
        """
        from safetensors.torch import save

        tensors = {}
        for number, parameter in enumerate(self._parameters):
            tensors[f"p{number}"] = parameter.detach().contiguous().clone()
            for name, moment in self._optimiser.state.get(parameter, {}).items():
                tensors[f"{name}{number}"] = moment.contiguous().clone()
        return save(tensors, metadata={"progress": json.dumps(progress, sort_keys=True)})

    def restore(self, data: bytes) -> dict[str, Any]:
        """Take up the state of ``to_bytes`` and return its progress.

        Raises:
            ValueError: If the bytes are no checkpoint of such a learner.
        """
        from safetensors import SafetensorError
        from safetensors.torch import load

        try:
            tensors = load(data)
            size = int.from_bytes(data[:8], "little")
            progress = json.loads(json.loads(data[8 : 8 + size])["__metadata__"]["progress"])
            for number, parameter in enumerate(self._parameters):
                with torch.no_grad():
                    parameter.copy_(tensors[f"p{number}"])
                if f"step{number}" in tensors:
                    self._optimiser.state[parameter] = {
                        name: tensors[f"{name}{number}"]
                        for name in ("step", "exp_avg", "exp_avg_sq")
                    }
        except (SafetensorError, KeyError, ValueError, RuntimeError) as error:
            raise ValueError(
                f"checkpoint: expected one of this learner, got {str(error).splitlines()[0]}; "
                "start a new run"
            ) from error
        return dict(progress)
