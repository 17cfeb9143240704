"""Replay buffer: the latest decisions, each with its reward and the state after it."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from rl.training import Episode


class Replay:
    """Ring buffer of decisions in arrays of fixed size."""

    def __init__(self, state_size: int, action_size: int, capacity: int) -> None:
        """Begin empty.

        Args:
            state_size: Length of a state.
            action_size: Number of actions.
            capacity: Number of decisions that fit in; the oldest are overwritten.
        """
        self._columns: dict[str, Any] = {
            "states": np.zeros((capacity, state_size), dtype=np.float32),
            "next_states": np.zeros((capacity, state_size), dtype=np.float32),
            "actions": np.zeros((capacity, action_size), dtype=np.float32),
            "rewards": np.zeros(capacity, dtype=np.float32),
            "terminated": np.zeros(capacity, dtype=np.float32),
        }
        self._capacity = capacity
        self._added = 0

    def __len__(self) -> int:
        """Return the number of decisions in the buffer."""
        return min(self._added, self._capacity)

    def add(self, episode: Episode, reward_scale: float) -> int:
        """Add an episode and return its number of decisions.

        A time-out is a truncation, not an end: only the last decision of a terminated episode is
        marked.
        """
        count = len(episode.actions)
        rows = (self._added + np.arange(count)) % self._capacity
        columns = self._columns
        columns["states"][rows] = episode.states
        columns["next_states"][rows[:-1]] = episode.states[1:]
        columns["next_states"][rows[-1]] = episode.last_state
        columns["actions"][rows] = episode.actions
        columns["rewards"][rows] = episode.rewards * reward_scale
        columns["terminated"][rows] = 0.0
        columns["terminated"][rows[-1]] = float(episode.terminated)
        self._added += count
        return count

    def sample(self, count: int, rng: np.random.Generator) -> dict[str, Tensor]:
        """Return random decisions, columns of ``count`` rows."""
        rows = rng.integers(len(self), size=count)
        return {name: torch.from_numpy(column[rows]) for name, column in self._columns.items()}

    def tensors(self) -> dict[str, Tensor]:
        """Return the content, for a checkpoint."""
        used = {
            f"replay.{name}": torch.from_numpy(column[: len(self)].copy())
            for name, column in self._columns.items()
        }
        return used | {"replay.added": torch.tensor(self._added)}

    def restore(self, tensors: dict[str, Tensor]) -> None:
        """Take up the content of ``tensors``.

        Raises:
            KeyError: If a column is missing.
            ValueError: If a column does not fit.
        """
        self._added = int(tensors["replay.added"])
        for name, column in self._columns.items():
            column[: len(self)] = tensors[f"replay.{name}"].numpy()
