"""What each choice of the default plan buys in stage 1, over several seeds.

Run with ``python -m tests.benchmarks.bench_learning FOLDER [SEEDS [WORKERS]]``: trains stage 1 with
one choice undone at a time, for each seed, and judges every policy in mazes that neither train nor
judge anything else. Runs that ended are not run again. Prints one line a run, then one a variant.
"""

import json
import sys
from functools import partial
from pathlib import Path

import numpy as np

from andabata.app.settings import resolve
from andabata.bench.maze import judge
from andabata.engine import run_tasks
from andabata.records import atomic_io
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import CHECKPOINT, learn

VARIANTS = {
    "as shipped": (),
    "no penalty for a collision": ("stages.Maze2D.environment.reward.collision=0.0",),
    "rewards as they are": ("learner.reward_scale=1.0",),
    "the paper's repulsion": (
        "stages.Maze2D.environment.reward.front=0.1",
        "stages.Maze2D.environment.reward.side=0.03",
        "stages.Maze2D.environment.reward.rear=0.009",
    ),
    "an action a step": (
        "learner.hold=1",
        "stages.Maze3D.environment.look_every=1",
        "stages.Natural.environment.look_every=1",
    ),
    "the goal as heading": ("stages.Maze2D.environment.heading=goal",),
    "one robot at a time": ("learner.batch=1",),
    "mazes of one difficulty": (
        "stages.Maze2D.difficulty.start=0.6",
        "stages.Maze2D.difficulty.least=0.6",
    ),
    "the actor itself, not its average": ("learner.averaging=1.0",),
    "one learning rate to the end": ("final_pace=1.0",),
    "a third of the gradient steps": ("learner.steps_per_decision=0.1",),
}
EPISODES, FIRST = 200, 3000


def run_one(folder: Path, task: tuple[str, int]) -> dict[str, float]:
    """Train and judge a variant with a seed; return ends of episodes, steps and seconds."""
    name, seed = task
    place = folder / f"{name.replace(' ', '_')}-{seed}"
    result = place / "result.json"
    if not result.exists():
        plan = resolve(TrainingPlan, None, VARIANTS[name], load_plan())
        trained = learn(place, plan, range(1), seed, 1, resume=(place / CHECKPOINT).exists())
        outcomes = judge(place / "policy.safetensors", EPISODES, first=FIRST)
        counts = {key: outcomes[key] for key in ("goal", "collision", "timeout")}
        found = counts | {"steps": trained["steps"], "wall_s": trained["wall_s"]}
        atomic_io.write(result, json.dumps(found).encode())
    return json.loads(result.read_text(encoding="utf-8"))


def main(folder: Path, seeds: int = 3, workers: int = 2) -> None:
    """Run all variants with seeds from 0."""
    tasks = [(name, seed) for seed in range(seeds) for name in VARIANTS]
    found: dict[str, list[dict[str, float]]] = {name: [] for name in VARIANTS}
    for (name, seed), row in run_tasks(partial(run_one, folder), tasks, workers):
        found[name].append(row)
        sys.stdout.write(f"{name}, seed {seed}: {row}\n")
        sys.stdout.flush()
    for name, rows in found.items():
        goals = [row["goal"] / EPISODES for row in rows]
        met, late = ([int(row[key]) for row in rows] for key in ("collision", "timeout"))
        steps = np.mean([row["steps"] for row in rows])
        sys.stdout.write(
            f"{name}: {np.mean(goals):.3f} {goals}, collisions {met}, timeouts {late}, "
            f"{steps:.0f} steps\n"
        )


if __name__ == "__main__":
    words = dict(enumerate(sys.argv))
    main(Path(words[1]), int(words.get(2, "3")), int(words.get(3, "2")))
