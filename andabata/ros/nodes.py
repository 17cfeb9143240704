"""The nodes of a live ROS 1 graph: the robot's mind, and a simulated robot for it."""

import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig, make_localizer, make_perception
from andabata.machine.pose import Pose
from andabata.machine.proprioception import GRAVITY, TESLA
from andabata.machine.sensor_readings import SensorReadings, Sweeps, VehicleState, WheelSpeeds
from andabata.machine.simulator import Simulator
from andabata.navigation.controller import Controller
from andabata.navigation.navigator import STANDSTILL, Navigator, Step
from andabata.navigation.perception import assembler_of
from andabata.records import topics
from andabata.records.messages import NS, MessageBuilder, pose_of, wheel_speeds_of
from andabata.records.mounts import GivenMounting, Mounts
from andabata.records.recorder import DATUM, MessageQueue, Recorder, queue_readings
from andabata.records.sense_decoding import MessageDecoder
from andabata.records.sensor_decoder import SensorDecoder
from andabata.records.topics import Ros, RosMessage, Topic
from andabata.replay.datum import add_fix_remarks
from andabata.replay.mounting_monitor import MountingMonitor
from andabata.ros.datum_initializer import SILENCE, DatumInitializer, missing_senses
from andabata.ros.graph import RosError, RosGraph
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from traversability.cloud import PointCloud
from traversability.forest import Forest
from worlds.scenes import Scene
from worlds.world import Task

_HALF = NS // 20
"""Half a control period [ns]: the relative cloud comes twice in one (paper, Table 3)."""

_APART = 1.0
"""SensorReadings stamped further from the graph's time are another clock's [s]."""

_LAST_WORDS = 0.2
"""How long the last messages may take to leave [s]."""

_PATIENCE = 1.0
"""How long to wait for someone who tells the start before the senses tell it [s]."""


