"""Navigator as one node of a live graph."""

import re
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.navigator import NavigatorParts, make_navigator
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.assembly.warm_up import warm_up
from andabata.localization.localizer import health_after
from andabata.machine.fault_injector import FaultInjector
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import assembler_of
from andabata.records import topics
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.frames.extrinsics import Extrinsics
from andabata.records.frames.sensor_pose import GivenMounting
from andabata.records.messages import NS, MessageBuilder
from andabata.records.planner_recorder import PlannerRecorder
from andabata.records.recorder import MessageQueue, Recorder
from andabata.records.topics import Topic
from andabata.replay.datum import add_fix_remarks
from andabata.replay.mounting_monitor import MountingMonitor
from andabata.ros.datum_initializer import DatumInitializer
from andabata.ros.graph import Graph
from andabata.ros.live_recording import LiveRecording
from andabata.ros.navigator_output import NavigatorOutput, OutputForm
from andabata.ros.path_goals import PathGoals
from andabata.ros.sensor_inbox import SensorInbox
from andabata.ros.startup import StartFinder, wait_for_transforms

_TICK_NS = NS // 20
"""Half a control period [ns]: the relative cloud comes twice in one (paper, Table 3)."""

_TICKS_PER_PERIOD = 2
_TICKS_PER_SECOND = 20

_FAULT_SEED = 0
"""Seed of the garbage of injected faults."""

_FLUSH_TIME = 0.2
"""Time that the last messages have to leave the process [s]."""

_PUBLISHED = (
    topics.TF,
    topics.CLOUD,
    topics.RELATIVE_CLOUD,
    topics.VIRTUAL_SCAN,
    topics.TWIST,
    topics.WHEEL_COMMAND,
    topics.FILTERED_ODOMETRY,
    topics.ESTIMATED_POSE,
    topics.DIAGNOSTICS,
    topics.GOAL_REACHED,
)


_NUMBER = re.compile(r"-?\d[\d.e+-]*")


@dataclass
class TickCounts:
    """Counts of a run.

    Attributes:
        commands: Number of commands published.
        scans: Number of virtual scans published.
        moving: Number of commands other than a standstill.
        arrivals: Number of goals declared reached.
        missed_ticks: Number of half periods that came too late and were skipped.
    """

    commands: int = 0
    scans: int = 0
    moving: int = 0
    arrivals: int = 0
    missed_ticks: int = 0


