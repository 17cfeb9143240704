"""Folders of training runs: plan, history and policies, checked before they go into a report."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from andabata.models import Models
from andabata.report.folder import (
    RunFolderError,
    check_keys,
    read_about,
    read_rows,
    settings_of,
)
from andabata.training.plans import StagePlan, TrainingPlan
from andabata.training.run import HISTORY
from rl.policy import Policy, load_policy

Row = dict[str, Any]


@dataclass(frozen=True)
class TrainingRun:
    """A training run, read from its folder.

    Attributes:
        folder: Path of the folder.
        seed: Seed of the run.
        plan: Plan that was run.
        models: SHA-256 of the classifiers in the run, by name.
        history: Rows of the updates, in order.
    """

    folder: Path
    seed: int
    plan: TrainingPlan
    models: dict[str, str]
    history: list[Row]

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Return the run of a folder.

        Raises:
            RunFolderError: If the run is incomplete, another command's or version's, or none of its
                stages is over.
        """
        about = read_about(folder)
        if about.get("verb") != "train":
            raise RunFolderError(
                f"{folder}: expected a run of train, got one of {about.get('verb')}; "
                "give the folder of train --out"
            )
        history = read_rows(folder / HISTORY)
        if not any(row.get("is_last") for row in history):
            raise RunFolderError(
                f"{folder}: expected a stage that is over, got none; train --resume"
            )
        check_keys(history[0], ("name", "mean_steps", "steps"), folder / HISTORY, folder)
        models = ("forest", "ground_classifier")
        check_keys(about, ("seed", "config", *models), folder / "run.json", folder)
        hashes = {name: about[name] for name in models}
        plan = settings_of(TrainingPlan, about["config"], folder)
        return cls(folder, about["seed"], plan, hashes, history)

    @property
    def name(self) -> str:
        """Name of the run in the figures."""
        return f"seed {self.seed}"

    @property
    def stages(self) -> tuple[StagePlan, ...]:
        """Stages that are over."""
        return tuple(self.plan.stages[row["name"]] for row in self.history if row["is_last"])

    def policy(self, stage: str) -> Policy:
        """Return the policy at the end of a stage."""
        return load_policy(self.folder / f"policy_{stage}.safetensors")


def read_runs(folders: Sequence[Path], models: Models) -> list[TrainingRun]:
    """Return runs for the same figures: of one plan, with the same classifiers.

    Args:
        folders: Folders of the runs.
        models: Classifiers of the runs.

    Raises:
        RunFolderError: If a folder holds no run, or another command's.
        ValueError: If their plans or classifiers differ, or if
            two have the same seed.
    """
    runs = [TrainingRun.read(folder) for folder in folders]
    seeds = [run.seed for run in runs]
    if len(set(seeds)) < len(seeds):
        raise ValueError(f"runs: expected another seed in each, got {seeds}")
    for run in runs:
        if run.plan != runs[0].plan:
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
    return runs


def common_stages(runs: Sequence[TrainingRun]) -> tuple[StagePlan, ...]:
    """Return the stages that are over in every run.

    Raises:
        ValueError: If there is no such stage.
    """
    stages = tuple(s for s in runs[0].stages if all(s in run.stages for run in runs))
    if not stages:
        found = "; ".join(f"{run.folder}: {[s.name for s in run.stages]}" for run in runs)
        raise ValueError(f"runs: expected a stage that is over in all of them, got {found}")
    return stages
