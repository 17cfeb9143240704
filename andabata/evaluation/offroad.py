"""Evaluation off-road: controllers side by side in the same worlds, with the same noise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.assembly.controllers import DEFAULT_CONTROLLER
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.attempt import CONTACTS, Attempt
from andabata.evaluation.comparison import Attempts, DrivenCell
from andabata.evaluation.faulty_trial import watch_arm, with_response
from andabata.evaluation.judging import JUDGED_FORM, checked_seed, refuse_other_form
from andabata.evaluation.perturbation import Arm, arms, with_disturbance
from andabata.evaluation.scenarios import Scenario, scenarios
from andabata.evaluation.strict_verdict import StrictMeasures
from andabata.evaluation.trial import OffroadAttempt, OffroadMeasures, strict_row, walker_row
from andabata.evaluation.trial_monitor import arrival_tolerance
from andabata.machine.faults import FaultSetting
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import Models
from andabata.navigation.fault_watch import FaultResponse
from andabata.own_code import own_digests
from andabata.runs.folder import commit
from andabata.runs.journal import Entry
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan
from worlds.scenes import Scene
from worlds.splits import EVALUATIONS, refuse_judging
from worlds.world import Task, World, choose_task

FAILURES = "failures"
"""Folder of the pictures of failures."""

_PATH_STRIDE = 20
"""Number of control steps between the positions of a path that are kept: 2 s."""

_SHOWN_WALKERS = 50
"""Number of control steps before a failure whose walkers are kept: 5 s."""


class EvaluationConfig(BaseModel):
    """Settings of an evaluation.

    Attributes:
        suite: Name of a suite, which has its own worlds and trials, or None.
        world: World preset.
        world_seed: Seed of the one world that all trials are driven in, such as the one that a
            policy was trained in; None for a world of its own for each trial.
        controllers: Names of the controllers.
        trials: Number of trials of each controller.
        goals: Number of goals in a row that are tried, as far as the world's tasks have them.
        seed: Seed of the whole evaluation; of one that judges that of its release.
        release: Release that is judged, by ``andabata.evaluation.judging``; None to develop.
        simulated_robot: Robot; published results are those of the bullet plant.
        perturb: Disturbances, each of which is driven alone beside the robot as it is: strengths by
            their names in ``simulated_robot.reality``.
        faults: Faults of senses, each of which is driven alone beside the robot as it is; see
            ``andabata.machine.faults``.
        terminations: Rules of each drive.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    suite: str | None = None
    world: str = "natural-test"
    world_seed: int | None = Field(default=None, ge=0)
    controllers: tuple[str, ...] = (DEFAULT_CONTROLLER, "reactive")
    trials: int = Field(default=20, ge=1, le=EVALUATIONS)
    goals: int = Field(default=10, ge=1, le=10)
    seed: int = Field(default=0, ge=0)
    release: str | None = None
    simulated_robot: SimulatedRobotConfig = Field(default_factory=SimulatedRobotConfig)
    perturb: dict[str, float] = Field(default_factory=dict)
    faults: tuple[FaultSetting, ...] = ()
    terminations: TerminationConfig = Field(default_factory=TerminationConfig)

    @model_validator(mode="after")
    def _check_disturbances(self) -> Self:
        """Refuse disturbances that there are not, strengths out of bounds, and faults twice."""
        for name, strength in self.perturb.items():
            try:
                with_disturbance(self.simulated_robot.reality, name, strength)
            except ValueError as error:
                raise ValueError(f"perturb.{error}") from error
        if len(set(self.faults)) < len(self.faults):
            twice = next(each for each in self.faults if self.faults.count(each) > 1)
            raise ValueError(f"faults: expected each fault once, got {twice} twice; leave one out")
        return self

    @model_validator(mode="after")
    def _check_split(self) -> Self:
        """Refuse judging seeds without their release, and a judging table of another form."""
        checked_seed(self.seed, self.release, EVALUATIONS)
        if self.world_seed is not None:
            refuse_judging(self.world_seed)
            if self.suite is not None:
                raise ValueError(
                    f"world_seed: expected none beside the suite {self.suite}, which has worlds of "
                    f"its own, got {self.world_seed}; leave one out"
                )
        if self.release is not None:
            names = ("world", "goals", "trials", "controllers", *JUDGED_FORM)
            given = {name: getattr(self, name) for name in names}
            robot = self.simulated_robot
            given |= {"reality": robot.reality.name, "plant": robot.plant}
            refuse_other_form(self.release, given)
        return self

    @property
    def arms(self) -> tuple[Arm, ...]:
        """What drives in each trial: controllers, and with each disturbance or fault alone."""
        return arms(self.controllers, self.simulated_robot, self.perturb, self.faults)

    @property
    def tolerance(self) -> float:
        """Distance beyond the goal's radius at which a robot may declare it reached [m].

        It is that of the robot without disturbances, for all: a worse receiver is no excuse.
        """
        return arrival_tolerance(self.simulated_robot)

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """Scenario of each trial."""
        own = self.release, self.world_seed
        return scenarios(self.suite, self.world, self.trials, self.seed, *own)


