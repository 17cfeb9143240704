"""Measures what each choice of the training plan contributes in stage 1, over several seeds.

``python -m andabata.bench.studies.learning FOLDER`` trains stage 1 with one choice undone at a
time, for each seed, and evaluates every policy in mazes that are used for nothing else. Runs that
have ended are not repeated. Prints a Markdown table.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from andabata.bench.command import run_command
from andabata.bench.studies.maze import evaluate_in_mazes
from andabata.bench.table import Row, markdown_table
from andabata.engine_processes import run_tasks
from andabata.runs import atomic_io
from andabata.runs.strict_json import dumps
from andabata.training.run import CHECKPOINT

VARIANTS: dict[str, tuple[str, ...]] = {
    "as shipped": (),
    "no penalty for a collision": ("stages.Maze2D.environment.reward.collision=0.0",),
    "rewards as they are": ("learner.reward_scale=1.0",),
    "the paper's repulsion": (
        "stages.Maze2D.environment.reward.front=0.1",
        "stages.Maze2D.environment.reward.side=0.03",
        "stages.Maze2D.environment.reward.rear=0.009",
    ),
    "an action a step": (
        "learner.action_repeat=1",
        "stages.Maze3D.environment.perception_decimation=1",
        "stages.Natural.environment.perception_decimation=1",
    ),
    "the goal as heading": ("stages.Maze2D.environment.heading=goal",),
    "one robot at a time": ("learner.episodes_per_iteration=1",),
    "mazes of one difficulty": (
        "stages.Maze2D.difficulty.start=0.6",
        "stages.Maze2D.difficulty.least=0.6",
    ),
    "the actor itself, not its average": ("learner.ema_rate=1.0",),
    "one learning rate to the end": ("final_lr_scale=1.0",),
    "a third of the gradient steps": ("learner.updates_per_step=0.1",),
}
"""Settings of ``andabata train`` by variant."""

EPISODES, FIRST_WORLD = 200, 3000
"""Number of test episodes, and world seed of their first maze."""


def train_and_evaluate(folder: Path, run: tuple[str, int]) -> Row:
    """Train and evaluate one variant with one seed, unless its result is there already.

    Args:
        folder: Folder of all runs.
        run: Variant and seed.

    Returns:
        Number of test episodes by outcome, control steps and seconds of the training.
    """
    variant, seed = run
    out = folder / f"{variant.replace(' ', '_')}-{seed}"
    result = out / "result.json"
    if not result.exists():
        settings = [word for setting in VARIANTS[variant] for word in ("--set", setting)]
        resume = ["--resume"] if (out / CHECKPOINT).exists() else []
        words = ["train", "--stages", "1", "--seed", str(seed), "--workers", "1", "--quiet"]
        printed = run_command(*words, "--out", str(out), "--json", *settings, *resume)
        trained = json.loads(printed.splitlines()[-1])
        outcomes = evaluate_in_mazes(out / "policy.safetensors", EPISODES, first_world=FIRST_WORLD)
        counts = {key: outcomes[key] for key in ("goal", "collision", "timeout")}
        row = counts | {"steps": trained["steps"], "wall_s": trained["wall_s"]}
        atomic_io.write(result, dumps(row).encode())
    found: Row = json.loads(result.read_text(encoding="utf-8"))
    return found


def variant_row(variant: str, runs: Sequence[Row]) -> Row:
    """Return the success rates of one variant's seeds and their mean."""
    rates = [run["goal"] / EPISODES for run in runs]
    return {
        "variant": variant,
        "mean success": float(np.mean(rates)),
        "by seed": ", ".join(f"{rate:.3f}" for rate in rates),
        "collisions": ", ".join(str(run["collision"]) for run in runs),
        "timeouts": ", ".join(str(run["timeout"]) for run in runs),
        "mean steps": round(float(np.mean([run["steps"] for run in runs]))),
    }


def main(argv: Sequence[str] | None = None) -> None:
    """Train and evaluate all variants with seeds from 0, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="Folder for the runs.")
    parser.add_argument("--seeds", type=int, default=3, help="Number of seeds, from 0 on.")
    parser.add_argument("--workers", type=int, default=2, help="Number of processes.")
    options = parser.parse_args(argv)
    runs = [(variant, seed) for seed in range(options.seeds) for variant in VARIANTS]
    work = run_tasks(partial(train_and_evaluate, options.folder), runs, options.workers)
    found: dict[str, list[Row]] = {variant: [] for variant in VARIANTS}
    for (variant, _), row in track(work, "runs", total=len(runs), console=Console(stderr=True)):
        found[variant].append(row)
    sys.stdout.write(markdown_table([variant_row(name, rows) for name, rows in found.items()]))


if __name__ == "__main__":
    main()
