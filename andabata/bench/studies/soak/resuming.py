"""Trainings that are cut at random and go on: they end with the bytes of one that was not."""

import random
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path

from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.configuration.settings import resolve
from andabata.training.plans import TASKS, TrainingPlan, algorithms, load_plan
from andabata.training.run import CHECKPOINT, HISTORY, POLICY, learn
from rl.curriculum import TrainingIteration

_SEED = 8006
_CHECKPOINT_EVERY = 3
"""Iterations between checkpoints: most cuts are in between, and lose what came after the last."""

_SMALL = {
    "offroad": (
        "stages.Maze2D.environment.seeds=[0, 1]",
        "stages.Maze2D.environment.terminations.time_limit=3",
    ),
    "spn": ("test_every=0", "stages.Rooms.environment.random_rooms=1"),
    "td3": ("stages.Rooms.environment.random_rooms=1",),
}
"""Settings that make a training small, by task; ``_small_learner`` has those of learners."""


class Cut(Exception):  # noqa: N818 - it is no error of the training.
    """End of a training before its time."""


def resumed_trainings_are_equal(count: int, folder: Path) -> Outcome:
    """Check that trainings of each algorithm, cut at random iterations, end with equal bytes.

    Args:
        count: Number of cuts of each algorithm.
        folder: Folder for their files.
    """
    tally, plans = Tally(), [(task, name) for task in TASKS for name in algorithms(task)]
    for task, name in plans:
        plan, place = small_plan(task, name, count), folder / task / name
        moments = _learn(place / "whole", plan)
        pick = random.Random(f"{_SEED} {task} {name}")
        cuts = sorted(pick.sample(moments[:-1], min(count, len(moments) - 1)))
        _learn_with_cuts(place / "cut", plan, cuts)
        tally.trials += len(cuts)
        for file in (CHECKPOINT, POLICY, HISTORY):
            same = (place / "whole" / file).read_bytes() == (place / "cut" / file).read_bytes()
            tally.expect(same, f"{task}, {name}, cut after {cuts}: {file} differs")
    return tally.outcome(f"{tally.trials} cuts in trainings by {len(plans)} plans")


def small_plan(task: str, name: str, cuts: int) -> TrainingPlan:
    """Return a plan of a training of seconds.

    Args:
        task: Task.
        name: Name of the plan.
        cuts: Number of cuts that it has room for.
    """
    plan = load_plan(name, task=task)
    stage = next(iter(plan.stages))
    overrides = ["validation=1", "validate_every=0", f"checkpoint_every={_CHECKPOINT_EVERY}"]
    overrides += [f"stages.{stage}.episodes={2 * (2 * cuts + 2)}", *_SMALL[task]]
    fields = type(plan.learner).model_fields
    wanted = {"hidden": "[8, 8]", "episodes_per_iteration": "2", "batch_size": "16"}
    wanted |= {"updates_per_step": "0.02"}
    # Warm-up drives need a goal in the observations, which tasks off-road do not have.
    wanted |= {} if task == "offroad" else {"warmup_episodes": "2"}
    overrides += [f"learner.{key}={value}" for key, value in wanted.items() if key in fields]
    return resolve(TrainingPlan, overrides=overrides, base=plan)


def _learn_with_cuts(folder: Path, plan: TrainingPlan, cuts: Collection[int]) -> None:
    """Train the first stage, cut after some numbers of episodes."""
    for cut in (*cuts, None):
        with suppress(Cut):
            # Without a checkpoint yet the training begins anew, in its folder.
            _learn(folder, plan, (folder / CHECKPOINT).exists(), cut)


def _learn(
    folder: Path, plan: TrainingPlan, resume: bool = False, cut: int | None = None
) -> list[int]:
    """Train; return the number of episodes after each iteration.

    Raises:
        Cut: At the first iteration after so many episodes.
    """
    moments: list[int] = []

    def on_iteration(iteration: TrainingIteration) -> None:
        moments.append(iteration.episodes)
        if cut is not None and iteration.episodes >= cut:
            raise Cut

    learn(folder, plan, range(1), _SEED, resume=resume, on_iteration=on_iteration)
    return moments