class NavigatorNode:
    """The nodes of the paper's Figure 11 in one process.

    Scanner, filter, virtual scan, actor and inverse kinematics are the navigator's own: the same
    that drives in simulation and on recordings. Every half period the senses that came are
    listened to and the relative cloud is published; every period a command follows.
    """

    def __init__(
        self,
        graph: RosGraph,
        config: SimulatedRobotConfig,
        forest: Forest,
        controller: Controller,
        cloud: Topic | None = None,
        mountings: Mapping[str, GivenMounting] | None = None,
        given: Mapping[str, float] | None = None,
        status: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Build the navigator and listen to its topics.

        Args:
            graph: Where to live.
            config: The robot.
            forest: The cell classifier.
            controller: Where to steer.
            cloud: A 3D laser's topic, None for the turning laser's two.
            mountings: Where senses sit, by sense, above what frames and /tf say.
            given: Fields of ``GeoReference`` that the user gives; the first good fix and the
                World Magnetic Model tell the others.
            status: Tells the user where the map lies, once, and what is taken for granted.
        """
        self._graph, self._status = graph, status
        self._where = DatumInitializer(given or {}, status)
        self._lock = threading.Lock()
        decoder, mounts = MessageDecoder(config.robot), Mounts(mountings)
        self._sensor_decoder = SensorDecoder(0, cloud, decoder, mounts)
        self._told: Pose | None = None
        self._localizer = make_localizer(config, np.random.default_rng(0))
        perception = make_perception(config, forest)
        self._assembler = assembler_of(perception)
        self._navigator = Navigator(config.robot, self._localizer, perception, controller)
        self._bearings = config.grid.bearings
        self._steps: list[Step] = []
        self._navigator.watch(self._steps.append)
        self._mountings = MountingMonitor(
            self._sensor_decoder.mounts, self._assembler, config.robot.lidar_height
        )
        _rehearse(self._navigator, config)
        for topic in self._sensor_decoder.wanted:
            graph.subscribe(topic, self._hear)
        graph.subscribe(topics.INITIAL_POSE, self._hear_start)
        for topic in (topics.TF_STATIC, topics.TF):
            graph.subscribe(topic, self._hear_transforms)
        for topic in _SPOKEN:
            graph.advertise(topic)

    def _hear(self, topic: Topic, message: RosMessage) -> None:
        """Take in a sensor's message; called from the graph's threads."""
        with self._lock:
            self._sensor_decoder.add(topic, message, self._graph.now_ns())

    def _hear_transforms(self, topic: Topic, message: RosMessage) -> None:
        """Take in transforms; those of static frames are sent again to whoever comes late."""
        with self._lock:
            tree = self._sensor_decoder.mounts.tree
            tree.add(message.transforms, topic is topics.TF_STATIC)
            tree.forget(_TRANSFORMS)

    def _hear_start(self, _: Topic, message: RosMessage) -> None:
        """Take in where the robot is told to be."""
        with self._lock:
            self._told = pose_of(message.pose.pose)

    def _sensed(self, stamp: float) -> SensorReadings:
        """Return what came since the last call."""
        with self._lock:
            self._sensor_decoder.mounts.verify()
            return self._sensor_decoder.readings(stamp)

    def set_goal(self, goal: NDArray[np.float64]) -> None:
        """Head for a goal in the map [m], shape (2,), until another is published."""
        with self._lock:
            self._sensor_decoder.goal = goal

    def run(
        self,
        start: Pose | None = None,
        seconds: float | None = None,
        on_second: Callable[[], None] | None = None,
    ) -> dict[str, Any]:
        """Navigate until the time is over or the graph is.

        Args:
            start: Where the robot stands; None waits for ``/initialpose``, or for a fix, the
                compass and gravity to tell.
            seconds: How long; None for ever.
            on_second: Called after each second.

        Returns:
            Figures, ready for JSON.

        Raises:
            RosError: If the senses have another clock than the graph, or time runs back.
            DatumError: If the fixes lie far from the datum that is given.
        """
        graph = self._graph
        graph.wait_for_clock()
        self._wait_for_frames()
        pose, rough = (start, False) if start else self._wait_for_start()
        epoch = graph.now_ns()
        self._sensed(0.0)  # What came before the begin is of no use.
        with self._lock:
            self._sensor_decoder.epoch_ns, self._told = epoch, None
        self._navigator.reset(pose, 0.0, rough)
        self._queue = MessageQueue(graph, MessageBuilder(1, epoch))
        self._recorder = Recorder(self._queue, self._localizer, self._assembler, self._bearings)
        self._where.take(self._localizer, self._recorder.diagnostic_values, DATUM)
        found = {"commands": 0, "scans": 0, "moving": 0, "missed_ticks": 0}
        try:
            self._tick(epoch, seconds, on_second, found)
        finally:
            self._halt()
        localizer, datum = self._localizer, self._where.datum
        remarks = self._sensor_decoder.remarks
        self._mountings.add_remarks(remarks)
        add_fix_remarks(remarks, localizer)
        return {
            **found,
            "health": str(localizer.health),
            "counts": getattr(localizer, "counts", {}),
            "refused": self._sensor_decoder.refused,
            "frames": self._mountings.frames,
            "refused_by_reason": remarks.refused_by_reason(),
            "remarks": remarks.as_dicts(),
            "remark_texts": remarks.texts,
            **({"datum": None, "magnetic": None} if datum is None else datum.as_dict()),
        }

    def _tick(
        self,
        epoch: int,
        seconds: float | None,
        on_second: Callable[[], None] | None,
        found: dict[str, int],
    ) -> None:
        """Listen every half period and decide every period, and count what came of it."""
        graph, tick = self._graph, 0
        while not graph.is_shutdown and (seconds is None or tick * _HALF < seconds * NS):
            tick += 1
            missed = (graph.now_ns() - epoch) // _HALF - tick
            if missed > 0:  # Too slow, or put to sleep: go on now, in step.
                found["missed_ticks"] += missed
                tick += missed
            graph.sleep_until(epoch + tick * _HALF)
            self._listen(tick * _HALF / NS)
            if tick % 2 == 0:
                step = self._decide(tick * _HALF / NS)
                found["commands"] += 1
                found["scans"] += step.view is not None
                found["moving"] += step.wheels != STANDSTILL
                if on_second is not None and tick % 20 == 0:
                    on_second()

    def _halt(self) -> None:
        """Tell the robot to stand still: nobody will tell it anything from now on."""
        builder, now = self._queue.builder, self._graph.now_ns()
        seconds = (now - builder.epoch_ns) / NS
        self._graph.write(topics.TWIST, now, builder.twist(0.0, 0.0))
        self._graph.write(
            topics.WHEEL_COMMAND, now, builder.wheels("Wheels_cmd", seconds, 0.0, 0.0)
        )
        time.sleep(_LAST_WORDS)

    def _wait_for_start(self) -> tuple[Pose, bool]:
        """Return where the robot stands, and whether only its senses tell it.

        Raises:
            RosError: If the senses have another clock than the graph.
            DatumError: If the fixes lie far from the datum that is given.
        """
        graph, kept = self._graph, SensorReadings(0.0)
        begin = said = graph.now_ns()
        while not graph.is_shutdown:
            graph.sleep_until(graph.now_ns() + _HALF)
            readings = self._sensed(0.0)
            if readings.imu is not None:
                _check_clock(float(readings.imu[-1, 0]), graph.now_ns() / NS)
            kept = SensorReadings(
                0.0,
                imu=_joined(kept.imu, readings.imu),
                mag=_joined(kept.mag, readings.mag),
                gnss=_joined(kept.gnss, readings.gnss),
                antenna=readings.antenna,
            )
            with self._lock:
                told = self._told
            if told is not None:
                return told, False
            if graph.now_ns() - begin > _PATIENCE * NS:
                found = self._where.locate(kept, graph.now_ns())
                if found is not None:
                    return found, True
            if graph.now_ns() - said > SILENCE * NS:
                said = graph.now_ns()
                self._status(f"no start yet: expected {missing_senses(kept)}; or /initialpose")
        raise RosError("start: expected someone to tell it, got the end of the graph")

    def _wait_for_frames(self) -> None:
        """Wait a while for the transforms of the senses' frames.

        Those that come later count from then on. What is missing by then is among the remarks.
        """
        graph, begin = self._graph, self._graph.now_ns()
        while not graph.is_shutdown and graph.now_ns() - begin < _FRAMES_PATIENCE * NS:
            graph.sleep_until(graph.now_ns() + _HALF)
            with self._lock:
                if self._sensor_decoder.mounts.is_settled:
                    break
        with self._lock:
            remarks = self._sensor_decoder.mounts.remarks
        for remark in remarks:
            self._status(f"note: {remark}")

    def _referred(self, readings: SensorReadings, now: float) -> SensorReadings:
        """Return senses without those that need a datum, until the fixes tell one."""
        known, graph = self._where, self._graph
        if known.datum is not None:
            return readings
        if known.find(readings, graph.now_ns(), self._localizer.pose.position):
            known.take(self._localizer, self._recorder.diagnostic_values, DATUM)
        return known.usable(readings, now, self._localizer)

    def _listen(self, now: float) -> None:
        """Take in half a period and publish what is believed at its end."""
        with self._lock:
            told, self._told = self._told, None
        if told is not None:
            self._navigator.reset(told, now)
        readings = self._referred(self._sensed(now), now)
        self._navigator.listen(readings)
        self._recorder.queue_transforms(readings)
        self._recorder.queue_clouds(now)
        self._queue.flush()

    def _decide(self, now: float) -> Step:
        """Publish the virtual scan and the commands of a period."""
        with self._lock:
            goal = self._sensor_decoder.goal
        if goal is not None:
            self._navigator.set_goal(goal)
        self._steps.clear()
        self._navigator.decide(SensorReadings(now))
        step = self._steps[0]
        self._mountings.check(self._localizer.odometry)
        self._recorder.queue_commands(step)
        self._recorder.queue_state(now)
        self._queue.flush()
        return step


_FRAMES_PATIENCE = 3.0
"""How long to wait for the senses' first messages and for the transforms of their frames [s]."""

_TRANSFORMS = 30.0
"""Transforms of moving frames are kept for so long [s]."""

_SPOKEN = (
    topics.TF,
    topics.CLOUD,
    topics.RELATIVE_CLOUD,
    topics.VIRTUAL_SCAN,
    topics.TWIST,
    topics.WHEEL_COMMAND,
    topics.FILTERED_ODOMETRY,
    topics.DIAGNOSTICS,
)


class RobotNode:
    """A simulated robot that publishes its senses as they come and obeys wheel speeds."""

    def __init__(self, graph: RosGraph, scene: Scene, config: SimulatedRobotConfig) -> None:
        """Put a robot into a world.

        Args:
            graph: Where to live.
            scene: Where to drive.
            config: The robot.
        """
        self._graph, self._scene, self._config = graph, scene, config
        self._wheels = (STANDSTILL, 0)
        graph.subscribe(topics.WHEEL_COMMAND, self._obey)
        self._start = graph.advertise(topics.INITIAL_POSE, latch=True)
        self._goal = graph.advertise(topics.GOAL, latch=True)

    def _obey(self, _: Topic, message: RosMessage) -> None:
        """Take in wheel speeds."""
        wheels = wheel_speeds_of(message)
        if np.isfinite([wheels.left, wheels.right]).all():
            self._wheels = (wheels, self._graph.now_ns())

    def run(
        self,
        task: Task,
        rng: np.random.Generator,
        terminations: TerminationConfig,
        on_second: Callable[[], None] | None = None,
    ) -> dict[str, Any]:
        """Live through a task in the graph's time.

        Args:
            task: Start and goals.
            rng: Of every noise.
            terminations: Rules of the drive to each goal.
            on_second: Called after each second.

        Returns:
            Figures, ready for JSON.
        """
        graph, config = self._graph, self._config
        graph.wait_for_clock()
        world, rays = self._scene.world, self._scene.rays
        simulator = Simulator(world, rays, config.robot, config.plant, config.sensing, rng)
        readings = simulator.reset(task.start)
        builder = MessageBuilder(1, graph.now_ns() + NS // 10)
        queue = MessageQueue(_Paced(graph), builder)
        monitor = EpisodeMonitor(world, terminations)
        outcomes: list[str] = []
        for goal in task.goals:
            state = _true(readings)
            monitor.begin(state, np.array(goal))
            self._goal.publish(self._goal.data_class(builder.goal(readings.stamp, np.array(goal))))
            if not outcomes:
                told = builder.initial(readings.stamp, state.pose)
                self._start.publish(self._start.data_class(told))
            outcome: Outcome | None = None
            while outcome is None and not graph.is_shutdown:
                readings = simulator.step(self._commanded())
                queue_readings(queue, readings)
                queue.flush()
                outcome = monitor.watch(_true(readings))
                if on_second is not None and round(readings.stamp * 10) % 10 == 0:
                    on_second()
            outcomes.append(str(outcome) if outcome else "interrupted")
            if outcome is not Outcome.GOAL:
                break
        simulator.close()
        behind = (graph.now_ns() - builder.stamp_ns(readings.stamp)) / NS
        return {"outcomes": outcomes, "simulated_s": readings.stamp, "behind_s": behind}

    def _commanded(self) -> WheelSpeeds:
        """Return the latest command; a robot that hears none for half a second stands still."""
        wheels, stamp = self._wheels
        fresh = self._graph.now_ns() - stamp < NS // 2
        return wheels if fresh else STANDSTILL


class _Paced:
    """Publishes each message when its time has come."""

    ros: Ros = 1

    def __init__(self, graph: RosGraph) -> None:
        self._graph = graph

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        self._graph.sleep_until(stamp_ns)
        self._graph.write(topic, stamp_ns, message)

    def close(self) -> None:
        self._graph.close()


def _true(readings: SensorReadings) -> VehicleState:
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    return readings.truth


def _rehearse(navigator: Navigator, config: SimulatedRobotConfig) -> None:
    """Go through a period of nothing much, so that all code is compiled before it is needed."""
    stamps = np.arange(1, 11) / 100
    imu = np.column_stack([stamps, np.zeros((10, 5)), np.full(10, GRAVITY)])
    wheels = np.column_stack([stamps, np.zeros((10, 2))])
    field = np.column_stack([stamps, np.tile(config.sensing.geo_reference.flux * TESLA, (10, 1))])
    lidar = config.sensing.lidar
    beams = lidar.elevations(0, 1)
    sweep = Sweeps(
        stamps[:1],
        np.zeros(1),
        lidar.head_rate,
        lidar.beam_period,
        beams,
        np.ones((1, beams.shape[-1]), dtype=np.float32),
    )
    frame = PointCloud(np.ones((10, 3), dtype=np.float32), "sensor", stamps)
    navigator.reset(Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])), 0.0)
    readings = SensorReadings(0.1, sweep, (frame,), imu=imu, encoders=wheels, mag=field)
    navigator.listen(readings)
    navigator.decide(readings)


def _check_clock(stamp: float, now: float) -> None:
    """Refuse senses of another clock.

    Raises:
        RosError: If the stamps [s] are too far apart.
    """
    if abs(stamp - now) > _APART:
        raise RosError(
            f"/imu: expected stamps within {_APART:.0f} s of the graph's time, got one "
            f"{now - stamp:.1f} s behind; play recordings with `rosbag play --clock` and "
            "`rosparam set use_sim_time true`"
        )


def _joined(
    kept: NDArray[np.float64] | None, new: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """Return the rows of both, at most the last thousand."""
    if kept is None or new is None:
        return new if kept is None else kept
    return np.concatenate([kept, new])[-1000:]
