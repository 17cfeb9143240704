"""One drive, from a world's name to a path."""

import errno
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.drive_trace import DriveTrace
from andabata.evaluation.estimate_error import EstimateError
from andabata.evaluation.trial import (
    HARMS,
    OffroadAttempt,
    Operator,
    run_trial,
    strict_row,
    walker_row,
)
from andabata.machine.sensor_readings import SensorReadings
from andabata.models import Models
from andabata.navigation.fault_watch import FaultWatch, response_as_dict
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.records.bag_writers import MessageWriter, open_writer
from andabata.records.manifest import write_manifest
from andabata.records.messages import MessageBuilder
from andabata.records.planner_recorder import PlannerRecorder
from andabata.records.recorder import MessageQueue, Recorder
from andabata.runs import atomic_io
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from traversability.cloud import PointCloud
from worlds.goals import task_to
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world
from worlds.world import Task, World, choose_task

_RADIUS, _HEIGHT = 3, 4
"""Columns of a walker after x, y, z."""


@dataclass(frozen=True)
class Driven:
    """A finished drive.

    Attributes:
        world: World.
        task: Start and goals.
        controller: Name of the controller.
        attempts: Drives to the goals that were tried.
        cloud: Last levelled cloud around the robot, None with the horizontal scanner.
        walkers: Rows of the world's walkers at each second, as in ``SensorReadings``, float64,
            shape (k, m, 5); m is 0 without any.
        trace: Motion and error of the pose over time, see ``DriveTrace``, or None.
        estimate: Error of the robot's own estimate, see ``EstimateError``, or None.
        faults: Faults of the robot's senses and its response to them, see ``response_as_dict``, or
            None.
    """

    world: World
    task: Task
    controller: str
    attempts: tuple[OffroadAttempt, ...]
    cloud: PointCloud | None
    walkers: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0, 5)))
    trace: dict[str, Any] | None = None
    estimate: dict[str, Any] | None = None
    faults: dict[str, Any] | None = None

    @property
    def path(self) -> NDArray[np.float64]:
        """All positions [m], shape (k, 3)."""
        return np.concatenate([attempt.path for attempt in self.attempts])

    @property
    def title(self) -> str:
        """One line about it."""
        reached = sum(attempt.outcome is Outcome.GOAL for attempt in self.attempts)
        return (
            f"{self.controller} in {self.world.name} {self.world.seed}: {reached} of "
            f"{len(self.task.goals)} goals"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the drive, ready for JSON."""
        return {
            "controller": self.controller,
            "world": self.world.name,
            "world_seed": self.world.seed,
            "goals": [list(goal) for goal in self.task.goals],
            "success": self.attempts[-1].outcome is Outcome.GOAL
            and len(self.attempts) == len(self.task.goals),
            "attempts": [
                {
                    "goal": attempt.detail.goal,
                    "outcome": str(attempt.outcome),
                    "contact": attempt.contact.label,
                    "time_s": attempt.time,
                    "distance_m": attempt.distance,
                    "shortest_m": attempt.shortest,
                    "spl": attempt.spl,
                    "trespass_m": attempt.detail.forbidden_distance,
                    "min_clearance_m": attempt.detail.min_clearance,
                    "arrival_error_m": attempt.detail.arrival_error,
                    "position_error_m": attempt.detail.position_error,
                    "overridden_share": attempt.detail.overridden,
                    **strict_row(attempt),
                    **walker_row(attempt),
                }
                for attempt in self.attempts
            ],
            "path": np.round(self.path, 3).tolist(),
            "walkers": self._walkers(),
            "trace": self.trace,
            "estimate": self.estimate,
            "faults": self.faults,
        }

    def _walkers(self) -> list[dict[str, Any]]:
        """Return kind, size and path of each walker, ready for JSON."""
        walkers = []
        for mover, rows in zip(self.world.movers, np.moveaxis(self.walkers, 1, 0), strict=False):
            seconds = np.flatnonzero(rows[:, _RADIUS] > 0.0)
            if len(seconds):
                places = np.column_stack([seconds, rows[seconds, :3]])
                size: dict[str, Any] = {"kind": mover.kind}
                size |= {"radius_m": rows[:, _RADIUS].max(), "height_m": rows[0, _HEIGHT]}
                walkers.append(size | {"stamped_path": np.round(places, 2).tolist()})
        return walkers


@dataclass(frozen=True)
class Recording:
    """Destination of a recording.

    Attributes:
        path: New file: .bag, .mcap or .db3.
        clouds: True to record the clouds too, nearly all of the bytes.
        local_map: True to record the local map, the plan and the heading error too.
    """

    path: Path
    clouds: bool = True
    local_map: bool = True

    def watch(self, simulated_robot: SimulatedRobot, setup: dict[str, Any]) -> MessageWriter:
        """Record every step of a robot's navigator; the writer has to be closed at the end.

        Raises:
            BagError: If the file is there already.
        """
        writer = open_writer(self.path)
        outbox = MessageQueue(writer, MessageBuilder(writer.ros))
        localizer, perception = simulated_robot.localizer, simulated_robot.perception
        bearings, planner = simulated_robot.config.grid.bearings, None
        if self.local_map:
            planner = PlannerRecorder(localizer, perception, simulated_robot.navigator.planner)
        assembler = assembler_of(perception)
        recorder = Recorder(outbox, localizer, assembler, bearings, self.clouds, planner)

        def record(result: StepResult) -> None:
            if simulated_robot.navigator.start is not None and not recorder.has_begun:
                recorder.begin(
                    *simulated_robot.navigator.start,
                    setup | {"geofence": simulated_robot.navigator.geofence},
                )
            recorder.record(result)

        simulated_robot.navigator.observers.append(record)
        return writer


def drive_once(
    world: str,
    seed: int,
    controller: str,
    config: SimulatedRobotConfig,
    models: Models | None = None,
    on_second: Callable[[], None] | None = None,
    record: Recording | None = None,
    time_limit: float = 300.0,
    on_robot: Callable[[SimulatedRobot], None] | None = None,
    goals: Sequence[tuple[float, float]] = (),
    operator: Operator | None = None,
) -> Driven:
    """Visit the goals of a world's first task, or given ones, from its start.

    Args:
        world: World preset.
        seed: Seed of the drive; its world is one of those that nothing trains on.
        controller: Name of the controller.
        config: Robot.
        models: Classifiers and policy; None for the shipped ones.
        on_second: Function that is called after each simulated second.
        record: Destination of a recording, or None.
        time_limit: Longest drive to each goal [s].
        on_robot: Function that is called with the robot before it drives, to add observers.
        goals: Map coordinates (x, y) of goals [m] instead of the task's; none for the task's.
        operator: Person who takes part in the drive, or None.

    Raises:
        GoalError: If no safe path leads to one of the given goals.
        BagError: If the recording cannot be begun.
    """
    scene, models = SceneCache(1).get(world, evaluation_world(seed, 0)), models or Models()
    task = _task(scene.world, goals)
    steering = make_steering(controller, scene.world, config, models)
    robot = SimulatedRobot(scene, config, models, steering, far_sighted=record is not None)
    if on_robot is not None:
        on_robot(robot)
    watcher = _DriveWatcher(robot, on_second)
    rules, rng = TerminationConfig(time_limit=time_limit), np.random.default_rng([seed, 0, 1])
    with _recording(record, robot, models, _identity(world, seed, controller)):
        attempts = run_trial(robot, task, rules, rng, watcher.on_step, operator)
    cloud = robot.last_cloud()
    robot.close()
    walkers, trace, estimate = watcher.walkers, watcher.trace.as_dict(), watcher.error.as_dict()
    faults = watcher.fault_response(attempts[-1].outcome in HARMS)
    return Driven(scene.world, task, controller, attempts, cloud, walkers, trace, estimate, faults)


def _task(world: World, goals: Sequence[tuple[float, float]]) -> Task:
    """Return a world's first task, or one with given goals from the same start."""
    task = choose_task(world.tasks, 0)
    return task_to(world.truth, task.start, goals) if goals else task


def _identity(world: str, seed: int, controller: str) -> dict[str, Any]:
    """Return what names a drive in its recording and in its manifest."""
    return {"world": world, "seed": seed, "controller": controller}


@contextmanager
def _recording(
    record: Recording | None,
    simulated_robot: SimulatedRobot,
    models: Models,
    identity: dict[str, Any],
) -> Iterator[None]:
    """Record what is driven in the block, if anything is to be recorded.

    A drive that fails leaves a recording that is closed, and no manifest.

    Raises:
        BagError: If the file is there already.
        OSError: If it cannot be written, or the disk is full.
    """
    if record is None:
        yield
        return
    settings = simulated_robot.config.model_dump(mode="json")
    setup = identity | {"simulated_robot": settings, "models": models.hashes}
    with _explained_recording(record.path):
        writer = record.watch(simulated_robot, setup)
        try:
            yield
        finally:
            writer.close()
        write_manifest(record.path, identity)


@contextmanager
def _explained_recording(path: Path) -> Iterator[None]:
    """Let errors of a full disk and of a read-only folder say what is missing, sqlite3's too."""
    with atomic_io.explained(path, "the recording"):
        try:
            yield
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_FULL:
                raise OSError(errno.ENOSPC, str(error), str(path)) from error
            raise


class _DriveWatcher:
    """Keeps what a finished drive shows: walkers at each second, trace, error of the estimate.

    Attributes:
        trace: Motion and error of the pose over time.
        error: Error of the robot's own estimate.
    """

    def __init__(
        self, simulated_robot: SimulatedRobot, on_second: Callable[[], None] | None
    ) -> None:
        """Watch a robot in a world that it has just entered.

        Args:
            simulated_robot: Robot.
            on_second: Function that is called after each simulated second.
        """
        walkers = simulated_robot.simulator.walkers
        self.trace = DriveTrace(simulated_robot.localizer)
        self.error = EstimateError(simulated_robot.localizer)
        simulated_robot.navigator.spectators.append(self._on_decision)
        self._faults = simulated_robot.config.faults
        self._watch = FaultWatch.of(
            self._faults, simulated_robot.localizer, simulated_robot.config.robot
        )
        self._end = 0.0
        self._rows = [] if walkers is None else [walkers.track.now]
        self._on_second = on_second

    @property
    def walkers(self) -> NDArray[np.float64]:
        """Rows as in ``SensorReadings``, shape (t, m, 5); (0, 0, 5) without walkers."""
        return np.array(self._rows) if self._rows else np.zeros((0, 0, 5))

    def _on_decision(self, result: StepResult) -> None:
        """Compare the estimate with the truth of the readings that it is made of."""
        self.trace.add(result.readings)
        self.error.add(result.readings)
        if self._faults:
            self._watch(result)

    def fault_response(self, has_contact: bool) -> dict[str, Any] | None:
        """Return the faults and the response to them, ready for JSON; None without faults.

        Args:
            has_contact: True if the drive has ended with a contact or a tip-over.
        """
        if not self._faults:
            return None
        return response_as_dict(self._faults, self._watch.response(has_contact, self._end))

    def on_step(self, readings: SensorReadings) -> None:
        """Take in the readings of a control step, which the navigator has not seen yet."""
        self._end = readings.stamp
        # Control steps are tenths of a second, whose sums are not exact.
        if round(readings.stamp * 10) % 10:
            return
        if readings.walkers is not None:
            self._rows.append(readings.walkers)
        if self._on_second is not None:
            self._on_second()
