"""Folders of training runs: plan, history and policies, checked before they go into a report."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, TypeVar

from pydantic import BaseModel

from andabata.models import Models
from andabata.report.columns import several
from andabata.report.folder import (
    RunFolderError,
    check_keys,
    read_about,
    read_rows,
    settings_of,
)
from andabata.tasks.offroad import OffroadConfig
from andabata.tasks.rewards import RewardConfig
from andabata.training.plans import StagePlan, TrainingPlan
from andabata.training.run import HISTORY
from rl.policy import Policy, load_policy

Row = dict[str, Any]

Environment = TypeVar("Environment", bound=BaseModel)


@dataclass(frozen=True)
class TrainingRun:
    """A training run, read from its folder.

    Attributes:
        folder: Path of the folder.
        seed: Seed of the run.
        plan: Plan that was run.
        models: SHA-256 of the classifiers in the run, by name.
        history: Rows of the updates, in order.
        label: Name of the run among runs with other rewards; empty where the seed names it.
    """

    folder: Path
    seed: int
    plan: TrainingPlan
    models: dict[str, str]
    history: list[Row]
    label: str = ""

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Return the run of a folder.

        Raises:
            RunFolderError: If the run is incomplete, another command's or version's, or none of its
                stages is over.
        """
        description = read_about(folder)
        if description.get("verb") != "train":
            raise RunFolderError(
                f"{folder}: expected a run of train, got one of {description.get('verb')}; "
                "give the folder of train --out"
            )
        history = read_rows(folder / HISTORY)
        if not any(row.get("is_last") for row in history):
            raise RunFolderError(
                f"{folder}: expected a stage that is over, got none; train --resume"
            )
        check_keys(history[0], ("name", "mean_steps", "steps"), folder / HISTORY, folder)
        models = ("forest", "ground_classifier")
        check_keys(description, ("seed", "config", *models), folder / "run.json", folder)
        hashes = {name: description[name] for name in models}
        plan = settings_of(TrainingPlan, description["config"], folder)
        return cls(folder, description["seed"], plan, hashes, history)

    @property
    def name(self) -> str:
        """Name of the run in the figures."""
        return self.label or f"seed {self.seed}"

    @property
    def stages(self) -> tuple[StagePlan, ...]:
        """Stages that are over."""
        return tuple(self.plan.stages[row["name"]] for row in self.history if row["is_last"])

    def environment(self, kind: type[Environment]) -> Environment:
        """Return the environment of the last stage that is over.

        Raises:
            ValueError: If it is of another task.
        """
        found = self.stages[-1].environment
        if not isinstance(found, kind):
            raise ValueError(
                f"{self.folder}: expected a run in rooms as the first, got {found.task}; give "
                "them a report of their own"
            )
        return found

    def policy(self, stage: str) -> Policy:
        """Return the policy at the end of a stage."""
        return load_policy(self.folder / f"policy_{stage}.safetensors")


def told_apart(runs: Sequence[TrainingRun]) -> list[TrainingRun]:
    """Return runs of off-road plans, named by their folders, too, if their rewards differ."""
    if all(run.plan == runs[0].plan for run in runs):
        return list(runs)
    return [replace(run, label=f"{run.folder.name}, {run.name}") for run in runs]


def check_alike(runs: Sequence[TrainingRun], models: Models) -> None:
    """Check that runs belong into the same figures: of one plan, with the same classifiers.

    The rewards of their plans may differ: what another reward does is what such figures show.

    Args:
        runs: Runs.
        models: Classifiers of the runs.

    Raises:
        ValueError: If their plans or classifiers differ, or if two have the same seed and reward.
    """
    seeds = [run.seed for run in runs]
    once = {(run.seed, run.plan.model_dump_json()) for run in runs}
    if len(once) < len(runs):
        raise ValueError(
            f"runs: expected another seed in each, got {seeds}; name each folder once, or train "
            "with another --seed or reward"
        )
    for run in runs:
        if _without_reward(run.plan) != _without_reward(runs[0].plan):
            raise ValueError(
                f"{run.folder}: expected the settings of {runs[0].folder}, got others; "
                "give each plan a report of its own"
            )
        for name, digest in run.models.items():
            if models.hashes[name] != digest:
                raise ValueError(
                    f"{run.folder}: expected the {name} of the run, {digest[:12]}, got "
                    f"{models.hashes[name][:12]}; give it with --{name}"
                )


def _without_reward(plan: TrainingPlan) -> TrainingPlan:
    """Return a plan with the default reward in its off-road stages."""
    stages = {}
    for name, stage in plan.stages.items():
        environment = stage.environment
        if isinstance(environment, OffroadConfig):
            environment = environment.model_copy(update={"reward": RewardConfig()})
        stages[name] = stage.model_copy(update={"environment": environment})
    return plan.model_copy(update={"stages": stages})


def common_stages(runs: Sequence[TrainingRun]) -> tuple[StagePlan, ...]:
    """Return the stages that are over in every run.

    Raises:
        ValueError: If there is no such stage.
    """
    over = [{stage.name for stage in run.stages} for run in runs]
    stages = tuple(one for one in runs[0].stages if all(one.name in names for names in over))
    if not stages:
        found = "; ".join(f"{run.folder}: {[s.name for s in run.stages]}" for run in runs)
        raise ValueError(f"runs: expected a stage that is over in all of them, got {found}")
    return stages


def runs_by_plan(
    runs: Sequence[TrainingRun], name_of: Callable[[TrainingRun], str]
) -> dict[str, tuple[TrainingRun, ...]]:
    """Return the runs by their plans, each under a name of its own.

    Args:
        runs: Runs.
        name_of: Function that names the plan of a run; plans of one name are told by their folders.

    Raises:
        ValueError: If two runs of one plan have the same seed.
    """
    by_plan: dict[str, list[TrainingRun]] = {}
    for run in runs:
        by_plan.setdefault(run.plan.model_dump_json(), []).append(run)
    names = [name_of(some[0]) for some in by_plan.values()]
    found = {}
    for name, some in zip(names, by_plan.values(), strict=True):
        seeds = [run.seed for run in some]
        if len(set(seeds)) < len(seeds):
            raise ValueError(f"runs of {name}: expected another seed in each, got {seeds}")
        full = name if names.count(name) == 1 else f"{name}, {some[0].folder}"
        found[full] = tuple(some)
    return found


def plans_text(groups: Mapping[str, Sequence[TrainingRun]], plan: str) -> str:
    """Return the numbers of runs and of their plans in words.

    Args:
        groups: Runs by their plans.
        plan: Name of a plan.
    """
    runs = sum(map(len, groups.values()))
    return f"{several(runs, 'run')}, {several(len(groups), plan).lower()}."
