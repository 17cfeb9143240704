"""Stage after stage, generation after generation, each one a place to stop and to go on."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from rl.observation import ObservationLayout
from rl.policy import Policy
from rl.sac import SacConfig, SoftActorCritic
from rl.training import Episode, Sampler


class Stage(BaseModel):
    """One stage of the curriculum.

    Attributes:
        name: Of its environment.
        episodes: Budget (paper: 200).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    episodes: int = Field(ge=1)


class CurriculumConfig(BaseModel):
    """What is learnt in which order (Sanchez et al. 2023, section 5).

    Attributes:
        stages: In order.
        learner: Numbers of the learner.
        seed: Of everything random in the run.
        n_sectors: Ranges of the state.
        max_range: Largest range [m].
        limit: Largest yaw rate [rad/s].
        dead_zone: Yaw rates below this are zero [rad/s].
        final_pace: Share of the learning rate at the end of each stage; it falls in a line.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stages: tuple[Stage, ...]
    learner: SacConfig = Field(default_factory=SacConfig)
    seed: int = Field(default=0, ge=0)
    n_sectors: int = Field(default=32, ge=4)
    max_range: float = Field(default=10.0, gt=0)
    limit: float = Field(default=0.5, gt=0)
    dead_zone: float = Field(default=0.15, ge=0)
    final_pace: float = Field(default=0.2, gt=0, le=1)


@dataclass(frozen=True)
class Generation:
    """What one update learnt from.

    Attributes:
        stage: Index of the stage, from 0.
        name: Of the stage.
        played: Episodes of this generation.
        episodes: Episodes of the stage so far.
        budget: Episodes of the whole stage.
        steps: Control steps of the whole run so far.
        success_rate: Of this generation's episodes.
        outcomes: Count of each outcome.
        mean_return: Mean sum of rewards.
        losses: As ``SoftActorCritic.update`` gives them.
    """

    stage: int
    name: str
    played: int
    episodes: int
    budget: int
    steps: int
    success_rate: float
    outcomes: dict[str, int]
    mean_return: float
    losses: dict[str, float]


class Curriculum:
    """A run: learner and position. ``to_bytes`` after any generation is a checkpoint.

    Attributes:
        learner: Actor and critic.
        generations: Generations since the run began, over all stages.
    """

    def __init__(
        self, config: CurriculumConfig, sampler: Sampler, checkpoint: bytes | None = None
    ) -> None:
        """Start a run, or go on where a checkpoint stands.

        Args:
            config: The run's.
            sampler: Plays episodes.
            checkpoint: Of an earlier run with the same config.

        Raises:
            ValueError: If the checkpoint does not fit.
        """
        self._config = config
        self._sampler = sampler
        layout = ObservationLayout(config.n_sectors)
        self.learner = SoftActorCritic(
            layout, config.max_range, config.limit, config.learner, config.seed
        )
        self._stage = self._episodes = self._generation = self._steps = 0
        self.generations = 0
        if checkpoint is not None:
            progress = self.learner.restore(checkpoint)
            if progress["config"] != config.model_dump(mode="json"):
                raise ValueError(
                    "checkpoint: expected one of this configuration, got another's; start a new run"
                )
            self._stage, self._episodes = progress["stage"], progress["episodes"]
            self._generation, self._steps = progress["generation"], progress["steps"]
            self.generations = progress["generations"]

    def run(self) -> Iterator[Generation]:
        """Play, learn and yield, one generation at a time, until every stage is done."""
        while self._stage < len(self._config.stages):
            stage = self._config.stages[self._stage]
            while self._episodes < stage.episodes:
                yield self._advance(stage)
            self._stage, self._episodes, self._generation = self._stage + 1, 0, 0

    def _advance(self, stage: Stage) -> Generation:
        """Play one generation's episodes and learn from them."""
        config = self._config
        count = min(config.learner.batch, stage.episodes - self._episodes)
        seeds = [(config.seed, self._stage, self._episodes + k) for k in range(count)]
        episodes = self._sampler(
            self._stage, self.learner.explorer(config.dead_zone), config.learner.hold, seeds
        )
        pace = 1 - (1 - config.final_pace) * self._episodes / stage.episodes
        order = np.random.default_rng((config.seed, self._stage, self._generation, 1))
        losses = self.learner.update(episodes, order, pace)
        self._episodes += count
        self._generation += 1
        self.generations += 1
        self._steps += sum(episode.steps for episode in episodes)
        return self._tell(stage, episodes, losses)

    def _tell(self, stage: Stage, episodes: list[Episode], losses: dict[str, float]) -> Generation:
        """Return what the generation was."""
        return Generation(
            stage=self._stage,
            name=stage.name,
            played=len(episodes),
            episodes=self._episodes,
            budget=stage.episodes,
            steps=self._steps,
            success_rate=float(np.mean([episode.is_success for episode in episodes])),
            outcomes=dict(Counter(episode.outcome for episode in episodes)),
            mean_return=float(np.mean([episode.rewards.sum() for episode in episodes])),
            losses=losses,
        )

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the policy that the run has come to."""
        return self.learner.policy(self._config.dead_zone, info)

    def to_bytes(self) -> bytes:
        """Return a checkpoint."""
        return self.learner.to_bytes(
            {
                "config": self._config.model_dump(mode="json"),
                "stage": self._stage,
                "episodes": self._episodes,
                "generation": self._generation,
                "generations": self.generations,
                "steps": self._steps,
            }
        )