class NavigatorNode:
    """All nodes of the paper's Figure 11 in one process.

    Scanner, filter, virtual scan, actor and inverse kinematics are those of the navigator that
    drives in simulation and on recordings. Every half period the node updates it with the received
    readings and publishes pose and relative cloud; every period it publishes a command.

    Attributes:
        parts: Navigator with its localizer and its perception, for those who watch.
    """

    parts: NavigatorParts

    def __init__(
        self,
        graph: Graph,
        config: SimulatedRobotConfig,
        models: Models,
        steering: Steering,
        cloud: Topic | None = None,
        mountings: Mapping[str, GivenMounting] | None = None,
        given: Mapping[str, float] | None = None,
        status: Callable[[str], None] = lambda text: None,
        local_map: bool = True,
        sources: Mapping[str, str] | None = None,
        form: OutputForm | None = None,
        recording: LiveRecording | None = None,
        path: Topic | None = None,
    ) -> None:
        """Assemble the navigator, compile it, and subscribe to its topics.

        Args:
            graph: Graph to publish to and to receive from.
            config: Configuration of the robot.
            models: Classifiers.
            steering: Controller and planner.
            cloud: Topic of a 3D laser; None for the rotating laser's two.
            mountings: Mounting of each sensor by its name; takes precedence over frames and /tf.
            given: Fields of ``GeoReference`` that the user gives; the first good fix and the
                World Magnetic Model give the others.
            status: Function called with a line of text for the user: the place of the map's
                origin, assumptions, and what a start still lacks.
            local_map: True to publish the local map, the plan and ``map -> odom`` too.
            sources: Frame of the only source that is read, by topic.
            form: Form of the output; None for the paper's.
            recording: Recording of what is used and published; None for none.
            path: Topic of another planner's path to follow; None to drive to goals alone.
        """
        self._graph, self._status, self._recording = graph, status, recording
        self._output = NavigatorOutput(graph, form or OutputForm(), recording)
        self._datum = DatumInitializer(given or {}, status, graph.ros)
        extrinsics = Extrinsics(mountings)
        decoder = SensorDecoder(0, cloud, MessageDecoder(config.robot), extrinsics)
        self._inbox = SensorInbox(graph, decoder, sources)
        self._inbox.keeps_messages = recording is not None
        self._assemble_navigator(config, models, steering, local_map)
        self._mountings = MountingMonitor(extrinsics, self._assembler, config.robot.lidar_height)
        self._counts, self._had_arrived = TickCounts(), False
        self._reported: set[str] = set()
        self._inbox.subscribe()
        self._path_goals = PathGoals()
        if path is not None:
            graph.subscribe(path, self._path_goals.add)
        for topic in (*_PUBLISHED, *(topics.PLANNER_TOPICS if local_map else ())):
            self._output.advertise(topic)

    def _assemble_navigator(
        self, config: SimulatedRobotConfig, models: Models, steering: Steering, local_map: bool
    ) -> None:
        """Assemble the navigator and compile its kernels."""
        self._injector = FaultInjector(config.faults, np.random.default_rng(_FAULT_SEED))
        rng = np.random.default_rng(0)
        self.parts = make_navigator(config, models, steering, rng, self._injector)
        self._navigator, self._localizer, perception = self.parts
        self._assembler = assembler_of(perception)
        self._planner_recorder = (
            PlannerRecorder(self._localizer, perception, steering.planner) if local_map else None
        )
        self._bearings = config.grid.bearings
        warm_up(self._navigator, config)
        # As an observer the node gets a virtual scan every period, also between decisions.
        self._navigator.observers.append(self._publish)

    def set_goal(self, goal: NDArray[np.float64]) -> None:
        """Drive to a goal in the map [m], shape (2,), until another, or a path, is published."""
        self._inbox.goal = goal

    def run(
        self,
        start: Pose | None = None,
        seconds: float | None = None,
        on_second: Callable[[], None] | None = None,
    ) -> dict[str, Any]:
        """Navigate until the time is over or the graph shuts down.

        Args:
            start: Pose in the map; None waits for ``/initialpose``, or for a fix, the compass and
                gravity.
            seconds: Duration [s]; None for no limit.
            on_second: Function called after each second.

        Returns:
            Result, ready for JSON.

        Raises:
            RosError: If the sensors have another clock than the graph, or time runs back.
            FrameError: If gravity or the ground contradicts a stated mounting.
            DatumError: If the fixes lie far from the datum that is given.
        """
        self._graph.wait_for_clock()
        wait_for_transforms(self._graph, self._inbox, self._status)
        pose, is_rough = (start, False) if start else self._find_start()
        epoch_ns = self._begin(pose, is_rough)
        try:
            self._run_ticks(epoch_ns, seconds, on_second)
        finally:
            self._stop_robot()
        return self._result()

    def _find_start(self) -> tuple[Pose, bool]:
        """Wait for a start; return it, and True if it comes from the readings alone."""
        return StartFinder(self._graph, self._inbox, self._datum, self._status).wait()

    def _begin(self, pose: Pose, is_rough: bool) -> int:
        """Reset the navigator to its start; return the graph's time of it [ns]."""
        epoch_ns = self._graph.now_ns()
        self._inbox.restart(epoch_ns)
        self._navigator.reset(pose, 0.0, is_rough)
        self._injector.reset(np.random.default_rng(_FAULT_SEED))
        if self._recording is not None:
            self._recording.begin(pose, MessageBuilder(self._graph.ros, epoch_ns))
        self._queue = MessageQueue(self._output, MessageBuilder(self._graph.ros, epoch_ns))
        self._recorder = Recorder(
            self._queue,
            self._localizer,
            self._assembler,
            self._bearings,
            planner=self._planner_recorder,
        )
        self._counts = TickCounts()
        self._apply_datum()
        return epoch_ns

    def _run_ticks(
        self, epoch_ns: int, seconds: float | None, on_second: Callable[[], None] | None
    ) -> None:
        """Update the navigator every half period, and step it every period."""
        graph, tick = self._graph, 0
        while not graph.is_shutdown and (seconds is None or tick * _TICK_NS < seconds * NS):
            tick = self._next_tick(tick, epoch_ns)
            now = tick * _TICK_NS / NS
            if tick % _TICKS_PER_PERIOD:
                self._update(now)
            else:
                if tick % _TICKS_PER_SECOND == 0:
                    self._report_failures()
                self._step(now)
                if on_second is not None and tick % _TICKS_PER_SECOND == 0:
                    on_second()

    def _next_tick(self, tick: int, epoch_ns: int) -> int:
        """Wait for the next half period; skip those that have passed already."""
        graph, tick = self._graph, tick + 1
        missed = (graph.now_ns() - epoch_ns) // _TICK_NS - tick
        if missed > 0:  # The process was too slow or suspended: stay in phase.
            self._counts.missed_ticks += missed
            tick += missed
        graph.sleep_until(epoch_ns + tick * _TICK_NS)
        return tick

    def _update(self, now: float) -> None:
        """Process half a period of readings and publish the estimate at its end."""
        readings = self._received(now)
        if self._recording is not None:
            self._recording.add_update(now)
        self._navigator.update(readings)
        self._recorder.queue_transforms(readings)
        self._recorder.queue_clouds(now)
        self._queue.flush()

    def _step(self, now: float) -> None:
        """Process the other half, and publish virtual scan, command, pose and health."""
        readings = self._received(now)
        goal = self._path_goals.goal(self._localizer.pose.position[:2])
        if goal is None:
            goal = self._inbox.goal
        if goal is not None:
            self._navigator.set_goal(goal)
            if self._recording is not None:
                self._recording.add_goal(now, goal)
        self._navigator.step(readings)

    def _report_failures(self) -> None:
        """Put failed checks into the diagnostics from now on, and tell the user of new ones."""
        self._recorder.failures = [*self._inbox.failures, *self._path_goals.refusals]
        for text in self._recorder.failures:
            kind = _NUMBER.sub("", text)  # The numbers of a check change while the robot drives.
            if kind not in self._reported:
                self._status(f"failed check: {text}")
            self._reported.add(kind)

    def _publish(self, result: StepResult) -> None:
        """Publish a control step."""
        now = result.readings.stamp
        self._recorder.queue_transforms(result.readings)
        self._recorder.queue_clouds(now)
        self._mountings.check(self._localizer.odometry)
        self._recorder.queue_commands(result)
        self._recorder.queue_state(now)
        self._queue.flush()
        self._counts.commands += 1
        self._counts.scans += result.scan is not None
        self._counts.moving += result.wheels != WheelSpeeds(0.0, 0.0)
        self._counts.arrivals += result.has_arrived and not self._had_arrived
        self._had_arrived = result.has_arrived

    def _received(self, now: float) -> SensorReadings:
        """Return the usable readings since the last call; reset to an initial pose, if one came."""
        pose = self._inbox.take_initial_pose()
        if pose is not None:
            self._navigator.reset(pose, now)
        readings = self._usable(self._inbox.take_readings(now), now)
        if self._recording is not None:
            self._recording.add_readings(now, readings, self._inbox.taken)
        return readings

    def _usable(self, readings: SensorReadings, now: float) -> SensorReadings:
        """Return the readings that can be used; some need a datum, which fixes may still give."""
        if self._datum.datum is not None:
            return readings
        position = self._localizer.pose.position
        if self._datum.update(readings, self._graph.now_ns(), position):
            self._apply_datum()
        return self._datum.mask(readings, now, self._localizer)

    def _apply_datum(self) -> None:
        """Refer the localizer to the datum, if there is one, and publish it from now on."""
        self._recorder.diagnostic_values |= self._datum.apply(self._localizer)

    def _stop_robot(self) -> None:
        """Command a standstill, the last command of this node."""
        self._output.stop_recording()
        builder, now_ns = self._queue.builder, self._graph.now_ns()
        seconds = (now_ns - builder.epoch_ns) / NS
        self._output.write(topics.TWIST, now_ns, builder.twist(0.0, 0.0))
        wheels = builder.wheels("Wheels_cmd", seconds, 0.0, 0.0)
        self._output.write(topics.WHEEL_COMMAND, now_ns, wheels)
        time.sleep(_FLUSH_TIME)

    def _result(self) -> dict[str, Any]:
        """Return the result of the run, ready for JSON."""
        remarks, datum = self._inbox.remarks, self._datum.datum
        self._mountings.add_remarks(remarks)
        add_fix_remarks(remarks, self._localizer)
        return {
            **asdict(self._counts),
            "health": str(health_after(self._localizer.health, remarks.has_failures)),
            "counts": getattr(self._localizer, "counts", {}),
            "refused": self._inbox.refused,
            "frames": self._mountings.frames,
            "refused_by_reason": remarks.refused_by_reason(),
            "remarks": remarks.as_dicts(),
            "remark_texts": remarks.texts,
            **({"datum": None, "magnetic": None} if datum is None else datum.as_dict()),
        }
