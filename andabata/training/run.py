"""Running a curriculum into a run folder that survives a kill."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from andabata.engine import Engine, SerialEngine
from andabata.models import Models
from andabata.own_code import own_digests
from andabata.runs import atomic_io
from andabata.runs.folder import commit, describe, make_folder, write_json
from andabata.runs.strict_json import dumps
from andabata.tasks.offroad import OffroadConfig
from andabata.tasks.rooms.config import RoomConfig, refuse_judging_rooms
from andabata.tasks.vector import TaskConfig, renderer_of
from andabata.training.parallel_sampler import ParallelSampler
from andabata.training.plans import TrainingPlan
from rl.curriculum import Curriculum, TrainingIteration
from rl.networks import use_one_thread

CHECKPOINT = "checkpoint.safetensors"
POLICY = "policy.safetensors"
HISTORY = "history.jsonl"


def learn(
    folder: Path,
    plan: TrainingPlan,
    stages: range,
    seed: int,
    *,
    engine: Engine | None = None,
    models: Models | None = None,
    resume: bool = False,
    changed: bool = False,
    on_iteration: Callable[[TrainingIteration], None] | None = None,
    on_history: Callable[[Sequence[dict[str, Any]]], None] | None = None,
) -> dict[str, Any]:
    """Run stages of a curriculum and return its figures.

    The folder holds the resolved plan, a history of one line an iteration, the latest checkpoint,
    the latest policy and that of each finished stage. A run that was killed goes on at its last
    iteration and ends with the same bytes as one that was not.

    Args:
        folder: Folder of the run.
        plan: Training plan.
        stages: Indices of the stages, from 0.
        seed: Seed of the run.
        engine: Engine that runs the episodes, on which the result does not depend; None for this
            process.
        models: Classifiers; None for the shipped ones.
        resume: True to go on with the run that stands in the folder.
        changed: True to go on even with other code or another classifier than it began with.
        on_iteration: Function that is called after each update.
        on_history: Function that is called with all rows of the history each time that they and
            the checkpoint are on the disk.

    Raises:
        ValueError: If the folder holds a run and ``resume`` is not set, or another's run, or a
            stage is in a room that judges.
        FileNotFoundError: If there is nothing to resume.
    """
    models = models or Models()
    # A second thread made gradient steps twelve times as slow wherever another program needed its
    # core (docs/results/learning.md, what bounds the time).
    use_one_thread()
    make_folder(folder)
    settings = plan.model_dump(mode="json")
    origin: dict[str, Any] = {
        "config": settings,
        "stages": [stages.start, stages.stop],
        "seed": seed,
        "commit": commit(),
        **{name: models.hashes[name] for name in ("forest", "ground_classifier")},
    }
    if own := own_digests(_own_code(plan)):
        origin["own"] = own
    checkpoint = _checkpoint(folder, origin, resume, changed)
    if not resume:
        write_json(folder / "run.json", describe("train", settings, seed) | origin)
    chosen = [list(plan.stages.values())[k] for k in stages]
    tasks = [one.environment for one in chosen]
    began, history = time.perf_counter(), read_history(folder / HISTORY) if resume else []
    steps_before = history[-1]["steps"] if history else 0
    sampler = ParallelSampler(_environments(tasks), models, engine or SerialEngine())
    schedule = plan.curriculum(stages, seed)
    curriculum = Curriculum(schedule, sampler, checkpoint, renderer_of(tasks[-1]))
    # Iterations after the last checkpoint are played again.
    history = history[: curriculum.iterations]
    for iteration in curriculum.run():
        history.append(asdict(iteration))
        if iteration.is_last or curriculum.iterations % plan.checkpoint_every == 0:
            policy = curriculum.policy(origin | {"stage": iteration.name}).to_bytes()
            # The next stage overwrites the latest policy; that of this one is kept beside it.
            if iteration.is_last:
                atomic_io.write(folder / f"policy_{iteration.name}.safetensors", policy)
            _write(folder, history, policy, curriculum.to_bytes())
            if on_history is not None:
                on_history(history)
        if on_iteration is not None:
            on_iteration(iteration)
    wall = time.perf_counter() - began
    return _summary(folder, history, wall, steps_before)


def _own_code(plan: TrainingPlan) -> list[str]:
    """Return the names of the functions of the user's own that stages are rewarded by."""
    environments = [stage.environment for stage in plan.stages.values()]
    offroad = [one for one in environments if isinstance(one, OffroadConfig)]
    return sorted({one.reward.function for one in offroad if one.reward.function is not None})


