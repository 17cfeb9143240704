"""``andabata train``: learn to steer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import (
    ConfigFile,
    ForestFile,
    GroundClassifierFile,
    Json,
    Quiet,
    Robot,
    Seed,
    Sensor,
    Set,
    Workers,
)

if TYPE_CHECKING:
    from andabata.training.plans import TrainingPlan
    from rl.curriculum import TrainingIteration


def train(
    out: Annotated[Path, typer.Option(help="The run's folder.")] = Path("data/runs/train"),
    stages: Annotated[str, typer.Option(help="Stages to run, as 1 or 1-3.")] = "1-3",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    algorithm: Annotated[
        str, typer.Option(help="sac, the default, or actor-critic, the paper's scheme.")
    ] = "sac",
    changed: Annotated[
        bool, typer.Option("--changed", help="Resume even with other code or classifier.")
    ] = False,
    seeds: Annotated[
        int, typer.Option(min=1, help="Runs, from --seed on, each in a folder of its own in --out.")
    ] = 1,
    sensor: Sensor = "utm-30lx",
    robot: Robot = "andabata",
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    seed: Seed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run the curriculum: maze in 2D, maze in 3D, natural worlds."""
    from andabata.app.console import Console
    from andabata.app.settings import resolve
    from andabata.models import Models
    from andabata.training.plans import TrainingPlan, load_plan
    from andabata.training.run import CHECKPOINT, learn

    console = Console(quiet, as_json)
    chosen = _stages(stages)
    plan = load_plan(algorithm, sensor, robot)
    resolved = resolve(TrainingPlan, config, settings or (), plan)
    models = Models.load(forest, ground_classifier)
    runs = []
    for number in range(seed, seed + seeds):
        folder = out if seeds == 1 else out / f"seed-{number}"
        with console.progress(f"episodes, seed {number}", _budget(resolved, chosen)) as step:
            result = learn(
                folder,
                resolved,
                chosen,
                number,
                workers,
                models=models,
                # Of several runs the first may be over and the last not begun.
                resume=resume and (seeds == 1 or (folder / CHECKPOINT).exists()),
                changed=changed,
                on_iteration=lambda generation: step(generation.played, _told(generation)),
            )
        runs.append(result)
        console.status(_ended(result))
    if seeds == 1:
        text = f"{_ended(runs[0])}\npolicy: {out / 'policy.safetensors'}"
        console.result(runs[0], text)
        return
    last = runs[-1]["stage"]
    rates = [run["validation"][last].get(last, run["success_rate"]) for run in runs]
    data = {"runs": runs, "stage": last, "rates": rates, "worst": min(rates)}
    console.result(data, f"{last}: goals reached where nothing was learnt, by seed: {rates}")


def _budget(plan: "TrainingPlan", chosen: range) -> int:
    """Return the most episodes of a run."""
    return sum(list(plan.stages.values())[k].episodes for k in chosen)


def _ended(result: dict[str, Any]) -> str:
    """Return a run in a few words."""
    tried = result["validation"].get(result["stage"], {})
    unseen = ", ".join(f"{name} {rate:.0%}" for name, rate in tried.items())
    return (
        f"{result['stage']}: {result['success_rate']:.0%} of the last goals reached while "
        f"exploring{f'; in unseen worlds: {unseen}' if unseen else ''}; {result['steps']} steps "
        f"in {result['wall_s']:.0f} s"
    )


def _told(generation: "TrainingIteration") -> str:
    """Return a generation in a few words."""
    level = "" if generation.difficulty is None else f" at {generation.difficulty:.1f}"
    circling = f", {generation.circling:.0%} circle" if generation.circling else ""
    return f"{generation.name}{level}: {generation.recent_success:.0%} of the last goals{circling}"


def _stages(text: str) -> range:
    """Return the indices of stages named as ``1`` or ``1-3``."""
    from andabata.app.usage import UsageError

    first, _, last = text.partition("-")
    last = last or first
    if not (first in ("1", "2", "3") and last in ("1", "2", "3") and first <= last):
        raise UsageError(f"--stages: expected 1, 2, 3 or a span as 1-3, got {text!r}")
    return range(int(first) - 1, int(last))