@dataclass(frozen=True)
class Failure:
    """A drive that failed, with what the robot saw at its end.

    Attributes:
        world: World that it was driven in.
        attempt: Measures of the attempt.
        pose: True pose at its end.
        scan: Virtual scan there.
        goal: Goal in the map [m], shape (2,).
        grid: Polar grid of the scan.
        walkers: Rows of the world's walkers in each of the last control steps, as in
            ``SensorReadings``, shape (t, m, 5); (0, 0, 5) in a world without any.
    """

    world: World
    attempt: OffroadAttempt
    pose: Pose
    scan: VirtualScan
    goal: NDArray[np.float64]
    grid: PolarGrid
    walkers: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 5)))


DrawFailure = Callable[[Failure], tuple[str, bytes]]
"""Function that draws a failure and returns the name of the picture's file and its bytes; processes
import it."""


@dataclass(frozen=True)
class OffroadComparison:
    """Controllers off-road; a cell is a trial, whose world every controller drives.

    Attributes:
        config: Settings.
        files: Files of the models; see ``Models.to_bytes``.
        hashes: SHA-256 of the models by name.
        draw_failure: Function that draws failures, None for no pictures.
    """

    unit: ClassVar[str] = "trials"
    journal: ClassVar[str] = "trials.jsonl"

    config: EvaluationConfig
    files: tuple[bytes, bytes, bytes]
    hashes: Mapping[str, Any]
    draw_failure: DrawFailure | None = None

    @classmethod
    def of(
        cls, config: EvaluationConfig, models: Models, draw_failure: DrawFailure | None = None
    ) -> Self:
        """Return the comparison of an evaluation with classifiers and a policy."""
        return cls(config, models.to_bytes(), models.hashes, draw_failure)

    @property
    def about(self) -> Entry:
        """Heading of the journal; an evaluation of more trials goes on with it."""
        config = self.config.model_dump(mode="json", exclude={"trials"})
        about: Entry = {"config": config, "models": self.hashes, "commit": commit()}
        own = own_digests(self.config.controllers)
        return about | ({"own": own} if own else {})

    def cells(self) -> Sequence[int]:
        """Return the numbers of the trials."""
        return range(len(self.config.scenarios))

    def label(self, cell: int) -> str:
        """Return the world of a trial."""
        # A journal may hold more trials than are asked for now.
        known = self.config.scenarios
        return f"world {known[cell].seed}" if cell < len(known) else f"trial {cell}"

    def drive(self, cell: int) -> DrivenCell:
        """Drive every controller through the world of a trial, with pictures of its failures."""
        drawn: dict[str, bytes] = {}

        def draw(failure: Failure) -> None:
            if self.draw_failure is not None:
                name, data = self.draw_failure(failure)
                drawn[f"{FAILURES}/{name}"] = data

        on_failure = draw if self.draw_failure is not None else None
        attempts = drive_trial(self.config, Models.from_bytes(self.files), cell, on_failure)
        return DrivenCell(attempts, drawn)

    def encode(self, cell: int, attempts: Attempts) -> Entry:
        """Return the entry of a trial: its number, and a row of each attempt."""
        return {"trial": cell, "rows": [attempt_row(attempt) for attempt in attempts]}

    def decode(self, entry: Entry) -> tuple[int, Attempts]:
        """Return the trial of an entry and its attempts."""
        return entry["trial"], tuple(attempt_of(row) for row in entry["rows"])


