"""``andabata train``: training of a policy."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import (
    ClassifierOptions,
    ConsoleOptions,
    EngineOptions,
    RobotOptions,
    Seed,
    SettingsOptions,
)
from andabata.app.task_options import OFFROAD, TaskName, check_task, refuse_options


@command
def train(
    *,
    task: TaskName = OFFROAD,
    out: Annotated[Path, typer.Option(help="Folder of the run.")] = Path("data/runs/train"),
    stages: Annotated[
        str | None, typer.Option(help="Stages to run, as 1 or 1-3; all by default.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    algorithm: Annotated[
        str | None,
        typer.Option(
            "--algorithm",
            "--variant",
            metavar="NAME",
            help="Plan of the task. Off-road sac, the default, actor-critic, the paper's scheme, "
            "or sac-points; spn: sac, sac-paper, sac-1d or td3; td3: td3, td3-improved, "
            "td3-improved-scaled, gdae or gdae-trainable.",
        ),
    ] = None,
    k: Annotated[
        int | None,
        typer.Option(
            min=1, help="Number K of features of an actor on points: learner.actor.features."
        ),
    ] = None,
    changed: Annotated[
        bool, typer.Option("--changed", help="Resume even with other code or classifier.")
    ] = False,
    seeds: Annotated[
        int,
        typer.Option(
            min=1, help="Number of runs, from --seed on, each in a folder of its own in --out."
        ),
    ] = 1,
    tensorboard: Annotated[
        bool,
        typer.Option(
            "--tensorboard", help="Write TensorBoard's event files into the folder of each run."
        ),
    ] = False,
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
        andabata train --task spn --k 20 --seeds 5 --out data/runs/spn
        andabata train --task td3 --variant gdae --seeds 3 --out data/runs/gdae
    """
    from andabata.app.tables import training_text
    from andabata.app.training_runs import runs_summary, train_seeds, with_features
    from andabata.app.usage import span
    from andabata.training.plans import TrainingPlan, load_plan

    check_task(task)
    if task != OFFROAD:
        refuse_options(task, ((robot, RobotOptions), (models, ClassifierOptions)))
    base = load_plan(algorithm, robot.sensor, robot.robot, task)
    plan = settings.resolve(TrainingPlan, with_features(base, k))
    count = len(plan.stages)
    chosen = range(count) if stages is None else span(stages, count, "--stages")
    console, numbers = output.console(), range(seed, seed + seeds)
    with engine.make(console) as made:
        runs = train_seeds(
            out,
            plan,
            chosen,
            numbers,
            made,
            models.load(),
            console,
            resume=resume,
            changed=changed,
            tensorboard=tensorboard,
        )
    if seeds == 1:
        console.result(runs[0], f"{training_text(runs[0])}\npolicy: {out / 'policy.safetensors'}")
    else:
        data = runs_summary(runs)
        text = f"{data['stage']}: validation by seed: {data['rates']}"
        console.result(data, text)
