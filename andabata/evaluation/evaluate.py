"""Evaluates controllers side by side: the same worlds, starts and noise for each of them."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.engine import Engine, SerialEngine
from andabata.evaluation.failure_cause import failure_cause
from andabata.evaluation.scenarios import Scenario, scenarios
from andabata.evaluation.trial import GoalAttempt
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import Models
from andabata.runs import atomic_io
from andabata.runs.folder import commit
from andabata.runs.journal import Journal
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan
from worlds.splits import EVALUATIONS
from worlds.world import World, choose_task

Row = dict[str, Any]

_CAUSED_BY_WALKERS = {"hit_by_mover": Contact.HIT, "hit_at_rest": Contact.HIT_AT_REST}
"""Columns of collisions that walkers caused, while the robot drove and while it stood."""

_PATH_STRIDE = 20
"""Number of control steps between the positions of a path that are kept: 2 s."""

_SHOWN_WALKERS = 50
"""Number of control steps before a failure whose walkers are kept: 5 s."""


class EvaluationConfig(BaseModel):
    """Settings of an evaluation.

    Attributes:
        suite: Name of a suite, which has its own worlds and trials, or None.
        world: World preset.
        controllers: Names of the controllers.
        trials: Number of trials of each controller; each has a world of its own.
        goals: Number of goals in a row that are tried, as far as the world's tasks have them.
        seed: Seed of the whole evaluation.
        simulated_robot: Robot; published results are those of the bullet plant.
        terminations: Rules of each drive.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    suite: str | None = None
    world: str = "natural-test"
    controllers: tuple[str, ...] = ("policy+planner", "reactive")
    trials: int = Field(default=20, ge=1, le=EVALUATIONS)
    goals: int = Field(default=10, ge=1, le=10)
    seed: int = Field(default=0, ge=0, lt=EVALUATIONS)
    simulated_robot: SimulatedRobotConfig = Field(default_factory=SimulatedRobotConfig)
    terminations: TerminationConfig = Field(default_factory=TerminationConfig)

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """Scenario of each trial."""
        return scenarios(self.suite, self.world, self.trials, self.seed)


@dataclass(frozen=True)
class Failure:
    """A drive that failed, with what the robot saw at its end.

    Attributes:
        row: Row of the drive in the results.
        world: World that it was driven in.
        attempt: Measures of the attempt.
        pose: True pose at its end.
        scan: Virtual scan there.
        goal: Goal in the map [m], shape (2,).
        grid: Polar grid of the scan.
        walkers: Rows of the world's walkers in each of the last control steps, as in
            ``SensorReadings``, shape (t, m, 5); (0, 0, 5) in a world without any.
    """

    row: Row
    world: World
    attempt: GoalAttempt
    pose: Pose
    scan: VirtualScan
    goal: NDArray[np.float64]
    grid: PolarGrid
    walkers: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 5)))


OnFailure = Callable[[Failure], None]

Picture = tuple[str, bytes]
"""Name of a picture's file, and its bytes."""


def run_one(
    config: EvaluationConfig,
    files: tuple[bytes, bytes, bytes],
    on_failure: OnFailure | None,
    trial: int,
) -> list[Row]:
    """Run every controller through one trial's world.

    Args:
        config: Settings.
        files: Files of the models; see ``Models.to_bytes``.
        on_failure: Function that is called with each failure; None for none.
        trial: Number of the trial.

    Returns:
        One row a goal that was tried: controller, trial, world, outcome and measures.
    """
    from andabata.assembly.controllers import make_steering
    from andabata.evaluation.trial import run_trial
    from worlds.scenes import SceneCache

    models = Models.from_bytes(files)
    scenario = config.scenarios[trial]
    scene = SceneCache().get(scenario.world, scenario.seed, scenario.difficulty)
    pick = np.random.default_rng([config.seed, trial])
    task = choose_task(scene.world.tasks, pick)
    task = replace(task, goals=task.goals[: config.goals])
    rows: list[Row] = []
    for name in config.controllers:
        # The same noise of the world for each controller; a controller's own is another stream.
        noise = np.random.default_rng([config.seed, trial, 2])
        steering = make_steering(name, scene.world, config.simulated_robot, models, noise)
        simulated_robot = SimulatedRobot(scene, config.simulated_robot, models, steering)
        rng = np.random.default_rng([config.seed, trial, 1])
        walkers: list[NDArray[np.float64]] = []
        attempts = run_trial(
            simulated_robot, task, config.terminations, rng, partial(_keep_walkers, walkers)
        )
        rows.extend(
            _attempt_row(attempt, name, trial, scene.world, task.goals) for attempt in attempts
        )
        if on_failure is not None and attempts[-1].outcome is not Outcome.GOAL:
            goal = task.goals[len(attempts) - 1]
            failure = _failure(rows[-1], scene.world, attempts[-1], goal, simulated_robot, walkers)
            if failure is not None:
                on_failure(failure)
        simulated_robot.close()
    return rows


