"""Settings of a curriculum: its stages, their budgets, and how a run is judged."""

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from rl.learners import LearnerConfig
from rl.sac import SacConfig
from rl.spaces import ActionSpec, ObservationSpec, steering_actions, steering_observations

_SAME_LEVEL = 1e-5


class Difficulty(BaseModel):
    """Schedule of the difficulty of a stage's worlds, by the share of successes.

    Attributes:
        start: Difficulty of the first episodes.
        min_level: Least difficulty.
        max_level: Greatest difficulty; a stage is passed there alone.
        step: Difference between two levels.
        window: Number of episodes that decide on the next level.
        worlds: Number of worlds that levels name, the easiest first, where the success in the
            level's own world alone counts, over its latest ``window`` episodes (SPN: 4, 50). With 0
            all episodes count, whatever their world, and each window begins where the last ended.
        raise_at: Share of successes in them from which the level rises.
        lower_at: Share of successes below which it falls.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    start: float = Field(default=0.3, ge=0, le=1)
    min_level: float = Field(default=0.1, ge=0, le=1)
    max_level: float = Field(default=0.5, ge=0, le=1)
    step: float = Field(default=0.1, gt=0, le=1)
    window: int = Field(default=16, ge=1)
    worlds: int = Field(default=0, ge=0)
    raise_at: float = Field(default=0.8, ge=0, le=1)
    lower_at: float = Field(default=0.4, ge=0, le=1)

    def after(self, level: float, successes: Sequence[bool]) -> float:
        """Return the next level after the episodes on this one; the same while they are few."""
        if len(successes) < self.window:
            return level
        share = float(np.mean(successes[-self.window :]))
        change = self.step * (int(share >= self.raise_at) - int(share < self.lower_at))
        next_level = min(max(level + change, self.min_level), self.max_level)
        # Thirds of the range end at its bounds, not a rounding error beside them.
        near = [
            bound
            for bound in (self.min_level, self.max_level)
            if abs(next_level - bound) < _SAME_LEVEL
        ]
        return round(near[0] if near else next_level, 6)


class Stage(BaseModel):
    """One stage of the curriculum.

    Attributes:
        name: Name of its environment.
        episodes: Budget of episodes (paper: 200).
        steps: Budget of control steps, None for no such limit; the stage ends when either budget is
            spent, after a whole iteration.
        promote_at: Share of successes in the latest ``window`` episodes that ends the stage before
            its budget is spent; None never does (paper).
        window: Number of episodes that ``promote_at`` counts.
        rehearsal: Share of the episodes that are played in the stages before, so that nothing is
            forgotten; one episode of each iteration at least is the stage's own.
        difficulty: Schedule of its worlds' difficulty, None for its environment's own.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    episodes: int = Field(ge=1)
    steps: int | None = Field(default=None, ge=1)
    promote_at: float | None = Field(default=None, gt=0, le=1)
    window: int = Field(default=32, ge=1)
    rehearsal: float = Field(default=0.0, ge=0, le=0.9)
    difficulty: Difficulty | None = None

    def spent(self, episodes: int, steps: int) -> float:
        """Return the share of the budget that so many episodes and control steps have used."""
        by_steps = 0.0 if self.steps is None else steps / self.steps
        return max(episodes / self.episodes, by_steps)


class CurriculumConfig(BaseModel):
    """Settings of a run (Sanchez et al. 2023, section 5).

    Attributes:
        stages: Stages in order.
        learner: Settings of the learner.
        seed: Seed of everything random in the run.
        observations: Space of the observations.
        actions: Space of the actions.
        final_lr_scale: Share of the learning rate at the end of each stage; it falls linearly with
            the budget.
        validation: Number of episodes in worlds kept for it that are driven without exploring at
            the end of each stage, in that stage and in all before; 0 leaves them out.
        validate_every: Number of iterations between validations within a stage, from which the
            policy that did best is kept; 0 keeps the last.
        collision_weight: Weight w of collisions in the score of a validation,
            1 - (time-outs + w collisions) / episodes; None for the share of successes, which is the
            score for w = 1.
        validation_tolerance: Loss of score, against the best so far, up to which a later policy is
            kept instead of an earlier one: a few episodes tell neighbours apart by chance alone,
            and a later one has learnt longer.
        test_every: Number of control steps between tests; 0 leaves them out. A test plays every
            task of a fixed list once without exploring, and decides nothing.
        test_tasks: Number of tasks of the list.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stages: tuple[Stage, ...]
    learner: LearnerConfig = Field(default_factory=SacConfig)
    seed: int = Field(default=0, ge=0)
    observations: ObservationSpec = Field(
        default_factory=lambda: steering_observations(32, 10.0, 0.5)
    )
    actions: ActionSpec = Field(default_factory=lambda: steering_actions(0.5))
    final_lr_scale: float = Field(default=0.2, gt=0, le=1)
    validation: int = Field(default=0, ge=0)
    validate_every: int = Field(default=0, ge=0)
    collision_weight: float | None = Field(default=None, ge=1)
    validation_tolerance: float = Field(default=0.0, ge=0)
    test_every: int = Field(default=0, ge=0)
    test_tasks: int = Field(default=16, ge=1)