def _environments(tasks: Sequence[TaskConfig]) -> list[TaskConfig]:
    """Return the environments of a curriculum: its stages, their validations, and its tests.

    Raises:
        JudgingRoomError: If a room of one of them is for judging alone.
    """
    environments = [*tasks, *(task.unseen for task in tasks)]
    if isinstance(tasks[-1], RoomConfig):
        environments.append(tasks[-1].fixed)
    for environment in environments:
        if isinstance(environment, RoomConfig):
            refuse_judging_rooms(environment)
    return environments


def _checkpoint(folder: Path, origin: dict[str, Any], resume: bool, changed: bool) -> bytes | None:
    """Return the checkpoint to go on with, None for a new run."""
    path = folder / CHECKPOINT
    if not resume:
        if path.exists():
            raise ValueError(
                f"{folder}: expected an empty folder, got a run; use --resume or --out"
            )
        return None
    data = path.read_bytes()
    before = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    for name in _differences(before.get("config", {}), origin["config"], "config"):
        raise ValueError(f"{name}; go on with the run's own settings or begin a new one")
    for name in ("stages", "seed"):
        if before.get(name) != origin[name]:
            raise ValueError(
                f"{name}: expected {before.get(name)}, as it began, got {origin[name]}"
            )
    # Settings decide whether it is the same run; code and classifiers only whether the end has the
    # same bytes, which a user may do without.
    for name in ("forest", "ground_classifier", "commit", "own"):
        if before.get(name) != origin.get(name) and not changed:
            raise ValueError(
                f"{name}: expected {before.get(name)}, with which the run began, got "
                f"{origin.get(name)}; the end would not be that of an unbroken run: --changed "
                "goes on"
            )
    return data


def _differences(before: Any, now: Any, name: str) -> list[str]:  # noqa: ANN401 - JSON.
    """Return where two plans differ, in words."""
    if isinstance(before, dict) and isinstance(now, dict):
        return [
            line
            for key in sorted(before.keys() | now.keys())
            for line in _differences(before.get(key), now.get(key), f"{name}.{key}")
        ]
    return [] if before == now else [f"{name}: expected {before}, as the run began, got {now}"]


def read_history(path: Path) -> list[dict[str, Any]]:
    """Return the iterations that a run has written down."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _write(folder: Path, history: list[dict[str, Any]], policy: bytes, checkpoint: bytes) -> None:
    """Write history, policy and, last, the checkpoint: a resume begins from it."""
    lines = "".join(dumps(row) + "\n" for row in history)
    atomic_io.write(folder / HISTORY, lines.encode())
    atomic_io.write(folder / POLICY, policy)
    atomic_io.write(folder / CHECKPOINT, checkpoint)


def _summary(
    folder: Path, history: list[dict[str, Any]], wall: float, steps_before: int
) -> dict[str, Any]:
    """Return the run's last line: success over the last generations, and speed."""
    last = history[-1]
    return {
        "run": str(folder),
        "stage": last["name"],
        "episodes": last["episodes"],
        "success_rate": last["recent_success"],
        "validation": {row["name"]: row["validation"] for row in history if row["is_last"]},
        "steps": last["steps"],
        "wall_s": wall,
        "steps_per_s": (last["steps"] - steps_before) / wall,
    }
