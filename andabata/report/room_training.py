"""Sections on training in rooms, with figures of Zhang et al. (arXiv 2010.10209, section IV-A)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.evaluation.room_drives import RoomAttempt, drive_tasks
from andabata.evaluation.room_table import task_score
from andabata.report.blocks import Plot, Table
from andabata.report.page import Section
from andabata.report.plots.room_curves import LearningCurves, learning_curves_figure
from andabata.report.plots.rooms import trajectories_figure
from andabata.report.training_folder import TrainingRun, plans_text, runs_by_plan
from andabata.report.training_page import TrainingSections
from andabata.tasks.rooms.lattice_oracle import oracle_steps
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.terminations import Outcome
from rl.sac import SacConfig
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room

Row = dict[str, Any]

TABLE_1 = {
    "1D input": (3.616, 14.397),
    "K = 2": (3.597, 14.326),
    "K = 3": (3.611, 14.352),
    "K = 5": (3.618, 14.390),
    "K = 10": (3.619, 14.396),
    "K = 20": (3.622, 14.404),
    "K = 50": (3.619, 14.389),
}
"""Best scores of the paper in Env3, and in Env0 to Env3 (Table I, whose row labels are swapped)."""

_GROUP_COLUMNS = (
    "actor",
    "seeds",
    "best_score_hardest_room",
    "paper_score_env3",
    "best_score",
    "paper_score_env0_3",
    "seeds_with_all_tasks",
    "best_steps_to_oracle",
)
"""Columns of an actor that are not folded."""

_RUN_COLUMNS = (
    "actor",
    "seed",
    "first_steps_with_all_tasks",
    "best_reached",
    "best_score",
    "chosen_reached",
    "chosen_score",
    "chosen_steps_to_oracle",
)
"""Columns of a run that are not folded."""

_LAST = 5
"""Number of tests at the end whose mean says whether a policy holds what it has learnt."""

_TESTS_TEXT = (
    "A test drives the fixed tasks of all rooms without exploring; a task's score is 1 - 0.001 T "
    "after T control steps, or -1. The rooms are this project's own, since the paper's are not "
    "published: scores depend on the size of a room and compare within this table alone, while "
    "T/oracle, the ratio to the fewest steps that a search finds, does not depend on it. The "
    "paper's best scores stand beside for the order of magnitude."
)

_BEST_TEXT = (
    "the paper's beside; seeds whose best test reached every goal; goals of the last five tests; "
    "steps of the best test against the oracle's."
)

_RUNS_TEXT = "The chosen policy is the one that validation on random tasks chose."

Drives = Mapping[str, list[RoomAttempt]]
"""Drives of a policy by room."""


class RoomTest(NamedTuple):
    """A test during training.

    Attributes:
        steps: Number of control steps of the run before it.
        tasks: Number of control steps of each task, None for a failure.
    """

    steps: int
    tasks: tuple[int | None, ...]

    @property
    def scores(self) -> NDArray[np.float64]:
        """Score of each task, shape (tasks,)."""
        ends = [Outcome.TIMEOUT if steps is None else Outcome.GOAL for steps in self.tasks]
        return np.array([task_score(end, n or 0) for end, n in zip(ends, self.tasks, strict=True)])

    @property
    def reached(self) -> int:
        """Number of tasks that reached their goal."""
        return sum(steps is not None for steps in self.tasks)

    def ratio(self, oracle: Sequence[int]) -> float | None:
        """Return the mean ratio of the steps to the oracle's, over the tasks that succeeded."""
        found = [n / best for n, best in zip(self.tasks, oracle, strict=True) if n is not None]
        return float(np.mean(found)) if found else None