def drive_trial(
    config: EvaluationConfig,
    models: Models,
    trial: int,
    on_failure: Callable[[Failure], None] | None = None,
) -> tuple[OffroadAttempt, ...]:
    """Drive every controller, also with each disturbance, through one trial's world.

    Args:
        config: Settings.
        models: Classifiers and policy.
        trial: Number of the trial.
        on_failure: Function that is called with each failure, or None.

    Returns:
        Attempts to reach the goals that were tried, one controller after the other.
    """
    scene, task = trial_task(config, trial)
    return tuple(
        attempt
        for arm in config.arms
        for attempt in drive_arm(config, models, scene, task, arm, trial, on_failure)
    )


def trial_task(config: EvaluationConfig, trial: int) -> tuple[Scene, Task]:
    """Return the world of a trial and its task, the same for all that drive it.

    Args:
        config: Settings.
        trial: Number of the trial.
    """
    from worlds.scenes import SceneCache

    scenario = config.scenarios[trial]
    scene = SceneCache().get(scenario.world, scenario.seed, scenario.difficulty, config.release)
    task = choose_task(scene.world.tasks, np.random.default_rng([config.seed, trial]))
    # Cut after the draw: fewer goals are the first ones of the same task.
    return scene, replace(task, goals=task.goals[: config.goals])


def drive_arm(
    config: EvaluationConfig,
    models: Models,
    scene: Scene,
    task: Task,
    arm: Arm,
    trial: int,
    on_failure: Callable[[Failure], None] | None = None,
    prepare: Callable[[SimulatedRobot], None] | None = None,
) -> tuple[OffroadAttempt, ...]:
    """Drive one arm through a trial's world.

    Args:
        config: Settings.
        models: Classifiers and policy.
        scene: World of the trial.
        task: Task of the trial.
        arm: Controller and robot.
        trial: Number of the trial.
        on_failure: Function that is called with a failure, or None.
        prepare: Function that changes the robot before it drives, or None.
    """
    from andabata.assembly.controllers import driven_robot, make_steering
    from andabata.evaluation.trial import run_trial

    # The same noise of the world for each controller; a controller's own is another stream.
    noise = np.random.default_rng([config.seed, trial, 2])
    robot = driven_robot(arm.controller, arm.robot)
    steering = make_steering(arm.controller, scene.world, robot, models, noise)
    simulated_robot = SimulatedRobot(scene, robot, models, steering)
    if prepare is not None:
        prepare(simulated_robot)
    watch = watch_arm(arm, simulated_robot, config.faults)
    walkers: list[NDArray[np.float64]] = []
    attempts = run_trial(
        simulated_robot,
        task,
        config.terminations,
        np.random.default_rng([config.seed, trial, 1]),
        partial(_keep_walkers, walkers),
        contender=arm.name,
        repetition=trial,
        tolerance=config.tolerance,
    )
    if watch is not None:
        attempts = with_response(attempts, watch, simulated_robot.simulator.vehicle.state.stamp)
    if on_failure is not None and not attempts[-1].is_success:
        failure = _failure(scene.world, attempts[-1], simulated_robot, walkers)
        if failure is not None:
            on_failure(failure)
    # Bullet keeps a world until its connection is closed.
    simulated_robot.close()
    return attempts


def _failure(
    world: World,
    attempt: OffroadAttempt,
    simulated_robot: SimulatedRobot,
    walkers: Sequence[NDArray[np.float64]],
) -> Failure | None:
    """Return a failure as the robot saw it, None where it saw nothing yet."""
    # Made here: the navigator, whose drive is over, makes no scan of the pose at the end.
    truth = simulated_robot.simulator.vehicle.state
    scan = simulated_robot.perception.scan(truth.stamp, simulated_robot.localizer)
    if scan is None:
        return None
    grid, goal = simulated_robot.config.grid, np.array(attempt.detail.goal_place)
    failure = Failure(world, attempt, truth.pose, scan, goal, grid)
    return replace(failure, walkers=np.array(walkers)) if walkers else failure


