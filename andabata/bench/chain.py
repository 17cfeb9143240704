"""Measures where the time of a control step goes, stage by stage, from the plant to the policy.

Several robots of one world take their steps in turn, as in training and evaluation; the figures are
those of one of them.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.table import Row, benchmark_row
from andabata.machine import lidar
from andabata.machine.clock import CONTROL_PERIOD
from andabata.models import Models
from andabata.navigation import cloud_assembly
from andabata.navigation.controller import Steering
from andabata.navigation.perception import CloudPerception
from andabata.navigation.planning.local_planner import LocalPlanner
from traversability import scanner
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world

_RUN_IN = 60
"""Steps before the clock starts: the first clouds are complete, all code is compiled."""


class TimedCall(NamedTuple):
    """Function whose calls count as a stage.

    Attributes:
        owner: Object or module that the function is looked up in.
        name: Name of the function there.
        stage: Name of the stage.
    """

    owner: Any
    name: str
    stage: str


def timed_calls(robots: Sequence[SimulatedRobot]) -> tuple[TimedCall, ...]:
    """Return the functions of robots that are timed: the one place that knows their names.

    Args:
        robots: Robots in one scene.

    Raises:
        TypeError: If a robot makes no clouds.
    """
    calls = [
        TimedCall(lidar, "beam_rays", "rays"),
        TimedCall(cloud_assembly, "place_beams", "place"),
        TimedCall(scanner, "fill_quarters", "project"),
        TimedCall(scanner, "describe_cells", "features"),
        TimedCall(scanner, "classify_cells", "forest"),
    ]
    for robot in robots:
        calls += _calls_of_sensors(robot) + _calls_of_steering(robot.navigator.steering)
    return tuple(calls)


def _calls_of_sensors(robot: SimulatedRobot) -> list[TimedCall]:
    """Return the timed functions from a robot's plant to its virtual scan, and its whole step."""
    simulator, perception = robot.simulator, robot.perception
    if not isinstance(perception, CloudPerception):
        raise TypeError(f"perception: expected clouds, got {type(perception).__name__}")
    calls = [
        TimedCall(simulator.vehicle, "drive", "plant"),
        TimedCall(simulator.proprioception, "sample", "proprioception"),
        TimedCall(simulator.lidar, "sweeps", "laser"),
        TimedCall(robot.localizer, "update", "filter"),
        TimedCall(perception.assembler, "add", "assemble"),
        TimedCall(perception, "scan", "scan"),
        TimedCall(robot.navigator, "update", "update"),
        TimedCall(robot.navigator, "step", "step"),
    ]
    if perception.layers is not None:
        calls.append(TimedCall(perception.layers, "update", "ground cells"))
    return calls


def _calls_of_steering(steering: Steering) -> list[TimedCall]:
    """Return the timed functions of a controller and of the planner around it."""
    calls = [TimedCall(steering.controller, "act", "policy")]
    if isinstance(steering.planner, LocalPlanner):
        calls += [
            TimedCall(steering.planner.occupancy, "update", "occupancy grid"),
            TimedCall(steering.planner, "subgoal", "plan"),
            TimedCall(steering.planner, "select", "rollouts"),
        ]
    return calls


_STEERING = ("ground cells", "occupancy grid", "plan", "rollouts", "policy")
"""Stages of steering, none of which calls another."""


def _stages(spent: Mapping[str, float]) -> dict[str, float]:
    """Return the time of each stage in the order of the chain, without what it calls.

    Args:
        spent: Time by the stages of ``timed_calls``, which include what they call; those that the
            robot does not have are missing.
    """
    rays = spent["rays"]
    classified = spent["project"] + spent["features"] + spent["forest"]
    steering = {name: spent[name] for name in _STEERING if name in spent}
    steered = spent["step"] - spent["update"] - spent["scan"]
    return {
        "plant": spent["plant"],
        "proprioception": spent["proprioception"],
        "rays": rays,
        "cast, noise": spent["laser"] - rays,
        "filter": spent["filter"],
        "place": spent["place"],
        "store": spent["assemble"] - spent["place"],
        "carry, scan": spent["scan"] - classified,
        "project": spent["project"],
        "features": spent["features"],
        "forest": spent["forest"],
        **steering,
        "rest of steering": steered - sum(steering.values()),
    }


class Stopwatch:
    """Times the calls of functions while it is open, and restores them when it closes.

    Attributes:
        seconds: Time spent in each stage [s].
    """

    def __init__(self, calls: Sequence[TimedCall]) -> None:
        """Prepare to time some functions.

        Raises:
            AttributeError: If an owner has no function of that name.
        """
        for owner, name, stage in calls:
            if not callable(getattr(owner, name, None)):
                kind = getattr(owner, "__name__", type(owner).__name__)
                raise AttributeError(
                    f"stage {stage!r}: expected {kind} to have a function {name!r}, got none; "
                    "correct the list in andabata.bench.chain.timed_calls"
                )
        self.seconds = {call.stage: 0.0 for call in calls}
        self._calls = calls
        self._restore: list[Callable[[], None]] = []

    def __enter__(self) -> "Stopwatch":
        """Begin to time."""
        for call in self._calls:
            self._wrap(*call)
        return self

    def __exit__(self, *error: object) -> None:
        """Restore the functions."""
        for restore in reversed(self._restore):
            restore()
        self._restore.clear()

    def _wrap(self, owner: Any, name: str, stage: str) -> None:  # noqa: ANN401 - any object.
        """Replace one function by a timed one."""
        plain = getattr(owner, name)
        own = vars(owner).get(name)

        def timed(*arguments: Any, **options: Any) -> Any:  # noqa: ANN401 - any function.
            began = time.perf_counter()
            result = plain(*arguments, **options)
            self.seconds[stage] += time.perf_counter() - began
            return result

        setattr(owner, name, timed)
        # A method is found in the class again once the object's own entry is gone.
        self._restore.append(
            (lambda: delattr(owner, name)) if own is None else (lambda: setattr(owner, name, own))
        )


