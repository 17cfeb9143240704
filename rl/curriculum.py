"""The curriculum: stages in order, each a series of training iterations; any of them can resume."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import torch

from rl import checkpoint as checkpoints
from rl.curriculum_config import CurriculumConfig, Difficulty, Stage
from rl.driving import DRIVING_NOISE, DRIVING_REPEAT, driving_repeat
from rl.environment import world_of_level
from rl.fixed_tasks import FixedTaskFigures, fixed_task_figures, fixed_tasks
from rl.learners import make_learner
from rl.policy import Policy, policy_from_bytes, with_info
from rl.replay import Renderer
from rl.training import Episode, EpisodeSpec, RolloutFunction

CIRCLING = 4.0
"""Number of whole turns one way in an episode that count as circling."""


@dataclass(frozen=True)
class TrainingIteration:
    """Figures of one iteration: some episodes and the update that learnt from them.

    Attributes:
        stage: Index of the stage, from 0.
        name: Name of the stage.
        played: Number of episodes of this iteration in the stage itself.
        episodes: Number of episodes of the stage so far.
        budget: Number of episodes of the whole stage.
        is_last: True if the stage ends here.
        steps: Number of control steps of the whole run so far.
        success_rate: Share of successes of this iteration's episodes in the stage.
        recent_success: Share of successes of the latest ``Stage.window`` episodes of the stage.
        difficulty: Difficulty of the stage's worlds, None for the stage's own.
        outcomes: Count of each outcome in the stage.
        mean_steps: Mean number of control steps of an episode in the stage.
        mean_return: Mean sum of rewards in the stage.
        terms: Mean sum of each term of the reward.
        circling: Share of the episodes in which the robot circled.
        losses: Figures of the learner by name.
        validation: Share of successes in the worlds kept for it, or the score with weighed
            collisions, by stage; empty where there was no validation.
        stage_steps: Number of control steps of the stage so far.
        tasks: Figures of the test of fixed tasks, None where there was none.
    """

    stage: int
    name: str
    played: int
    episodes: int
    budget: int
    is_last: bool
    steps: int
    success_rate: float
    recent_success: float
    difficulty: float | None
    outcomes: dict[str, int]
    mean_steps: float
    mean_return: float
    terms: dict[str, float]
    circling: float
    losses: dict[str, float]
    validation: dict[str, float]
    stage_steps: int = 0
    tasks: FixedTaskFigures | None = None


@dataclass
class _Position:
    """Position of a run."""

    stage: int = 0
    episodes: int = 0
    iteration: int = 0
    iterations: int = 0
    steps: int = 0
    stage_steps: int = 0
    levels: list[float | None] = field(default_factory=list)
    recent: list[bool] = field(default_factory=list)
    on_level: list[bool] = field(default_factory=list)
    in_worlds: dict[str, list[bool]] = field(default_factory=dict)
    best: float | None = None
    kept: float = 0.0


class Curriculum:
    """A run: learner and position. ``to_bytes`` after any iteration is a checkpoint.

    Attributes:
        learner: Learner of the run.
    """

    def __init__(
        self,
        config: CurriculumConfig,
        rollout: RolloutFunction,
        checkpoint: bytes | None = None,
        renderer: Renderer | None = None,
    ) -> None:
        """Start a run, or go on where a checkpoint stands.

        Args:
            config: Settings of the run.
            rollout: Function that plays episodes; the stages that follow the config's own are the
                same again in the worlds kept for validation, and the one after these holds the
                fixed tasks of the tests.
            checkpoint: Checkpoint of an earlier run with the same config.
            renderer: Renderer of the observations if episodes hold situations.

        Raises:
            ValueError: If the checkpoint does not fit.
        """
        self._config = config
        self._rollout = rollout
        self.learner = make_learner(
            config.learner, config.observations, config.actions, config.seed, renderer
        )
        self._at = _Position(levels=[_first_level(stage) for stage in config.stages])
        self._best: Policy | None = None
        if checkpoint is not None:
            progress = checkpoints.progress_of(checkpoint)
            if progress["config"] != config.model_dump(mode="json"):
                raise ValueError(
                    "checkpoint: expected one of this configuration, got another's; start a new run"
                )
            tensors = self.learner.restore(checkpoint)
            self._at = _Position(**progress["position"])
            if "best" in tensors:
                self._best = policy_from_bytes(tensors["best"].numpy().tobytes())

    @property
    def iterations(self) -> int:
        """Number of iterations since the run began, over all stages."""
        return self._at.iterations

    def run(self) -> Iterator[TrainingIteration]:
        """Play, learn and yield, one iteration at a time, until every stage is done."""
        while self._at.stage < len(self._config.stages):
            stage = self._config.stages[self._at.stage]
            iteration = self._advance(stage)
            if iteration.is_last:
                self._at.stage += 1
                self._at.episodes = self._at.stage_steps = self._at.iteration = 0
                self._at.recent, self._at.on_level, self._at.best = [], [], None
                self._at.in_worlds = {}
            yield iteration

    def _advance(self, stage: Stage) -> TrainingIteration:
        """Play one iteration's episodes and learn from them."""
        config, at = self._config, self._at
        specs = self._specs(stage)
        # Play with the actor as it is now.
        behaviour_policy = self.learner.behaviour_policy()
        episodes = self._rollout(behaviour_policy, config.learner.action_repeat, specs, True)
        # Learn from all of them, at a rate that falls over the stage.
        spent = min(stage.spent(at.episodes, at.stage_steps), 1.0)
        lr_scale = 1 - (1 - config.final_lr_scale) * spent
        order = np.random.default_rng((config.seed, at.stage, at.iteration, 1))
        losses = self.learner.update(episodes, order, lr_scale)
        # Count the stage's own episodes, move its difficulty, and validate when due.
        own = [e for e, one in zip(episodes, specs, strict=True) if one.stage == at.stage]
        level = at.levels[at.stage]
        steps_before = at.steps
        self._move_on(stage, own, sum(episode.steps for episode in episodes))
        is_last = stage.spent(at.episodes, at.stage_steps) >= 1 or self._is_passed(stage)
        figures = self._figures(stage, own, level, losses, is_last)
        return replace(
            figures, validation=self._validate(stage, is_last), tasks=self._test(steps_before)
        )

    def _specs(self, stage: Stage) -> list[EpisodeSpec]:
        """Return the next iteration's episodes: some of them in the stages before."""
        config, at = self._config, self._at
        count = config.learner.episodes_per_iteration
        # One at least is the stage's own, however large the share: else nothing would move on.
        old = min(round(count * stage.rehearsal), count - 1) if at.stage else 0
        own = min(count - old, stage.episodes - at.episodes)
        specs = [
            EpisodeSpec(at.stage, (config.seed, at.stage, at.episodes + k), at.levels[at.stage])
            for k in range(own)
        ]
        for k in range(old):
            number = at.iteration * old + k
            before = number % at.stage
            seed = (config.seed, at.stage, number, before, 2)
            specs.append(EpisodeSpec(before, seed, at.levels[before]))
        return specs

    def _move_on(self, stage: Stage, own: Sequence[Episode], steps: int) -> None:
        """Count what was played, and make the stage's worlds harder or easier."""
        at = self._at
        successes = [episode.is_success for episode in own]
        at.episodes += len(own)
        at.iteration += 1
        at.iterations += 1
        at.steps += steps
        at.stage_steps += steps
        at.recent = (at.recent + successes)[-stage.window :]
        level = at.levels[at.stage]
        if stage.difficulty is not None and level is not None:
            at.levels[at.stage] = self._next_level(stage.difficulty, level, own)

    def _next_level(self, rule: Difficulty, level: float, own: Sequence[Episode]) -> float:
        """Count the episodes that decide on a stage's level, and return the next one."""
        at = self._at
        if not rule.worlds:
            at.on_level += [episode.is_success for episode in own]
            after = rule.after(level, at.on_level)
            if len(at.on_level) >= rule.window:
                at.on_level = []
            return after
        # The latest of each world, those from before it was the level's own included.
        for episode in own:
            world = str(episode.world)
            at.in_worlds[world] = [*at.in_worlds.get(world, []), episode.is_success][-rule.window :]
        latest = at.in_worlds.get(str(world_of_level(level, rule.worlds)), [])
        return rule.after(level, latest)

    def _is_passed(self, stage: Stage) -> bool:
        """Return whether the stage is learnt."""
        if stage.promote_at is None or len(self._at.recent) < stage.window:
            return False
        level = self._at.levels[self._at.stage]
        hard = stage.difficulty is None or level == stage.difficulty.max_level
        return hard and float(np.mean(self._at.recent)) >= stage.promote_at

    def _validate(self, stage: Stage, is_last: bool) -> dict[str, float]:
        """Drive in the worlds kept for validation, and keep the policy that does best."""
        config, at = self._config, self._at
        due = config.validate_every and at.iteration % config.validate_every == 0
        policy = self._driving_policy({})
        if not config.validation or not (due or is_last):
            if is_last:
                self._best = policy
            return {}
        score = self._try(policy, at.stage)
        if at.best is None or score >= at.best - config.validation_tolerance:
            at.kept, self._best = score, policy
        at.best = score if at.best is None else max(at.best, score)
        if not is_last or self._best is None:
            return {stage.name: score}
        before = {config.stages[k].name: self._try(self._best, k) for k in range(at.stage)}
        return before | {stage.name: at.kept}

    def _try(self, policy: Policy, stage: int) -> float:
        """Return the score of a policy in a stage's worlds for validation."""
        config = self._config
        level = config.stages[stage].difficulty
        specs = [
            EpisodeSpec(
                len(config.stages) + stage,
                (config.seed, stage, k, 0, 0, 3),
                None if level is None else level.max_level,
            )
            for k in range(config.validation)
        ]
        episodes = self._rollout(policy, driving_repeat(policy), specs, False)
        return validation_score(episodes, config.collision_weight)

    def _test(self, steps_before: int) -> FixedTaskFigures | None:
        """Play the fixed tasks if another ``test_every`` steps of the run are full."""
        config, every = self._config, self._config.test_every
        if not every or self._at.steps // every == steps_before // every:
            return None
        tasks = fixed_tasks(2 * len(config.stages), config.test_tasks)
        return fixed_task_figures(self._rollout(self._driving_policy({}), 1, tasks, False))

    def _figures(
        self,
        stage: Stage,
        own: Sequence[Episode],
        level: float | None,
        losses: dict[str, float],
        is_last: bool,
    ) -> TrainingIteration:
        """Return the figures of the iteration, but for those of validation and test."""
        at = self._at
        names = own[0].terms
        return TrainingIteration(
            stage=at.stage,
            name=stage.name,
            played=len(own),
            episodes=at.episodes,
            budget=stage.episodes,
            is_last=is_last,
            steps=at.steps,
            success_rate=float(np.mean([episode.is_success for episode in own])),
            recent_success=float(np.mean(at.recent)),
            difficulty=level,
            outcomes=dict(Counter(episode.outcome for episode in own)),
            mean_steps=float(np.mean([episode.steps for episode in own])),
            mean_return=float(np.mean([episode.rewards.sum() for episode in own])),
            terms={name: float(np.mean([e.terms[name] for e in own])) for name in names},
            circling=float(np.mean([episode.turns > CIRCLING for episode in own])),
            losses=losses,
            validation={},
            stage_steps=at.stage_steps,
        )

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the policy of the run: the best of the stage that ended last, else the present."""
        if self._at.episodes == 0 and self._best is not None:
            return with_info(self._best, info | self._driving)
        return self._driving_policy(info)

    def _driving_policy(self, info: dict[str, Any]) -> Policy:
        """Return what has been learnt, as a policy that drives."""
        return self.learner.policy(info | self._driving)

    @property
    def _driving(self) -> dict[str, Any]:
        """Information that policies keep about how they drive."""
        learner, about = self._config.learner, dict[str, Any]()
        if learner.driving_noise:
            about[DRIVING_NOISE] = learner.driving_noise
        if learner.driving_repeat > 1:
            about[DRIVING_REPEAT] = learner.driving_repeat
        return about

    def to_bytes(self) -> bytes:
        """Return a checkpoint."""
        progress = {
            "config": self._config.model_dump(mode="json"),
            "position": asdict(self._at),
        }
        best = {}
        if self._best is not None:
            best["best"] = torch.frombuffer(bytearray(self._best.to_bytes()), dtype=torch.uint8)
        return self.learner.to_bytes(progress, best)


def validation_score(episodes: Sequence[Episode], collision_weight: float | None) -> float:
    """Return 1 - (time-outs + w collisions) / episodes, or for None the share of successes.

    An episode that terminated without success is a collision, of whatever kind; one that was cut
    short is a time-out.
    """
    if collision_weight is None:
        return float(np.mean([episode.is_success for episode in episodes]))
    failed = [episode for episode in episodes if not episode.is_success]
    lost = sum(collision_weight if episode.terminated else 1.0 for episode in failed)
    return 1 - lost / len(episodes)


def _first_level(stage: Stage) -> float | None:
    """Return the difficulty at which a stage begins."""
    return None if stage.difficulty is None else stage.difficulty.start
