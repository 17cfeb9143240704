"""What a learner remembers: the latest decisions, each with what came of it."""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from rl.training import Episode


class Replay:
    """A ring of decisions in arrays that live as long as the learner."""

    def __init__(self, state_size: int, capacity: int) -> None:
        """Begin empty.

        Args:
            state_size: Length of a state.
            capacity: Decisions that fit in; the oldest make room.
        """
        self._columns: dict[str, Any] = {
            "states": np.zeros((capacity, state_size), dtype=np.float32),
            "next_states": np.zeros((capacity, state_size), dtype=np.float32),
            "actions": np.zeros(capacity, dtype=np.float32),
            "rewards": np.zeros(capacity, dtype=np.float32),
            "terminated": np.zeros(capacity, dtype=np.float32),
        }
        self._capacity = capacity
        self._added = 0

    def __len__(self) -> int:
        """Return the number of decisions that are remembered."""
        return min(self._added, self._capacity)

    def add(self, episode: Episode, reward_scale: float) -> int:
        """Remember an episode and return its number of decisions.

        A time-out is not an end: only the last decision of a terminated episode ends.
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

    def draw(self, count: int, rng: np.random.Generator) -> dict[str, Tensor]:
        """Return random decisions, columns of ``count`` rows."""
        rows = rng.integers(len(self), size=count)
        return {name: torch.from_numpy(column[rows]) for name, column in self._columns.items()}

    def tensors(self) -> dict[str, Tensor]:
        """Return what is remembered, for a checkpoint."""
        used = {
            f"replay.{name}": torch.from_numpy(column[: len(self)].copy())
            for name, column in self._columns.items()
        }
        return used | {"replay.added": torch.tensor(self._added)}

    def restore(self, tensors: dict[str, Tensor]) -> None:
        """Take up what ``tensors`` gave.

        Raises:
            KeyError: If a column is missing.
            ValueError: If a column does not fit.
        """
        self._added = int(tensors["replay.added"])
        for name, column in self._columns.items():
            column[: len(self)] = tensors[f"replay.{name}"].numpy()