def _keep_walkers(kept: list[NDArray[np.float64]], readings: SensorReadings) -> None:
    """Add the walkers of readings to those of the last control steps, where there are any."""
    if readings.walkers is not None:
        kept.append(readings.walkers)
        # A drive of five minutes has 3,000 steps, and the picture shows the last ones.
        del kept[:-_SHOWN_WALKERS]


def attempt_row(attempt: OffroadAttempt) -> Entry:
    """Return the measures of an attempt, ready for JSON; its path is thinned."""
    measures = attempt.detail
    return {
        "controller": attempt.contender,
        "trial": attempt.repetition,
        "world": attempt.scenario,
        "world_seed": measures.world_seed,
        "difficulty": measures.difficulty,
        "goal": measures.goal,
        "goals": measures.goals,
        "outcome": str(attempt.outcome),
        "cause": measures.cause,
        "contact": attempt.contact.label,
        "time_s": attempt.time,
        "distance_m": attempt.distance,
        "spl": attempt.spl,
        "trespass_m": measures.forbidden_distance,
        "steering_variation": measures.steering_variation,
        "energy_j": measures.energy,
        "min_clearance_m": measures.min_clearance,
        "arrival_error_m": measures.arrival_error,
        "position_error_m": measures.position_error,
        "overridden_share": measures.overridden,
        **strict_row(attempt),
        **walker_row(attempt),
        **({} if measures.response is None else {"fault_response": measures.response.as_dict()}),
        "end_xy": list(measures.end),
        "goal_xy": list(measures.goal_place),
        "path": np.round(attempt.path[::_PATH_STRIDE, :2], 2).tolist(),
    }


def _strict_of(row: Mapping[str, Any]) -> StrictMeasures | None:
    """Return the strict measures of a row; None for one of an earlier version."""
    time = row.get("outline_forbidden_s")
    return None if time is None else StrictMeasures(time, row["solid_distance_m"])


def attempt_of(row: Mapping[str, Any]) -> OffroadAttempt:
    """Return the attempt of a row of ``attempt_row``, without its path."""
    measures = OffroadMeasures(
        goal=row["goal"],
        goals=row["goals"],
        goal_place=tuple(row.get("goal_xy", (np.nan, np.nan))),
        end=tuple(row["end_xy"]),
        world_seed=row["world_seed"],
        difficulty=row["difficulty"],
        cause=row["cause"],
        forbidden_distance=row["trespass_m"],
        steering_variation=row["steering_variation"],
        energy=row["energy_j"],
        min_clearance=row["min_clearance_m"],
        # Journals of earlier versions have neither a robot's word nor a strict verdict.
        arrival_error=row.get("arrival_error_m"),
        position_error=row.get("position_error_m"),
        strict=_strict_of(row),
        overridden=row.get("overridden_share"),
        response=FaultResponse.of(row.get("fault_response")),
        walker=row.get("walker", ""),
    )
    return Attempt(
        contender=row["controller"],
        scenario=row["world"],
        repetition=row["trial"],
        outcome=Outcome(row["outcome"]),
        # Journals of earlier versions say nothing about who drove into whom.
        contact=CONTACTS[row.get("contact", "")],
        time=row["time_s"],
        distance=row["distance_m"],
        shortest=shortest_of(row["spl"], row["distance_m"]),
        detail=measures,
    )


def shortest_of(spl: float, distance: float) -> float:
    """Return a shortest path that gives an SPL after a distance, to the bit; NaN for an SPL of 0.

    Rows keep SPL and not the shortest path, and their table must be that of the drives.
    """
    if spl == 0.0:
        return np.nan
    shortest = spl * distance
    near = (shortest, float(np.nextafter(shortest, 0.0)), float(np.nextafter(shortest, np.inf)))
    return next((each for each in near if spl == 1.0 or each / distance == spl), shortest)
