"""Simulated robot as a node of a live graph, in the graph's time."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.trial_monitor import TrialMonitor, arrival_tolerance
from andabata.machine.fault_injector import FaultInjector
from andabata.machine.sensor_readings import SensorReadings, VehicleState, WheelSpeeds
from andabata.machine.simulator import Simulator
from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder, pose_of, wheel_speeds_of
from andabata.records.recorder import MessageQueue, queue_readings
from andabata.records.topics import Ros, RosMessage, Topic
from andabata.ros.graph import Graph
from andabata.tasks.terminations import Outcome, TerminationConfig
from worlds.scenes import Scene
from worlds.world import Task

_STANDSTILL = WheelSpeeds(0.0, 0.0)

_COMMAND_TIMEOUT_NS = NS // 2
"""Age from which a command no longer counts [ns]."""

_LEAD_NS = NS // 10
"""Time from the graph's present to the simulation's zero [ns]: a period has to be computed."""

_PERIODS_PER_SECOND = 10

_STATIC: dict[Ros, tuple[Topic, ...]] = {1: (), 2: (topics.TF_STATIC,)}
"""Topic of the robot's own transforms by version of ROS: the paper's graph has none."""


class RobotNode:
    """Simulated robot that publishes its readings in real time and follows wheel commands.

    It announces the next goal when the navigator declares the one before reached, by the rules of
    trials.
    """

    def __init__(self, graph: Graph, scene: Scene, config: SimulatedRobotConfig) -> None:
        """Subscribe to wheel commands and advertise start and goals.

        Args:
            graph: Graph to publish to and to receive from.
            scene: World to drive in.
            config: Configuration of the robot.
        """
        self._graph, self._scene, self._config = graph, scene, config
        self._command = (_STANDSTILL, 0)
        self._reached: NDArray[np.float64] | None = None
        graph.subscribe(topics.WHEEL_COMMAND, self._take_command)
        graph.subscribe(topics.GOAL_REACHED, self._take_arrival)
        # Latched: a navigator that starts later gets them, too.
        for topic in (topics.INITIAL_POSE, topics.GOAL, *_STATIC[graph.ros]):
            graph.advertise(topic, latch=True)

    def _take_command(self, _: Topic, message: RosMessage) -> None:
        """Store commanded wheel speeds; those that are not finite are ignored."""
        wheels = wheel_speeds_of(message)
        if np.isfinite([wheels.left, wheels.right]).all():
            self._command = (wheels, self._graph.now_ns())

    def _take_arrival(self, _: Topic, message: RosMessage) -> None:
        """Store the goal that the navigator declares reached."""
        self._reached = pose_of(message.pose).position[:2]

    def _has_arrived(self, goal: NDArray[np.float64]) -> bool:
        """Return True if the navigator has declared a goal reached; one before does not count."""
        reached = self._reached
        return reached is not None and bool(np.allclose(reached, goal))

    def run(
        self,
        task: Task,
        rng: np.random.Generator,
        terminations: TerminationConfig,
        on_second: Callable[[], None] | None = None,
    ) -> dict[str, Any]:
        """Drive through a task in the graph's time.

        Args:
            task: Start and goals.
            rng: Generator of all noise.
            terminations: Rules that end the attempt at a goal.
            on_second: Function called after each second.

        Returns:
            Result, ready for JSON.
        """
        self._begin(task, rng)
        config, world = self._config, self._scene.world
        monitor = TrialMonitor(world, config.robot, terminations, arrival_tolerance(config))
        outcomes: list[str] = []
        for goal in map(np.array, task.goals):
            state = _true_state(self._readings)
            monitor.begin(state, goal)
            self._announce(state, goal, is_first=not outcomes)
            outcome = self._attempt(monitor, goal, on_second)
            outcomes.append(str(outcome) if outcome else "interrupted")
            if outcome is not Outcome.GOAL:
                break
        self._simulator.close()
        seconds = self._readings.stamp
        behind = (self._graph.now_ns() - self._builder.stamp_ns(seconds)) / NS
        return {"outcomes": outcomes, "simulated_s": seconds, "behind_s": behind}

    def _begin(self, task: Task, rng: np.random.Generator) -> None:
        """Put the robot at the start of a task."""
        graph, scene, config = self._graph, self._scene, self._config
        graph.wait_for_clock()
        self._simulator = Simulator(
            scene.world, scene.rays, config.robot, config.plant, config.sensing, rng
        )
        constants = config.reality.draw(rng.spawn(1)[0])
        self._injector = FaultInjector(config.faults, rng.spawn(1)[0])
        self._readings = self._simulator.reset(task.start, constants)
        self._builder = MessageBuilder(graph.ros, graph.now_ns() + _LEAD_NS)
        self._queue = MessageQueue(_PacedWriter(graph), self._builder)

    def _announce(self, state: VehicleState, goal: NDArray[np.float64], is_first: bool) -> None:
        """Publish a goal, and the initial pose with the first one."""
        stamp = self._readings.stamp
        graph, now_ns = self._graph, self._graph.now_ns()
        graph.write(topics.GOAL, now_ns, self._builder.goal(stamp, goal))
        if is_first:
            message = self._builder.stamped_pose(stamp, state.pose)
            graph.write(topics.INITIAL_POSE, now_ns, message)
            for topic in _STATIC[graph.ros]:
                graph.write(topic, now_ns, self._base_transform(topic))

    def _base_transform(self, topic: Topic) -> RosMessage:
        """Return ``base_footprint -> base_link``: both are on the ground."""
        builder, frames = self._builder, ("base_footprint", "base_link")
        row = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        stamped = builder.stamped_transform(self._readings.stamp, frames, row)
        return builder.new(topic.type_name(builder.ros), transforms=[stamped])

    def _attempt(
        self,
        monitor: TrialMonitor,
        goal: NDArray[np.float64],
        on_second: Callable[[], None] | None,
    ) -> Outcome | None:
        """Drive to one goal; return the outcome, None if the graph shuts down before."""
        outcome: Outcome | None = None
        while outcome is None and not self._graph.is_shutdown:
            self._readings = self._simulator.step(self._commanded_wheels())
            queue_readings(self._queue, self._injector(self._readings))
            self._queue.flush()
            outcome = monitor.judge(_true_state(self._readings), self._has_arrived(goal))
            period = round(self._readings.stamp * _PERIODS_PER_SECOND)
            if on_second is not None and period % _PERIODS_PER_SECOND == 0:
                on_second()
        return outcome

    def _commanded_wheels(self) -> WheelSpeeds:
        """Return the last command; a standstill if it is older than ``_COMMAND_TIMEOUT_NS``."""
        wheels, stamp_ns = self._command
        is_fresh = self._graph.now_ns() - stamp_ns < _COMMAND_TIMEOUT_NS
        return wheels if is_fresh else _STANDSTILL


class _PacedWriter:
    """Writer that publishes each message at the time of its stamp."""

    def __init__(self, graph: Graph) -> None:
        self._graph, self.ros = graph, graph.ros

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Wait for the message's time and publish it."""
        self._graph.sleep_until(stamp_ns)
        self._graph.write(topic, stamp_ns, message)

    def close(self) -> None:
        """Leave the graph."""
        self._graph.close()


def _true_state(readings: SensorReadings) -> VehicleState:
    """Return the simulator's true state.

    Raises:
        ValueError: If the readings hold none.
    """
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none; use a simulator")
    return readings.truth