def _failure(
    row: Row,
    world: World,
    attempt: GoalAttempt,
    goal: tuple[float, float],
    simulated_robot: SimulatedRobot,
    walkers: Sequence[NDArray[np.float64]],
) -> Failure | None:
    """Return a failure as the robot saw it, None where it saw nothing yet."""
    truth = simulated_robot.simulator.vehicle.state
    scan = simulated_robot.perception.scan(truth.stamp, simulated_robot.localizer)
    if scan is None:
        return None
    grid = simulated_robot.config.grid
    failure = Failure(row, world, attempt, truth.pose, scan, np.array(goal), grid)
    return replace(failure, walkers=np.array(walkers)) if walkers else failure


def _keep_walkers(kept: list[NDArray[np.float64]], readings: SensorReadings) -> None:
    """Add the walkers of readings to those of the last control steps, where there are any."""
    if readings.walkers is not None:
        kept.append(readings.walkers)
        del kept[:-_SHOWN_WALKERS]


def _attempt_row(
    attempt: GoalAttempt,
    controller: str,
    trial: int,
    world: World,
    goals: Sequence[tuple[float, float]],
) -> Row:
    """Return the measures of one attempt, ready for JSON."""
    return {
        "controller": controller,
        "trial": trial,
        "world": world.name,
        "world_seed": world.seed,
        "difficulty": world.difficulty,
        "goal": attempt.goal,
        "goals": len(goals),
        "outcome": str(attempt.outcome),
        "cause": failure_cause(world, attempt.path[-1], attempt.outcome, attempt.contact),
        "contact": attempt.contact.label,
        "time_s": attempt.time,
        "distance_m": attempt.distance,
        "spl": attempt.spl,
        "trespass_m": attempt.forbidden_distance,
        "steering_variation": attempt.steering_variation,
        "energy_j": attempt.energy,
        "min_clearance_m": attempt.min_clearance,
        "end_xy": attempt.path[-1, :2].tolist(),
        "goal_xy": list(goals[attempt.goal - 1]),
        "path": np.round(attempt.path[::_PATH_STRIDE, :2], 2).tolist(),
    }


def evaluate(
    config: EvaluationConfig,
    models: Models,
    *,
    engine: Engine | None = None,
    journal: Path | None = None,
    pictures: Path | None = None,
    draw_failure: Callable[[Failure], Picture] | None = None,
    on_trial: Callable[[int, list[Row]], None] | None = None,
) -> list[Row]:
    """Run all trials and return one row a goal that was tried, by trial.

    Args:
        config: Settings.
        models: Classifiers and policy.
        engine: Engine that runs the trials, on which the result does not depend; None for this
            process.
        journal: JSON-lines file to which finished trials are appended; trials that stand in it are
            not run again, so that a killed evaluation goes on where it was, by the same code.
        pictures: Folder for the pictures of failures, None for none.
        draw_failure: Function that draws a failure, in the process that ran it: it has to be
            importable.
        on_trial: Function that is called after each trial, at once for those of the journal.

    Raises:
        ValueError: If the journal belongs to another evaluation.
    """
    about = config.model_dump(mode="json", exclude={"trials"})
    origin = {"config": about, "models": models.hashes, "commit": commit()}
    kept = Journal(journal, origin)
    done = {entry["trial"]: entry["rows"] for entry in kept.entries}
    trials = range(len(config.scenarios))
    missing = [trial for trial in trials if trial not in done]
    if on_trial is not None:
        for trial, rows in done.items():
            on_trial(trial, rows)
    work = partial(_run_and_draw, config, models.to_bytes(), draw_failure if pictures else None)
    for _, trial, (rows, drawn) in (engine or SerialEngine()).run(work, missing):
        done[trial] = rows
        if pictures is not None:
            for name, data in drawn:
                atomic_io.write(pictures / name, data)
        kept.append({"trial": trial, "rows": rows})
        if on_trial is not None:
            on_trial(trial, rows)
    return [row for trial in trials for row in done[trial]]