def bench_chains(
    configs: Sequence[SimulatedRobotConfig],
    crowds: Sequence[int],
    world: str,
    seed: int,
    steps: int,
    runs: int,
    controller: str = "policy+planner",
    step: Callable[[], None] | None = None,
) -> list[Row]:
    """Return the rows of ``bench_chain`` for several robots, one configuration after the other.

    Args:
        configs: Configurations.
        crowds: Numbers of robots in the world, each measured with each configuration.
        world: World preset.
        seed: Seed of world and noise.
        steps: Number of control steps of a run.
        runs: Number of runs.
        controller: Name of the controller.
        step: Function that is called after each run.
    """
    rows: list[Row] = []
    for crowd in crowds:
        for config in configs:
            rows += bench_chain(config, world, seed, steps, runs, controller, step, crowd)
    return rows


def bench_chain(
    config: SimulatedRobotConfig,
    world: str,
    seed: int,
    steps: int,
    runs: int,
    controller: str = "policy+planner",
    step: Callable[[], None] | None = None,
    crowd: int = 1,
) -> list[Row]:
    """Return the time of each stage of a control step [us], and the speed of the whole.

    Each run drives twice: untimed stages for the whole, timed ones for the parts.

    Args:
        config: Configuration of the robots.
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
        steps: Number of control steps of a run, of each robot.
        runs: Number of runs; the values are medians over them.
        controller: Name of the controller.
        step: Function that is called after each run.
        crowd: Number of robots in the world.
    """
    scene = SceneCache(1).get(world, evaluation_world(seed, 0))
    totals: list[float] = []
    parts: list[dict[str, float]] = []
    for _ in range(runs):
        with driving(scene, config, controller, seed, crowd) as (_, advance):
            began = time.perf_counter()
            advance(steps)
            totals.append((time.perf_counter() - began) / steps / crowd)
        with driving(scene, config, controller, seed, crowd) as (robots, advance):
            with Stopwatch(timed_calls(robots)) as stopwatch:
                advance(steps)
            spent = stopwatch.seconds
            parts.append({name: one / steps / crowd for name, one in spent.items()})
        if step is not None:
            step()
    total = float(np.median(totals))
    median = {name: float(np.median([part[name] for part in parts])) for name in parts[0]}
    subject = f"{config.plant}, {config.sensing.lidar.beams} beams"
    subject += "" if crowd == 1 else f", {crowd} robots"
    return [
        *(
            benchmark_row(name, subject, 1e6 * value, "us", runs)
            for name, value in _stages(median).items()
        ),
        benchmark_row("whole step", subject, 1e6 * total, "us", runs),
        benchmark_row("faster than life", subject, CONTROL_PERIOD / total, "1", runs),
    ]


def stage_table(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of ``bench_chain`` as a table: one line a stage, one column a subject."""
    subjects = list(dict.fromkeys(row["subject"] for row in rows))
    values = {(row["name"], row["subject"]): row["value"] for row in rows}
    return [
        {"stage": name} | {subject: f"{values[name, subject]:.0f}" for subject in subjects}
        for name in dict.fromkeys(row["name"] for row in rows)
    ]


@contextmanager
def driving(
    scene: Scene, config: SimulatedRobotConfig, controller: str, seed: int, crowd: int = 1
) -> Iterator[tuple[list[SimulatedRobot], Callable[[int], None]]]:
    """Yield robots after their run-in, and a function that drives each some steps further.

    Args:
        scene: World and its rays.
        config: Configuration of the robots.
        controller: Name of the controller.
        seed: Seed of the noise.
        crowd: Number of robots, which do not see each other.
    """
    models = Models()
    robots, readings = [], []
    for number in range(crowd):
        steering = make_steering(controller, scene.world, config, models)
        robot = SimulatedRobot(scene, config, models, steering)
        task = scene.world.tasks[number % len(scene.world.tasks)]
        rng = np.random.default_rng(seed if number == 0 else [seed, number])
        robots.append(robot)
        readings.append(robot.place(task.start, np.array(task.goals[0]), rng))

    def advance(steps: int) -> None:
        for _ in range(steps):
            for number, robot in enumerate(robots):
                readings[number] = robot.step(readings[number])

    try:
        advance(_RUN_IN)
        yield robots, advance
    finally:
        for robot in robots:
            robot.close()