@dataclass(frozen=True)
class Group:
    """Runs of one plan, a seed each.

    Attributes:
        name: Name of the actor: ``K = 20``, or ``1D input``.
        runs: Runs.
        tests: Tests of each run.
    """

    name: str
    runs: tuple[TrainingRun, ...]
    tests: tuple[tuple[RoomTest, ...], ...]

    def curves(self, places: NDArray[np.int64], count: int) -> LearningCurves:
        """Return the scores of the tests that all runs have.

        Args:
            places: Index of each task's room, shape (tasks,).
            count: Number of rooms.
        """
        length = min(len(tests) for tests in self.tests)
        by_room = places[:, None] == np.arange(count)
        scores = [[test.scores @ by_room for test in tests[:length]] for tests in self.tests]
        # Tests come after whole iterations: those of two seeds are some steps apart.
        steps = np.mean([[test.steps for test in tests[:length]] for tests in self.tests], axis=0)
        return LearningCurves(steps, np.array(scores))


def tests_sections(runs: Sequence[TrainingRun]) -> TrainingSections:
    """Return the sections on training runs that were tested on fixed tasks.

    Args:
        runs: Several seeds of one plan or of several.

    Raises:
        ValueError: If a run had no tests, the rooms of two runs differ, or two runs of one plan
            have the same seed.
    """
    task = _shared_task(runs)
    rooms = [make_room(name) for name in task.rooms]
    places = np.array([index for index, _ in task.fixed_tasks])
    oracle = _oracle(task, rooms)
    groups = [
        Group(name, some, tuple(_tests(run) for run in some))
        for name, some in runs_by_plan(runs, _actor).items()
    ]
    chosen = {run.folder: _chosen_drives(run) for run in runs}
    group_rows = [_group_row(group, places == len(rooms) - 1, oracle) for group in groups]
    run_rows = [
        _run_row(group.name, run, tests, chosen[run.folder], oracle)
        for group in groups
        for run, tests in zip(group.runs, group.tests, strict=True)
    ]
    return TrainingSections(
        title="Learning to drive in rooms",
        lead=plans_text({group.name: group.runs for group in groups}, "actor"),
        rows={"groups": group_rows, "runs": run_rows},
        learning=Section("Tests during training", _TESTS_TEXT, _curves(groups, task, places)),
        results=Section(
            "Best tests (Table I)",
            f"Means over the seeds: best score in {rooms[-1].name} and in all rooms, {_BEST_TEXT}",
            Table(group_rows, _GROUP_COLUMNS, every="All columns"),
        ),
        runs=Section("Runs", _RUNS_TEXT, Table(run_rows, _RUN_COLUMNS, every="All columns")),
        drives=Section(
            "Tests of the chosen policies",
            "The first run of each actor.",
            *(_drives(group, chosen, rooms) for group in groups),
        ),
    )


def _shared_task(runs: Sequence[TrainingRun]) -> SpnConfig:
    """Return the task of the last stage of runs.

    Raises:
        ValueError: If the rooms of two runs differ.
    """
    task = runs[0].environment(SpnConfig)
    for run in runs:
        rooms = run.environment(SpnConfig).rooms
        if rooms != task.rooms:
            raise ValueError(
                f"{run.folder}: expected the rooms {', '.join(task.rooms)} of the other runs, got "
                f"{', '.join(rooms)}; give them a report of their own"
            )
    return task


def _curves(groups: Sequence[Group], task: SpnConfig, places: NDArray[np.int64]) -> Plot:
    """Return the scores of the tests over the control steps."""
    curves = {group.name: group.curves(places, len(task.rooms)) for group in groups}
    counts = np.bincount(places, minlength=len(task.rooms)).tolist()
    caption = "Score of the tests by room: mean over seeds, lowest to highest (Fig. 5)"
    figure = learning_curves_figure(curves, task.rooms, counts)
    return Plot(figure, "learning", caption, drawn=True)


def _drives(group: Group, chosen: Mapping[Path, Drives], rooms: Sequence[Room]) -> Plot:
    """Return the drives of the chosen policy of an actor's first run."""
    first = group.runs[0]
    found = {(group.name, room.name): chosen[first.folder][room.name] for room in rooms}
    title = f"{group.name}, seed {first.seed}"
    figure = trajectories_figure(found, rooms, title)
    caption = f"Fixed tasks: {title} (rooms: Fig. 4)"
    return Plot(figure, f"tasks-{group.name}", caption, drawn=True)


