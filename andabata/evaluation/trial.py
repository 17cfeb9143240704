"""One trial: a robot is put down and visits its goals in a row until one drive fails."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobot
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.sensor_readings import SensorReadings, VehicleState
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from worlds.world import Task, World, jittered

SAFE_CLEARANCE = 0.35
"""Clearance of the shortest safe path from forbidden ground [m]: half the body and a little."""


@dataclass(frozen=True)
class GoalAttempt:
    """A drive to one goal, measured by physics and the true map.

    Attributes:
        goal: Index of the goal, from 1.
        outcome: Outcome.
        time: Duration [s].
        distance: Distance driven [m].
        shortest: Length of the shortest safe path [m].
        forbidden_distance: Distance driven where the true map forbids it [m].
        steering_variation: Integral of the squared yaw rate [rad2/s].
        energy: Work of the motors [J]; None where the plant has none.
        min_clearance: Smallest distance from the body's centre to forbidden ground [m].
        path: Positions, one a control step, float64, shape (k, 3).
        contact: Contact of the body at the end: what it touched, and who drove into whom.
    """

    goal: int
    outcome: Outcome
    time: float
    distance: float
    shortest: float
    forbidden_distance: float
    steering_variation: float
    energy: float | None
    min_clearance: float
    path: NDArray[np.float64]
    contact: Contact = Contact.NONE

    @property
    def spl(self) -> float:
        """Success weighted by path length (Anderson et al. 2018), from 0 to 1."""
        if self.outcome is not Outcome.GOAL:
            return 0.0
        return self.shortest / max(self.shortest, self.distance, 1e-9)


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
) -> tuple[GoalAttempt, ...]:
    """Drive a task's goals in a row with the robot's own controller.

    Args:
        simulated_robot: Robot with a controller.
        task: Start and goals.
        terminations: Rules of each drive.
        rng: Source of the start's jitter and of all noise.
        on_step: Function that is called with the readings after each control step.
        operator: Person who takes part; None for none.

    Returns:
        One attempt for each goal that was tried; the last may have failed.
    """
    world = simulated_robot.scene.world
    start = jittered(task.start, rng)
    readings = simulated_robot.place(start, np.array(task.goals[0]), rng)
    attempts: list[GoalAttempt] = []
    for number, goal in enumerate(task.goals, start=1):
        monitor = EpisodeMonitor(world, terminations)
        state = _truth(readings)
        monitor.begin(state, np.array(goal))
        simulated_robot.navigator.set_goal(np.array(goal))
        shortest = safe_length(world, state.pose.position[:2], goal, terminations.goal_radius)
        outcome: Outcome | None = None
        while outcome is None:
            if operator is not None:
                shortest = _attended(operator, simulated_robot, monitor, readings, shortest)
            readings = simulated_robot.step(readings)
            outcome = monitor.update(_truth(readings))
            if on_step is not None:
                on_step(readings)
        attempts.append(_attempt(number, outcome, shortest, monitor))
        if outcome is not Outcome.GOAL:
            break
    return tuple(attempts)


def _attended(
    operator: Operator,
    simulated_robot: SimulatedRobot,
    monitor: EpisodeMonitor,
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
    if path is None:
        path = np.array([start, goal])
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return max(length - goal_radius, 0.0)


def _attempt(
    number: int, outcome: Outcome, shortest: float, monitor: EpisodeMonitor
) -> GoalAttempt:
    """Return what the monitor measured."""
    return GoalAttempt(
        goal=number,
        outcome=outcome,
        time=monitor.time,
        distance=monitor.distance,
        shortest=shortest,
        forbidden_distance=monitor.forbidden_distance,
        steering_variation=monitor.steering_variation,
        energy=monitor.energy,
        min_clearance=monitor.min_clearance,
        path=np.array(monitor.path),
        contact=monitor.contact,
    )
