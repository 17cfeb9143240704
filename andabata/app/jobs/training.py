"""Training runs of one plan, a seed each, with their progress on the console."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from andabata.app.console import Console, Step
from andabata.app.tables import training_text
from andabata.configuration.usage import UsageError
from andabata.engine import Engine
from andabata.models import Models
from andabata.own_code import is_own, load_own
from andabata.runs.lock import locked_folder
from andabata.tasks.offroad import OffroadConfig
from andabata.training.event_files import EventFiles, Row
from andabata.training.plans import StagePlan, TrainingPlan
from andabata.training.progress_table import TrainingView
from andabata.training.run import CHECKPOINT, learn
from rl.curriculum import TrainingIteration
from rl.sac import SacConfig


def with_features(plan: TrainingPlan, features: int | None) -> TrainingPlan:
    """Return a plan whose actor has K global features of its points.

    Args:
        plan: Plan of a learner whose actor reads points.
        features: Number K of features; None keeps the plan's.

    Raises:
        UsageError: If the actor reads no points.
    """
    if features is None:
        return plan
    learner = plan.learner
    if not isinstance(learner, SacConfig) or learner.actor.kind != "points":
        raise UsageError(
            f"--k: expected a plan whose actor reads points, got another {learner.algorithm}; "
            "give --task spn or leave --k out"
        )
    actor = learner.actor.model_copy(update={"features": features})
    return plan.model_copy(update={"learner": learner.model_copy(update={"actor": actor})})


def with_reward(plan: TrainingPlan, function: str | None) -> TrainingPlan:
    """Return a plan whose reward off-road is a function of the user's own, in every stage.

    Args:
        plan: Plan of an off-road task.
        function: File and name of the function, ``FILE.py:NAME``; None keeps the plan's reward.

    Raises:
        UsageError: If it is none of a user's own code, or the plan is not off-road.
        OwnCodeError: If there is no such file or function.
    """
    if function is None:
        return plan
    if not is_own(function):
        raise UsageError(f"--reward: expected FILE.py:NAME, got {function!r}")
    stages = {}
    for name, stage in plan.stages.items():
        environment = stage.environment
        if not isinstance(environment, OffroadConfig):
            raise UsageError(
                f"--reward: expected an off-road task, got {environment.task}; leave it out, and "
                "change the constants of its reward with --set"
            )
        reward = environment.reward.model_copy(update={"function": function})
        changed = environment.model_copy(update={"reward": reward})
        stages[name] = stage.model_copy(update={"environment": changed})
    load_own(function, ())
    return plan.model_copy(update={"stages": stages})


def train_seeds(
    folder: Path,
    plan: TrainingPlan,
    stages: range,
    seeds: Sequence[int],
    engine: Engine,
    models: Models,
    console: Console,
    *,
    resume: bool = False,
    changed: bool = False,
    tensorboard: bool = False,
) -> list[dict[str, Any]]:
    """Run a plan with each seed in turn and return the summary of each run.

    Args:
        folder: Folder of the run; of several runs, the folder of their folders ``seed-K``.
        plan: Plan of every run.
        stages: Indices of the stages, from 0.
        seeds: Seeds, one a run.
        engine: Engine that plays episodes.
        models: Classifiers of cells and of the ground.
        console: Console that shows the progress.
        resume: True to go on with the runs in the folder.
        changed: True to go on even with other code or another classifier.
        tensorboard: True to write TensorBoard's event files into the folder of each run.

    Raises:
        RunLockError: If another command writes the folder of a run.
        EventFilesError: If event files are wanted and tensorboardX is not installed.
    """
    chosen = dict(list(plan.stages.items())[stages.start : stages.stop])
    several, results = len(seeds) > 1, []
    for seed in seeds:
        one = folder / f"seed-{seed}" if several else folder
        # One lock a run, not one for all: several commands may each do some of the seeds.
        with (
            locked_folder(one),
            _watched(chosen, seed, console) as on_iteration,
            _events(one, tensorboard) as events,
        ):
            result = learn(
                one,
                plan,
                stages,
                seed,
                engine=engine,
                models=models,
                # Of several runs the first may be over and the last not begun.
                resume=resume and (not several or (one / CHECKPOINT).exists()),
                changed=changed,
                on_iteration=on_iteration,
                on_history=events,
            )
        results.append(result)
        console.status(training_text(result))
    return results


def runs_summary(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the results of several runs with their success rates in the last stage.

    The rate of a run is that of validation, or of exploring where nothing was validated.
    """
    stage = results[-1]["stage"]
    # Exploring adds noise to every action: validation tells what the policy drives like.
    rates = [run["validation"][stage].get(stage, run["success_rate"]) for run in results]
    return {"runs": list(results), "stage": stage, "rates": rates, "worst": min(rates)}


@contextmanager
def _watched(
    stages: Mapping[str, StagePlan], seed: int, console: Console
) -> Iterator[Callable[[TrainingIteration], None]]:
    """Yield a function that shows iterations: a live table in a terminal, else a bar."""
    # A live table in a log would be one long column of frames.
    if console.shows_live:
        view = TrainingView(stages, f"seed {seed}")
        with console.live(view):
            yield view
        return
    unit, budget = _budget(list(stages.values()))
    with console.progress(f"{unit}, seed {seed}", budget) as step:
        yield _Advance(step, unit)


@contextmanager
def _events(folder: Path, wanted: bool) -> Iterator[Callable[[Sequence[Row]], None] | None]:
    """Yield a function that writes a history's event files, None if none are wanted."""
    if not wanted:
        yield None
        return
    with closing(EventFiles(folder)) as files:
        yield files.write


def _budget(stages: Sequence[StagePlan]) -> tuple[str, int]:
    """Return what a run's budget counts, and the budget: steps where every stage limits them."""
    limits = [stage.steps for stage in stages if stage.steps is not None]
    if len(limits) == len(stages):
        return "steps", sum(limits)
    return "episodes", sum(stage.episodes for stage in stages)


class _Advance:
    """Function that advances a progress bar by an iteration's steps or episodes."""

    def __init__(self, step: Step, unit: str) -> None:
        """Take the bar and what it counts."""
        self._step, self._unit, self._steps = step, unit, 0

    def __call__(self, update: TrainingIteration) -> None:
        """Advance the bar and show the iteration in a few words."""
        done = update.played if self._unit == "episodes" else update.steps - self._steps
        self._steps = update.steps
        self._step(done, _note(update))


def _note(update: TrainingIteration) -> str:
    """Return an update in a few words."""
    level = "" if update.difficulty is None else f" at {update.difficulty:.1f}"
    circling = f", {update.circling:.0%} circle" if update.circling else ""
    return f"{update.name}{level}: {update.recent_success:.0%} of the last goals{circling}"
