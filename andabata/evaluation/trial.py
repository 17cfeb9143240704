"""One trial: a robot is put down and visits its goals in a row until one drive fails."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import Rig
from andabata.machine.sensor_readings import Senses
from andabata.tasks.episode_monitor import Judge, JudgeConfig, Outcome
from worlds.world import Task, World, jittered

SAFE_CLEARANCE = 0.35
"""Room that the shortest safe path keeps from forbidden ground [m]: half the body and a little."""


@dataclass(frozen=True)
class Leg:
    """A drive to one goal, as judged by physics and the true map.

    Attributes:
        goal: Index of the goal, from 1.
        outcome: How it ended.
        time: Duration [s].
        distance: Metres driven.
        shortest: Length of the shortest safe path [m].
        trespass: Metres driven where the true map forbids it.
        restlessness: Integral of the squared yaw rate [rad2/s].
        energy: What the motors gave [J]; None where the plant has none.
        min_clearance: Smallest distance from the body's centre to forbidden ground [m].
        path: Positions, one a control step, float64, shape (k, 3).
    """

    goal: int
    outcome: Outcome
    time: float
    distance: float
    shortest: float
    trespass: float
    restlessness: float
    energy: float | None
    min_clearance: float
    path: NDArray[np.float64]

    @property
    def spl(self) -> float:
        """Success weighted by path length (Anderson et al. 2018), from 0 to 1."""
        if self.outcome is not Outcome.GOAL:
            return 0.0
        return self.shortest / max(self.shortest, self.distance, 1e-9)


def run_trial(
    rig: Rig,
    task: Task,
    judge_config: JudgeConfig,
    rng: np.random.Generator,
    on_step: Callable[[Senses], None] | None = None,
) -> tuple[Leg, ...]:
    """Drive a task's goals in a row with the rig's own controller.

    Args:
        rig: The robot, with a controller.
        task: Start and goals.
        judge_config: Rules of each drive.
        rng: Start jitter and every noise.
        on_step: Called with the senses after each control step.

    Returns:
        One leg for each goal that was tried; the last may have failed.
    """
    world = rig.scene.world
    start = jittered(task.start, rng)
    senses = rig.place(start, np.array(task.goals[0]), rng)
    legs: list[Leg] = []
    for number, goal in enumerate(task.goals, start=1):
        judge = Judge(world, judge_config)
        state = senses.truth
        if state is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        judge.begin(state, np.array(goal))
        rig.navigator.set_goal(np.array(goal))
        shortest = safe_length(world, state.pose.position[:2], goal, judge_config.goal_radius)
        outcome: Outcome | None = None
        while outcome is None:
            senses = rig.simulator.step(rig.navigator.step(senses))
            if senses.truth is None:
                raise ValueError("truth: expected the simulator's true state, got none")
            outcome = judge.watch(senses.truth)
            if on_step is not None:
                on_step(senses)
        legs.append(_leg(number, outcome, shortest, judge))
        if outcome is not Outcome.GOAL:
            break
    return tuple(legs)


def safe_length(
    world: World, start: NDArray[np.float64], goal: tuple[float, float], goal_radius: float
) -> float:
    """Return the length of the shortest safe path to ``goal_radius`` [m] from the goal [m]."""
    path = world.truth.shortest_path(start, np.array(goal), SAFE_CLEARANCE)
    if path is None:
        path = np.array([start, goal])
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return max(length - goal_radius, 0.0)


def _leg(number: int, outcome: Outcome, shortest: float, judge: Judge) -> Leg:
    """Return what the judge measured."""
    return Leg(
        goal=number,
        outcome=outcome,
        time=judge.time,
        distance=judge.distance,
        shortest=shortest,
        trespass=judge.trespass,
        restlessness=judge.restlessness,
        energy=judge.energy,
        min_clearance=judge.min_clearance,
        path=np.array(judge.path),
    )
