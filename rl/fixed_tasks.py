"""Tests on a fixed list of tasks: the same starts and goals for every run (SPN, section IV-A)."""

from collections.abc import Sequence
from dataclasses import dataclass

from rl.training import Episode, EpisodeSpec

_STEP_COST = 0.001
"""Loss of a task's score with each control step (Eq. 5)."""


@dataclass(frozen=True)
class FixedTaskFigures:
    """Figures of a test.

    Attributes:
        score: Sum over the tasks of 1 - 0.001 T with T control steps, or -1 for a failure (Eq. 5).
        successes: Number of tasks that succeeded.
        mean_steps: Mean number of control steps of the tasks that succeeded, None without one.
        steps: Number of control steps of each task, None for a failure.
    """

    score: float
    successes: int
    mean_steps: float | None
    steps: tuple[int | None, ...]


def fixed_tasks(stage: int, count: int) -> list[EpisodeSpec]:
    """Return the episodes of a test: the tasks of a stage in order, with seeds of no run."""
    # The last number tells these seeds from those of training and validation.
    return [EpisodeSpec(stage, (0, 0, k, 0, 0, 4), None, k) for k in range(count)]


def fixed_task_figures(episodes: Sequence[Episode]) -> FixedTaskFigures:
    """Return the figures of the tasks, one episode each."""
    steps = tuple(episode.steps if episode.is_success else None for episode in episodes)
    done = [count for count in steps if count is not None]
    return FixedTaskFigures(
        score=sum(-1.0 if count is None else 1 - _STEP_COST * count for count in steps),
        successes=len(done),
        mean_steps=sum(done) / len(done) if done else None,
        steps=steps,
    )
