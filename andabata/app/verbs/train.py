"""``andabata train``: learn to steer."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.app.options import (
    ConfigFile,
    ForestFile,
    Json,
    Quiet,
    Robot,
    Seed,
    Sensor,
    Set,
    Workers,
)

if TYPE_CHECKING:
    from rl.curriculum import Generation


def train(
    out: Annotated[Path, typer.Option(help="The run's folder.")] = Path("data/runs/train"),
    stages: Annotated[str, typer.Option(help="Stages to run, as 1 or 1-3.")] = "1-3",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    sensor: Sensor = "utm-30lx",
    robot: Robot = "andabata",
    forest: ForestFile = None,
    seed: Seed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run the curriculum: maze in 2D, maze in 3D, natural worlds."""
    from andabata.app.console import Voice
    from andabata.app.learning import LearningConfig, learn, learning_with
    from andabata.app.settings import resolve
    from traversability.forest import Forest

    voice = Voice(quiet, as_json)
    chosen = _stages(stages)
    resolved = resolve(LearningConfig, config, settings or (), learning_with(sensor, robot))
    judge = Forest.load(forest).to_bytes() if forest else None
    total = sum(resolved.episodes[k] for k in chosen)
    with voice.progress("episodes", total) as step:

        def on_generation(generation: "Generation") -> None:
            step(generation.played, f"{generation.name}: {generation.success_rate:.0%} of goals")

        result = learn(
            out,
            resolved,
            chosen,
            seed,
            workers,
            forest=judge,
            resume=resume,
            on_generation=on_generation,
        )
    text = (
        f"{result['stage']}: {result['success_rate']:.0%} of the last goals reached while "
        f"exploring, {result['steps']} steps at {result['steps_per_s']:.0f} a second\n"
        f"policy: {out / 'policy.safetensors'}"
    )
    voice.result(result, text)


def _stages(text: str) -> range:
    """Return the indices of stages named as ``1`` or ``1-3``."""
    from andabata.app.usage import UsageError

    first, _, last = text.partition("-")
    last = last or first
    if not (first in ("1", "2", "3") and last in ("1", "2", "3") and first <= last):
        raise UsageError(f"--stages: expected 1, 2, 3 or a span as 1-3, got {text!r}")
    return range(int(first) - 1, int(last))
