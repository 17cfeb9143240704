"""Measures where the time of a control step goes, stage by stage, from the plant to the policy."""

import time
from collections.abc import Callable, Iterator, Sequence
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
from andabata.navigation.perception import CloudPerception
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


def timed_calls(simulated_robot: SimulatedRobot) -> tuple[TimedCall, ...]:
    """Return the functions of a robot that are timed: the one place that knows their names.

    Raises:
        TypeError: If the robot makes no clouds.
    """
    simulator, perception = simulated_robot.simulator, simulated_robot.perception
    if not isinstance(perception, CloudPerception):
        raise TypeError(f"perception: expected clouds, got {type(perception).__name__}")
    return (
        TimedCall(simulator.vehicle, "drive", "plant"),
        TimedCall(simulator.proprioception, "sample", "proprioception"),
        TimedCall(simulator.lidar, "sweeps", "laser"),
        TimedCall(lidar, "beam_rays", "rays"),
        TimedCall(simulated_robot.scene.rays, "cast", "cast"),
        TimedCall(simulated_robot.localizer, "update", "filter"),
        TimedCall(perception.assembler, "add", "assemble"),
        TimedCall(cloud_assembly, "place_beams", "place"),
        TimedCall(perception, "scan", "scan"),
        TimedCall(scanner, "fill_quarters", "project"),
        TimedCall(scanner, "describe_cells", "features"),
        TimedCall(scanner, "classify_cells", "forest"),
        TimedCall(simulated_robot.navigator, "update", "update"),
        TimedCall(simulated_robot.navigator, "step", "step"),
    )


def _stages(spent: dict[str, float]) -> dict[str, float]:
    """Return the time of each stage in the order of the chain, without what it calls.

    Args:
        spent: Time by the stages of ``timed_calls``, which include what they call.
    """
    rays = spent["rays"]
    classified = spent["project"] + spent["features"] + spent["forest"]
    return {
        "plant": spent["plant"],
        "proprioception": spent["proprioception"],
        "rays": rays,
        "cast": spent["cast"],
        "noise of ranges": spent["laser"] - rays - spent["cast"],
        "filter": spent["filter"],
        "place": spent["place"],
        "store": spent["assemble"] - spent["place"],
        "carry, scan": spent["scan"] - classified,
        "project": spent["project"],
        "features": spent["features"],
        "forest": spent["forest"],
        "policy": spent["step"] - spent["update"] - spent["scan"],
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
    world: str,
    seed: int,
    steps: int,
    runs: int,
    controller: str = "policy+planner",
    step: Callable[[], None] | None = None,
) -> list[Row]:
    """Return the rows of ``bench_chain`` for several robots, one after the other."""
    rows: list[Row] = []
    for config in configs:
        rows += bench_chain(config, world, seed, steps, runs, controller, step)
    return rows


def bench_chain(
    config: SimulatedRobotConfig,
    world: str,
    seed: int,
    steps: int,
    runs: int,
    controller: str = "policy+planner",
    step: Callable[[], None] | None = None,
) -> list[Row]:
    """Return the time of each stage of a control step [us], and the speed of the whole.

    Each run drives twice: untimed stages for the whole, timed ones for the parts.

    Args:
        config: Configuration of the robot.
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
        steps: Number of control steps of a run.
        runs: Number of runs; the values are medians over them.
        controller: Name of the controller.
        step: Function that is called after each run.
    """
    scene = SceneCache(1).get(world, evaluation_world(seed, 0))
    totals: list[float] = []
    parts: list[dict[str, float]] = []
    for _ in range(runs):
        with driving(scene, config, controller, seed) as (_, advance):
            began = time.perf_counter()
            advance(steps)
            totals.append((time.perf_counter() - began) / steps)
        with driving(scene, config, controller, seed) as (simulated_robot, advance):
            with Stopwatch(timed_calls(simulated_robot)) as stopwatch:
                advance(steps)
            parts.append({name: spent / steps for name, spent in stopwatch.seconds.items()})
        if step is not None:
            step()
    total = float(np.median(totals))
    median = {name: float(np.median([part[name] for part in parts])) for name in parts[0]}
    subject = f"{config.plant}, {config.sensing.lidar.beams} beams"
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
    scene: Scene, config: SimulatedRobotConfig, controller: str, seed: int
) -> Iterator[tuple[SimulatedRobot, Callable[[int], None]]]:
    """Yield a robot after its run-in, and a function that drives it some steps further.

    Args:
        scene: World and its rays.
        config: Configuration of the robot.
        controller: Name of the controller.
        seed: Seed of the noise.
    """
    models = Models()
    steering = make_steering(controller, scene.world, config, models)
    simulated_robot = SimulatedRobot(scene, config, models, steering)
    task = scene.world.tasks[0]
    readings = simulated_robot.place(
        task.start, np.array(task.goals[0]), np.random.default_rng(seed)
    )

    def advance(steps: int) -> None:
        nonlocal readings
        for _ in range(steps):
            readings = simulated_robot.step(readings)

    try:
        advance(_RUN_IN)
        yield simulated_robot, advance
    finally:
        simulated_robot.close()