def _run_and_draw(
    config: EvaluationConfig,
    files: tuple[bytes, bytes, bytes],
    draw_failure: Callable[[Failure], Picture] | None,
    trial: int,
) -> tuple[list[Row], list[Picture]]:
    """Return the rows of a trial, and the pictures of its failures: files go with results."""
    if draw_failure is None:
        return run_one(config, files, None, trial), []
    drawn: list[Picture] = []
    rows = run_one(config, files, lambda failure: drawn.append(draw_failure(failure)), trial)
    return rows, drawn


def summarise(rows: Sequence[Row], config: EvaluationConfig) -> list[Row]:
    """Return the table: one row a world, controller and goal, and one for all goals in a row.

    A goal counts as tried in every trial, so that the figures are those of goals in a row
    (Sanchez et al. 2023, Table 4).
    """
    table: list[Row] = []
    for world in dict.fromkeys(row["world"] for row in rows):
        there = [row for row in rows if row["world"] == world]
        goals = max(row["goals"] for row in there)
        for controller in config.controllers:
            mine = [row for row in there if row["controller"] == controller]
            labels: list[int | str] = [*range(1, goals + 1), "all"]
            table.extend(_table_row(mine, world, controller, goals, label) for label in labels)
    return table


def failure_causes(rows: Sequence[Row]) -> list[Row]:
    """Return the failures of each controller by cause: one row a world, outcome and cause."""
    counts = Counter(
        (row["world"], row["controller"], row["outcome"], row["cause"])
        for row in rows
        if row["outcome"] != Outcome.GOAL
    )
    names = ("world", "controller", "outcome", "cause")
    return [dict(zip(names, key, strict=True)) | {"count": n} for key, n in counts.most_common()]


def _table_row(
    rows: Sequence[Row], world: str, controller: str, goals: int, label: int | str
) -> Row:
    """Return one row of the table; ``all`` counts the last goal and all failures."""
    from andabata.evaluation.statistics import wilson_interval

    trials = len({row["trial"] for row in rows})
    goal = goals if label == "all" else label
    attempts = [row for row in rows if label in ("all", row["goal"])]
    reached = sum(row["goal"] == goal and row["outcome"] == Outcome.GOAL for row in rows)
    low, high = wilson_interval(reached, trials)
    tried = trials * (goals if label == "all" else 1)

    def count(outcome: Outcome) -> int:
        return sum(row["outcome"] == outcome for row in attempts)

    def touched(contact: Contact) -> int:
        # Journals of earlier versions say nothing about who drove into whom.
        ends = [row for row in attempts if row["outcome"] == Outcome.COLLISION]
        return sum(row.get("contact") == contact.label for row in ends)

    def mean(key: str) -> float | None:
        known = [row[key] for row in attempts if row[key] is not None]
        return float(np.mean(known)) if known else None

    driven = sum(row["distance_m"] for row in attempts)
    return {
        "controller": controller,
        "world": world,
        "goal": label,
        "trials": trials,
        "successes": reached,
        "collisions": count(Outcome.COLLISION),
        **{key: touched(contact) for key, contact in _CAUSED_BY_WALKERS.items()},
        "tipovers": count(Outcome.TIPOVER),
        "timeouts": count(Outcome.TIMEOUT),
        "stuck": count(Outcome.STUCK),
        "success_rate": reached / trials,
        "wilson_low": low,
        "wilson_high": high,
        "spl": sum(row["spl"] for row in attempts) / tried,
        "trespass_m": mean("trespass_m"),
        "trespass_share": sum(row["trespass_m"] for row in attempts) / driven if driven else None,
        "distance_m": mean("distance_m"),
        "steering_variation": mean("steering_variation"),
        "energy_j": mean("energy_j"),
        "min_clearance_m": mean("min_clearance_m"),
        "mean_time_s": mean("time_s"),
    }
