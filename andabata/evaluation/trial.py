"""One trial: a robot is put down and visits its goals in a row until one drive fails.

The robot itself declares a goal reached, from its own estimate, and gets the next one after that
word; the true state says whether the word is right.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.evaluation.attempt import Attempt
from andabata.evaluation.failure_cause import failure_cause, touched_kind
from andabata.evaluation.strict_verdict import StrictMeasures
from andabata.evaluation.trial_monitor import TrialMonitor, arrival_tolerance
from andabata.machine.sensor_readings import SensorReadings, VehicleState
from andabata.navigation.fault_watch import FaultResponse
from andabata.navigation.navigator import StepResult
from andabata.tasks.terminations import Outcome, TerminationConfig
from worlds.world import Task, World, jittered

SAFE_CLEARANCE = 0.35
"""Clearance of the shortest safe path from forbidden ground [m]: half the body and a little."""

NEAR_RANGE = "near range"
"""Cause of a collision by ``TerminationConfig.collision_range`` in which nothing was touched."""

HARMS = (Outcome.COLLISION, Outcome.TIPOVER)
"""Ends of a drive by a contact or a tip-over."""


@dataclass(frozen=True)
class OffroadMeasures:
    """Measures of a drive to one goal off-road, by physics and the true map.

    Attributes:
        goal: Index of the goal, from 1.
        goals: Number of goals of the task.
        goal_place: Map coordinates of the goal [m].
        end: Map coordinates of the robot at the end [m].
        world_seed: Seed of the world.
        difficulty: Difficulty of the world, from 0 to 1, or None.
        cause: Cause of a failure; see ``failure_cause``.
        forbidden_distance: Distance driven where the true map forbids it [m].
        steering_variation: Integral of the squared yaw rate [rad2/s].
        energy: Work of the motors [J]; None where the plant has none.
        min_clearance: Smallest distance from the body's centre to forbidden ground [m].
        arrival_error: True distance to the goal when the robot declared it reached [m]; None
            without such a word.
        position_error: Error of the estimated position at the end [m]; None in records of earlier
            versions.
        strict: Measures of the strict verdict; None in records of earlier versions.
        overridden: Share of the controller's decisions that the planner turned elsewhere; None
            without a decision, and in records of earlier versions.
        walker: Kind of the walker that was touched at the end, see ``touched_kind``; else empty.
        response: Response of the robot to faults over the whole trial, with the last goal that was
            tried; else None.
    """

    goal: int
    goals: int
    goal_place: tuple[float, float]
    end: tuple[float, float]
    world_seed: int
    difficulty: float | None
    cause: str
    forbidden_distance: float
    steering_variation: float
    energy: float | None
    min_clearance: float
    arrival_error: float | None = None
    position_error: float | None = None
    strict: StrictMeasures | None = None
    overridden: float | None = None
    response: FaultResponse | None = None
    walker: str = ""


OffroadAttempt = Attempt[OffroadMeasures]
"""Drive to one goal off-road."""


def walker_row(attempt: OffroadAttempt) -> dict[str, Any]:
    """Return the kind of the walker that was touched, ready for JSON; nothing without any."""
    return {"walker": attempt.detail.walker} if attempt.detail.walker else {}


def is_strict_success(attempt: OffroadAttempt) -> bool | None:
    """Return True for a goal that was reached with a clean outline; None where it is not known."""
    strict = attempt.detail.strict
    return None if strict is None else attempt.is_success and not strict.failure


def strict_row(attempt: OffroadAttempt) -> dict[str, Any]:
    """Return the strict verdict on an attempt and what it rests on, ready for JSON."""
    strict = attempt.detail.strict
    return {
        "strict": is_strict_success(attempt),
        "strict_failure": None if strict is None else strict.failure,
        "outline_forbidden_s": None if strict is None else strict.forbidden_time,
        "solid_distance_m": None if strict is None else strict.solid_distance,
    }


class _Decisions:
    """Counts the decisions of a controller on the way to a goal, and those that were overridden."""

    def __init__(self) -> None:
        """Begin at none."""
        self._count = self._overridden = 0

    def __call__(self, step: StepResult) -> None:
        """Watch a control step."""
        if step.is_overridden is not None:
            self._count += 1
            self._overridden += step.is_overridden

    @property
    def overridden(self) -> float | None:
        """Share of them that were overridden, None without any."""
        return self._overridden / self._count if self._count else None


class Operator(Protocol):
    """Person who takes part in a trial: waits, changes the steering, names another goal."""

    def attend(self) -> NDArray[np.float64] | None:
        """Take part before a control step.

        It may wait, and hand the navigator over to another controller.

        Returns:
            Another goal in the map for the rest of the attempt [m], shape (2,); None to go on.
        """

    @property
    def is_driving(self) -> bool:
        """True while the robot is driven by hand and may stand for as long as it likes."""


def run_trial(
    simulated_robot: SimulatedRobot,
    task: Task,
    terminations: TerminationConfig,
    rng: np.random.Generator,
    on_step: Callable[[SensorReadings], None] | None = None,
    operator: Operator | None = None,
    contender: str = "",
    repetition: int = 0,
    tolerance: float | None = None,
) -> tuple[OffroadAttempt, ...]:
    """Drive a task's goals in a row with the robot's own controller.

    Each drive is over when the robot says so, or when it fails. A word that is given farther from
    the goal than its radius and the tolerance is a false arrival.

    Args:
        simulated_robot: Robot with a controller.
        task: Start and goals.
        terminations: Rules of each drive.
        rng: Source of the start's jitter and of all noise.
        on_step: Function that is called with the readings after each control step.
        operator: Person who takes part, or None.
        contender: Name of what drives, for comparisons.
        repetition: Number of the trial in its comparison.
        tolerance: Distance beyond the goal's radius that is forgiven [m]; None for that of the
            robot's receiver, see ``arrival_tolerance``.

    Returns:
        One attempt for each goal that was tried; the last may have failed.
    """
    world = simulated_robot.scene.world
    start = jittered(task.start, rng)
    readings = simulated_robot.place(start, np.array(task.goals[0]), rng)
    measured = partial(_attempt, world, task, contender, repetition)
    config = simulated_robot.config
    forgiven = arrival_tolerance(config) if tolerance is None else tolerance
    monitor = TrialMonitor(world, config.robot, terminations, forgiven, sees_scan=True)
    attempts: list[OffroadAttempt] = []
    for number, goal in enumerate(task.goals, start=1):
        state = _truth(readings)
        monitor.begin(state, np.array(goal))
        simulated_robot.navigator.set_goal(np.array(goal))
        # From where it stands: it has stopped within the radius of the goal before, not at it.
        shortest = safe_length(world, state.pose.position[:2], goal, terminations.goal_radius)
        outcome: Outcome | None = None
        decisions = _Decisions()
        simulated_robot.navigator.spectators.append(decisions)
        while outcome is None:
            if operator is not None:
                shortest = _attended(operator, simulated_robot, monitor, readings, shortest)
            state, readings = _truth(readings), simulated_robot.step(readings)
            navigator = simulated_robot.navigator
            outcome = monitor.judge(_truth(readings), navigator.has_arrived, navigator.perceived)
            if on_step is not None:
                on_step(readings)
        simulated_robot.navigator.spectators.remove(decisions)
        # The estimate is that of the readings before the last step.
        off = simulated_robot.localizer.pose.position - state.pose.position
        error, there = float(np.hypot(*off[:2])), readings.walkers
        attempts.append(measured(number, outcome, shortest, error, monitor, decisions, there))
        # The next goal lies ahead of this one: from where the robot failed it is another task.
        if outcome is not Outcome.GOAL:
            break
    return tuple(attempts)


def _attended(
    operator: Operator,
    simulated_robot: SimulatedRobot,
    monitor: TrialMonitor,
    readings: SensorReadings,
    shortest: float,
) -> float:
    """Let a person take part; return the length of the shortest safe path of the attempt [m].

    With another goal that is the way so far and the shortest one from there.
    """
    goal, state = operator.attend(), _truth(readings)
    if operator.is_driving:
        monitor.excuse_standing(state)
    if goal is None:
        return shortest
    simulated_robot.navigator.set_goal(goal)
    monitor.head_for(goal)
    world, radius = simulated_robot.scene.world, monitor.goal_radius
    place = (float(goal[0]), float(goal[1]))
    return monitor.distance + safe_length(world, state.pose.position[:2], place, radius)


def _truth(readings: SensorReadings) -> VehicleState:
    """Return the true state, which a simulation always gives.

    Raises:
        ValueError: If there is none.
    """
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    return readings.truth


def safe_length(
    world: World, start: NDArray[np.float64], goal: tuple[float, float], goal_radius: float
) -> float:
    """Return the length of the shortest safe path to ``goal_radius`` [m] from the goal [m]."""
    path = world.truth.shortest_path(start, np.array(goal), SAFE_CLEARANCE)
    # No path is shorter than the straight line: a start off the safe ground flatters no SPL.
    if path is None:
        path = np.array([start, goal])
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return max(length - goal_radius, 0.0)


def _attempt(
    world: World,
    task: Task,
    contender: str,
    repetition: int,
    number: int,
    outcome: Outcome,
    shortest: float,
    position_error: float,
    monitor: TrialMonitor,
    decisions: _Decisions,
    walkers: NDArray[np.float64] | None,
) -> OffroadAttempt:
    """Return what the monitor measured on the way to a goal, whose numbers begin at 1."""
    end, contact = monitor.path[-1], monitor.contact
    too_near = outcome is Outcome.COLLISION and monitor.is_too_near
    measures = OffroadMeasures(
        goal=number,
        goals=len(task.goals),
        goal_place=task.goals[number - 1],
        end=(float(end[0]), float(end[1])),
        world_seed=world.seed,
        difficulty=world.difficulty,
        cause=NEAR_RANGE if too_near else failure_cause(world, end, outcome, contact),
        forbidden_distance=monitor.forbidden_distance,
        steering_variation=monitor.steering_variation,
        energy=monitor.energy,
        min_clearance=monitor.min_clearance,
        arrival_error=monitor.arrival_error,
        position_error=position_error,
        strict=monitor.strict,
        overridden=decisions.overridden,
        walker="" if outcome is Outcome.GOAL else touched_kind(world, end, walkers, contact),
    )
    return Attempt(
        contender=contender,
        scenario=world.name,
        repetition=repetition,
        outcome=outcome,
        contact=contact,
        time=monitor.time,
        distance=monitor.distance,
        shortest=shortest,
        detail=measures,
        path=np.array(monitor.path),
    )
