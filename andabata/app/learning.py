"""Running a curriculum into a run folder that survives a kill."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from andabata.app.runs import commit, describe, make_folder, write_json
from andabata.app.sampling import PoolSampler
from andabata.app.workers import use_one_thread
from andabata.machine.robot import RobotModel
from andabata.machine.sensors import sensor_settings
from andabata.records.storage import write_atomically
from andabata.tasks.offroad import OffroadConfig, stage_config
from andabata.tasks.rig import RigConfig
from rl.curriculum import Curriculum, CurriculumConfig, Generation, Stage
from rl.sac import SacConfig

STAGES = ("Maze2D", "Maze3D", "Natural")

CHECKPOINT = "checkpoint.safetensors"
POLICY = "policy.safetensors"
HISTORY = "history.jsonl"


class LearningConfig(BaseModel):
    """What ``andabata train`` runs.

    Attributes:
        episodes: Budget of each of the three stages (paper: 200 each; ours by experiment).
        learner: Numbers of the learner.
        stages: Environments of the three stages.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    episodes: tuple[int, int, int] = (256, 64, 128)
    learner: SacConfig = Field(default_factory=SacConfig)
    stages: tuple[OffroadConfig, OffroadConfig, OffroadConfig] = Field(
        default_factory=lambda: (
            stage_config("Maze2D"),
            stage_config("Maze3D"),
            stage_config("Natural"),
        )
    )


def learning_with(sensor: str, robot: str = "andabata") -> LearningConfig:
    """Return the default run with another laser or body; stage 1 keeps its horizontal beams.

    Raises:
        UnknownSensorError: If there is no laser of that name.
        ValueError: If there is no body of that name.
    """
    default, settings = LearningConfig(), sensor_settings(sensor)
    body = {"robot": RobotModel.load(robot)}
    stages = []
    for stage in default.stages:
        laser = settings if stage.rig.sensing.scanner == "rotating" else {}
        rig = RigConfig.model_validate({**stage.rig.model_dump(), **laser, **body})
        stages.append(stage.model_copy(update={"rig": rig}))
    return default.model_copy(update={"stages": tuple(stages)})


def learn(
    folder: Path,
    config: LearningConfig,
    stages: range,
    seed: int,
    workers: int,
    *,
    forest: bytes | None = None,
    resume: bool = False,
    on_generation: Callable[[Generation], None] | None = None,
) -> dict[str, Any]:
    """Run stages of the curriculum and return what came of it.

    The folder holds the resolved configuration, a history of one line a generation, the latest
    checkpoint, the latest policy and that of each finished stage. A run that was killed goes on at
    its last generation and ends with the same bytes as one that was not.

    Args:
        folder: The run's.
        config: What to run.
        stages: Indices of the stages, from 0.
        seed: Of the run.
        workers: Processes that play episodes.
        forest: The cell classifier's file; None for the shipped one.
        resume: Whether to go on with the run that stands in the folder.
        on_generation: Called after each update.

    Raises:
        ValueError: If the folder holds a run and ``resume`` is not set, or another's run.
        FileNotFoundError: If there is nothing to resume.
    """
    use_one_thread()
    make_folder(folder)
    checkpoint = _checkpoint(folder, resume)
    robot = config.stages[0].rig.robot
    grid = config.stages[0].rig.grid
    curriculum_config = CurriculumConfig(
        stages=tuple(Stage(name=STAGES[k], episodes=config.episodes[k]) for k in stages),
        learner=config.learner,
        seed=seed,
        n_sectors=grid.n_sectors,
        max_range=grid.outer_radius,
        limit=robot.max_steering,
        dead_zone=robot.dead_zone,
    )
    info = {"config": config.model_dump(mode="json"), "seed": seed, "commit": commit()}
    if not resume:
        write_json(folder / "run.json", describe("train", config.model_dump(mode="json"), seed))
    began, history = time.perf_counter(), read_history(folder / HISTORY) if resume else []
    steps_before = history[-1]["steps"] if history else 0
    with PoolSampler([config.stages[k] for k in stages], forest, workers) as sampler:
        curriculum = Curriculum(curriculum_config, sampler, checkpoint)
        history = history[: curriculum.generations]
        for generation in curriculum.run():
            history.append(_row(generation))
            policy = curriculum.policy(info | {"stage": generation.name}).to_bytes()
            if generation.episodes == generation.budget:
                write_atomically(folder / f"policy_{generation.name}.safetensors", policy)
            _write(folder, history, policy, curriculum.to_bytes())
            if on_generation is not None:
                on_generation(generation)
    wall = time.perf_counter() - began
    return _summary(folder, history, wall, steps_before)


def _checkpoint(folder: Path, resume: bool) -> bytes | None:
    """Return the checkpoint to go on with, None for a new run."""
    path = folder / CHECKPOINT
    if resume:
        return path.read_bytes()
    if path.exists():
        raise ValueError(f"{folder}: expected an empty folder, got a run; use --resume or --out")
    return None


def read_history(path: Path) -> list[dict[str, Any]]:
    """Return the generations that a run has written down."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def _row(generation: Generation) -> dict[str, Any]:
    """Return a generation, ready for JSON."""
    return {
        "stage": generation.stage,
        "name": generation.name,
        "episodes": generation.episodes,
        "steps": generation.steps,
        "success_rate": generation.success_rate,
        "mean_return": generation.mean_return,
        **generation.outcomes,
        **generation.losses,
    }


def _write(folder: Path, history: list[dict[str, Any]], policy: bytes, checkpoint: bytes) -> None:
    """Write history, policy and, last, the checkpoint: a resume begins from it."""
    lines = "".join(json.dumps(row) + "\n" for row in history)
    write_atomically(folder / HISTORY, lines.encode())
    write_atomically(folder / POLICY, policy)
    write_atomically(folder / CHECKPOINT, checkpoint)


def _summary(
    folder: Path, history: list[dict[str, Any]], wall: float, steps_before: int
) -> dict[str, Any]:
    """Return the run's last line: success over the last generations, and speed."""
    last = history[-1]
    recent = [row["success_rate"] for row in history[-8:] if row["name"] == last["name"]]
    return {
        "run": str(folder),
        "stage": last["name"],
        "episodes": last["episodes"],
        "success_rate": sum(recent) / len(recent),
        "steps": last["steps"],
        "wall_s": wall,
        "steps_per_s": (last["steps"] - steps_before) / wall,
    }
