"""Training runs of one plan, a seed each, with their progress on the console."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.app.tables import training_text
from andabata.models import Models
from andabata.training.plans import TrainingPlan
from andabata.training.run import CHECKPOINT, learn
from rl.curriculum import TrainingIteration


def train_seeds(
    folder: Path,
    plan: TrainingPlan,
    stages: range,
    seeds: Sequence[int],
    workers: int,
    models: Models,
    console: Console,
    *,
    resume: bool = False,
    changed: bool = False,
) -> list[dict[str, Any]]:
    """Run a plan with each seed in turn and return the summary of each run.

    Args:
        folder: Folder of the run; of several runs, the folder of their folders ``seed-K``.
        plan: Plan of every run.
        stages: Indices of the stages, from 0.
        seeds: Seeds, one a run.
        workers: Number of processes that play episodes.
        models: Classifiers of cells and of the ground.
        console: Console that shows the progress.
        resume: True to go on with the runs in the folder.
        changed: True to go on even with other code or another classifier.
    """
    budget = sum(list(plan.stages.values())[stage].episodes for stage in stages)
    several, results = len(seeds) > 1, []
    for seed in seeds:
        one = folder / f"seed-{seed}" if several else folder
        with console.progress(f"episodes, seed {seed}", budget) as step:
            result = learn(
                one,
                plan,
                stages,
                seed,
                workers,
                models=models,
                # Of several runs the first may be over and the last not begun.
                resume=resume and (not several or (one / CHECKPOINT).exists()),
                changed=changed,
                on_iteration=lambda update: step(update.played, _note(update)),
            )
        results.append(result)
        console.status(training_text(result))
    return results


def runs_summary(results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the results of several runs with their success rates in the last stage.

    The rate of a run is that of validation, or of exploring where nothing was validated.
    """
    stage = results[-1]["stage"]
    rates = [run["validation"][stage].get(stage, run["success_rate"]) for run in results]
    return {"runs": list(results), "stage": stage, "rates": rates, "worst": min(rates)}


def _note(update: TrainingIteration) -> str:
    """Return an update in a few words."""
    level = "" if update.difficulty is None else f" at {update.difficulty:.1f}"
    circling = f", {update.circling:.0%} circle" if update.circling else ""
    return f"{update.name}{level}: {update.recent_success:.0%} of the last goals{circling}"
