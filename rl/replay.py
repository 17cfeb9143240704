"""Replay buffer: the latest decisions, each with its reward and the state after it."""

from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from rl.training import Episode


class Renderer(Protocol):
    """Makes observations from situations; which sensor sees them may be drawn anew each time.

    A situation holds what the observation depends on: pose, speeds, goal, room, obstacles. It is
    smaller than an observation by far, and sensors can be randomised over decisions of the past.

    Attributes:
        size: Number m of values of a situation.
    """

    @property
    def size(self) -> int:
        """Number m of values of a situation."""

    def __call__(
        self, situations: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """Return observations, float32, shape (b, n_observations).

        Args:
            situations: Situations, float32, shape (b, m). In a call for b / 2 decisions the second
                half are the situations after those of the first, in their order.
            rng: Draws of the sensors.
        """


class Replay:
    """Ring buffer of decisions in arrays of fixed size."""

    def __init__(
        self, state_size: int, action_size: int, capacity: int, renderer: Renderer | None = None
    ) -> None:
        """Begin empty.

        Args:
            state_size: Length of a state.
            action_size: Number of actions.
            capacity: Number of decisions that fit in; the oldest are overwritten.
            renderer: Renderer of the states if episodes hold situations, None if they hold states.
        """
        size = state_size if renderer is None else renderer.size
        self._columns: dict[str, Any] = {
            "states": np.zeros((capacity, size), dtype=np.float32),
            "next_states": np.zeros((capacity, size), dtype=np.float32),
            "actions": np.zeros((capacity, action_size), dtype=np.float32),
            "rewards": np.zeros(capacity, dtype=np.float32),
            "terminated": np.zeros(capacity, dtype=np.float32),
        }
        self._capacity = capacity
        self._added = 0
        self._episodes = 0
        self._renderer = renderer

    def __len__(self) -> int:
        """Return the number of decisions in the buffer."""
        return min(self._added, self._capacity)

    @property
    def episodes(self) -> int:
        """Number of episodes that were ever added."""
        return self._episodes

    @property
    def decisions(self) -> int:
        """Number of decisions that were ever added."""
        return self._added

    def add(self, episode: Episode, reward_scale: float) -> int:
        """Add an episode and return its number of decisions.

        A time-out is a truncation, not an end: only the last decision of a terminated episode is
        marked.

        Raises:
            ValueError: If it holds states and situations are remembered, or the other way round.
        """
        count, columns = len(episode.actions), self._columns
        if episode.states.shape[1] != columns["states"].shape[1]:
            what = "states" if self._renderer is None else "situations"
            raise ValueError(
                f"episode: expected {what} of {columns['states'].shape[1]} values, got "
                f"{episode.states.shape[1]}; give the learner a renderer exactly where the "
                "environment's infos hold situations"
            )
        rows = (self._added + np.arange(count)) % self._capacity
        columns["states"][rows] = episode.states
        columns["next_states"][rows[:-1]] = episode.states[1:]
        columns["next_states"][rows[-1]] = episode.last_state
        columns["actions"][rows] = episode.actions
        columns["rewards"][rows] = episode.rewards * reward_scale
        columns["terminated"][rows] = 0.0
        columns["terminated"][rows[-1]] = float(episode.terminated)
        self._added += count
        self._episodes += 1
        return count

    def sample(self, count: int, rng: np.random.Generator) -> dict[str, Tensor]:
        """Return random decisions, columns of ``count`` rows; states are rendered where needed."""
        rows = rng.integers(len(self), size=count)
        batch = {name: column[rows] for name, column in self._columns.items()}
        if self._renderer is not None:
            # Both ends in one call, so that a renderer can give them the same sensor.
            both = self._renderer(np.concatenate([batch["states"], batch["next_states"]]), rng)
            batch["states"], batch["next_states"] = both[:count], both[count:]
        return {name: torch.from_numpy(column) for name, column in batch.items()}

    def tensors(self) -> dict[str, Tensor]:
        """Return the content, for a checkpoint."""
        used = {
            f"replay.{name}": torch.from_numpy(column[: len(self)].copy())
            for name, column in self._columns.items()
        }
        counts = {"replay.added": self._added, "replay.episodes": self._episodes}
        return used | {name: torch.tensor(count) for name, count in counts.items()}

    def restore(self, tensors: dict[str, Tensor]) -> None:
        """Take up the content of ``tensors``.

        Raises:
            KeyError: If a column is missing.
            ValueError: If a column does not fit.
        """
        self._added = int(tensors["replay.added"])
        self._episodes = int(tensors["replay.episodes"])
        for name, column in self._columns.items():
            column[: len(self)] = tensors[f"replay.{name}"].numpy()
