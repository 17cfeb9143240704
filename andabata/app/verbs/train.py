"""``andabata train``: training of a policy."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import Given, command
from andabata.app.options.models import ClassifierOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EngineOptions,
    RobotOptions,
    Seed,
    SettingsOptions,
)
from andabata.app.options.task import TaskName
from andabata.app.options.training import TrainingOptions
from andabata.app.run_kinds import OFFROAD, kind_of_task, refuse_foreign


@command
def train(
    *,
    task: TaskName = OFFROAD,
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("data/runs/train"),
    training: TrainingOptions,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: ClassifierOptions,
    seed: Seed = 0,
    engine: EngineOptions,
    output: ConsoleOptions,
) -> None:
    """Run the curriculum: maze in 2D, maze in 3D, natural worlds.

    With --task spn or td3, run that of rooms, for policies that drive by a planar laser.

    Examples:
        andabata train --stages 1 --tensorboard --out data/runs/maze
        andabata train --resume
        andabata train --algorithm actor-critic --set stages.Maze2D.episodes=500
        andabata train --stages 1 --reward examples/own_reward.py:smooth
        andabata train --task spn --k 20 --seeds 5 --out data/runs/spn
    """
    from andabata.app.jobs.training import runs_summary, train_seeds
    from andabata.app.tables import training_text

    refuse_foreign(kind_of_task("train", task), task, Given(robot, models))
    plan, console = training.plan(task, robot, settings), output.console()
    stages = training.chosen(plan)
    with engine.make(console) as made:
        runs = train_seeds(
            out,
            plan,
            stages,
            range(seed, seed + training.seeds),
            made,
            models.load(),
            console,
            resume=training.resume,
            changed=training.changed,
            tensorboard=training.tensorboard,
        )
    if training.seeds == 1:
        console.result(runs[0], f"{training_text(runs[0])}\npolicy: {out / 'policy.safetensors'}")
    else:
        data = runs_summary(runs)
        text = f"{data['stage']}: validation by seed: {data['rates']}"
        console.result(data, text)
