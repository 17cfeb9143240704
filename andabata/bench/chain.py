"""Where the time of a control step goes: the chain from plant to policy, stage by stage."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.machine import lidar
from andabata.models import shipped_forest
from andabata.navigation import cloud_assembly
from andabata.navigation.perception import CloudPerception
from traversability import scanner
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world

STEP = 0.1
"""A control period [s]."""

_RUN_IN = 60
"""Steps before the clock starts: the first clouds are complete, all code is compiled."""


class Stopwatch:
    """Times calls of the very parts that run, and takes its hands off them afterwards.

    Attributes:
        seconds: Time spent in each stage [s].
    """

    def __init__(self) -> None:
        """Begin at zero."""
        self.seconds: dict[str, float] = {}
        self._undo: list[Callable[[], None]] = []

    def watch(self, owner: Any, name: str, stage: str) -> None:  # noqa: ANN401 - any part.
        """Time the calls of ``owner.name`` as a stage."""
        plain = getattr(owner, name)
        own = vars(owner).get(name)
        self.seconds[stage] = 0.0

        def timed(*arguments: Any, **options: Any) -> Any:  # noqa: ANN401
            began = time.perf_counter()
            result = plain(*arguments, **options)
            self.seconds[stage] += time.perf_counter() - began
            return result

        setattr(owner, name, timed)
        self._undo.append(
            (lambda: delattr(owner, name)) if own is None else (lambda: setattr(owner, name, own))
        )

    def release(self) -> None:
        """Leave everything as it was."""
        for undo in reversed(self._undo):
            undo()
        self._undo.clear()


def bench_chain(
    config: SimulatedRobotConfig,
    world: str,
    seed: int,
    steps: int,
    runs: int,
    controller: str = "learned",
    step: Callable[[], None] | None = None,
) -> list[dict[str, Any]]:
    """Return microseconds per control step of each stage, and how much faster than life it runs.

    Args:
        config: The robot.
        world: Preset; the world is one of the judges'.
        seed: Of world and noise.
        steps: Control steps of a run.
        runs: Runs; the figures are medians over them.
        controller: Who steers.
        step: Called after each run.
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
            watch = Stopwatch()
            _watch(watch, simulated_robot)
            try:
                advance(steps)
            finally:
                watch.release()
            parts.append({name: spent / steps for name, spent in watch.seconds.items()})
        if step is not None:
            step()
    total = float(np.median(totals))
    median = {name: float(np.median([part[name] for part in parts])) for name in parts[0]}
    stages = _stages(median)
    beams = config.sensing.lidar.beams
    subject = f"{config.plant}, {beams} beams"
    rows = [_row(name, subject, 1e6 * value, "us", runs) for name, value in stages.items()]
    rows.append(_row("whole step", subject, 1e6 * total, "us", runs))
    rows.append(_row("faster than life", subject, STEP / total, "1", runs))
    return rows


@contextmanager
def driving(
    scene: Scene, config: SimulatedRobotConfig, controller: str, seed: int
) -> Iterator[tuple[SimulatedRobot, Callable[[int], None]]]:
    """Yield a robot that has run in, and a function that drives it some steps further."""
    simulated_robot = SimulatedRobot(
        scene, config, shipped_forest(), make_controller(controller, scene.world, config)
    )
    task = scene.world.tasks[0]
    readings = simulated_robot.place(
        task.start, np.array(task.goals[0]), np.random.default_rng(seed)
    )

    def advance(steps: int) -> None:
        nonlocal readings
        for _ in range(steps):
            readings = simulated_robot.simulator.step(simulated_robot.navigator.step(readings))

    try:
        advance(_RUN_IN)
        yield simulated_robot, advance
    finally:
        simulated_robot.close()


def _watch(watch: Stopwatch, simulated_robot: SimulatedRobot) -> None:
    """Time the parts of a robot."""
    simulator, perception = simulated_robot.simulator, simulated_robot.perception
    if not isinstance(perception, CloudPerception):
        raise TypeError(f"perception: expected clouds, got {type(perception).__name__}")
    for owner, name, stage in (
        (simulator.vehicle, "drive", "plant"),
        (simulator.proprioception, "sample", "senses"),
        (simulator.lidar, "sweeps", "laser"),
        (lidar, "beam_rays", "rays"),
        (simulated_robot.scene.rays, "cast", "cast"),
        (simulated_robot.localizer, "update", "filter"),
        (perception.assembler, "add", "assemble"),
        (cloud_assembly, "place_beams", "place"),
        (perception, "look", "look"),
        (scanner, "fill_quarters", "project"),
        (scanner, "describe_cells", "features"),
        (scanner, "_judge", "forest"),
        (simulated_robot.navigator, "decide", "decide"),
    ):
        watch.watch(owner, name, stage)


def _stages(spent: dict[str, float]) -> dict[str, float]:
    """Return the stages in the order of the chain, without what is counted in another one."""
    rays = spent["rays"]
    judged = spent["project"] + spent["features"] + spent["forest"]
    return {
        "plant": spent["plant"],
        "senses": spent["senses"],
        "rays": rays,
        "cast": spent["cast"],
        "noise of ranges": spent["laser"] - rays - spent["cast"],
        "filter": spent["filter"],
        "place": spent["place"],
        "store": spent["assemble"] - spent["place"],
        "carry, scan": spent["look"] - judged,
        "project": spent["project"],
        "features": spent["features"],
        "forest": spent["forest"],
        "policy": spent["decide"] - spent["look"],
    }


def _row(name: str, subject: str, value: float, unit: str, runs: int) -> dict[str, Any]:
    """Return one row of the bench."""
    return {
        "name": name,
        "subject": subject,
        "value": value,
        "unit": unit,
        "ratio_to_ours": None,
        "runs": runs,
    }