def _oracle(task: SpnConfig, rooms: Sequence[Room]) -> list[int]:
    """Return the fewest steps of each fixed task."""
    radius = task.terminations.goal_radius
    return [oracle_steps(rooms[index], one, task.robot, radius) for index, one in task.fixed_tasks]


def _actor(run: TrainingRun) -> str:
    """Return the name of a run's actor, as in the paper's table."""
    learner = run.plan.learner
    if isinstance(learner, SacConfig) and learner.actor.kind == "points":
        return f"K = {learner.actor.features}"
    return "1D input" if isinstance(learner, SacConfig) else f"1D input, {learner.algorithm}"


def _tests(run: TrainingRun) -> tuple[RoomTest, ...]:
    """Return the tests of a run.

    Raises:
        ValueError: If there was none.
    """
    found = tuple(
        RoomTest(row["steps"], tuple(row["tasks"]["steps"]))
        for row in run.history
        if row.get("tasks") is not None
    )
    if not found:
        raise ValueError(f"{run.folder}: expected tests on fixed tasks, got none; set test_every")
    return found


def _best(tests: Sequence[RoomTest]) -> RoomTest:
    """Return the test with the highest score, the first of equals."""
    return max(tests, key=lambda test: float(test.scores.sum()))


def _group_row(group: Group, hardest: NDArray[np.bool_], oracle: Sequence[int]) -> Row:
    """Return the figures of an actor: means over its seeds."""
    best = [_best(tests) for tests in group.tests]
    in_hardest = [max(test.scores[hardest].sum() for test in tests) for tests in group.tests]
    ratios = [ratio for test in best if (ratio := test.ratio(oracle)) is not None]
    paper = TABLE_1.get(_actor(group.runs[0]), (None, None))
    return {
        "actor": group.name,
        "seeds": len(group.runs),
        "best_score_hardest_room": float(np.mean(in_hardest)),
        "paper_score_env3": paper[0],
        "best_score": float(np.mean([test.scores.sum() for test in best])),
        "paper_score_env0_3": paper[1],
        "tasks": len(oracle),
        "seeds_with_all_tasks": sum(test.reached == len(oracle) for test in best),
        "last_reached": float(np.mean([_last_reached(tests) for tests in group.tests])),
        "best_steps_to_oracle": float(np.mean(ratios)) if ratios else None,
    }


def _last_reached(tests: Sequence[RoomTest]) -> float:
    """Return the mean number of tasks of the last tests that reached their goal."""
    return float(np.mean([test.reached for test in tests[-_LAST:]]))


def _run_row(
    name: str, run: TrainingRun, tests: Sequence[RoomTest], drives: Drives, oracle: Sequence[int]
) -> Row:
    """Return the figures of a run.

    Args:
        name: Name of the actor.
        run: Run.
        tests: Tests of the run.
        drives: Drives of its chosen policy.
        oracle: Fewest steps of each task.
    """
    best, total = _best(tests), len(oracle)
    ends = [drive for some in drives.values() for drive in some]
    steps = tuple(end.detail.steps if end.outcome is Outcome.GOAL else None for end in ends)
    chosen = RoomTest(run.history[-1]["steps"], steps)
    return {
        "actor": name,
        "seed": run.seed,
        "tests": len(tests),
        "first_steps_with_all_tasks": next((t.steps for t in tests if t.reached == total), None),
        "best_reached": best.reached,
        "best_score": float(best.scores.sum()),
        "best_steps_to_oracle": best.ratio(oracle),
        "last_reached": _last_reached(tests),
        "chosen_reached": chosen.reached,
        "chosen_score": float(chosen.scores.sum()),
        "chosen_steps_to_oracle": chosen.ratio(oracle),
    }


def _chosen_drives(run: TrainingRun) -> Drives:
    """Return the drives of a run's chosen policy on the fixed tasks, by room."""
    task, policy = run.environment(SpnConfig), run.policy(run.stages[-1].name)
    found = {}
    for name in task.rooms:
        one = task.unseen.model_copy(update={"rooms": (name,)})
        found[name] = drive_tasks(policy, one, make_room(name).tasks)
    return found
