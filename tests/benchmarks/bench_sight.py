"""What limits driving: the world, the filter, what the cloud shows, or what the forest makes of it?

Run with ``python tests/benchmarks/bench_sight.py [TRIALS] [CONTROLLER] [WORLD]``. The worlds are
those of ``andabata evaluate --world WORLD --seed 0``, in bullet; sensors draw their noise from the
same seeds. They are driven five times over: as the robot does, with its true pose, by true cells of
the same clouds, by the true map as far as cells reach, seen or not, and by the oracle.
"""

import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from andabata.app.evaluation import EvaluationConfig
from andabata.localization.localizer import Localizer
from andabata.localization.noisy_truth import NoisyTruthConfig
from andabata.models import shipped_forest
from andabata.navigation.perception import CloudPerception
from andabata.tasks.controllers import make_controller
from andabata.tasks.judge import Outcome
from andabata.tasks.rig import Rig, RigConfig
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.trial import run_trial
from rl.metrics import wilson_interval
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells
from traversability.virtual_scan import VirtualScan, virtual_scan
from worlds.truth import TraversabilityMap
from worlds.world import choose_task

KNOWN_POSE = RigConfig(
    localizer="truth", errors=NoisyTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)
)
Cells = NDArray[np.uint8]
Sight = Callable[[CloudPerception, Localizer, TraversabilityMap, PolarGrid], Cells]


def labelled_cells(
    perception: CloudPerception, localizer: Localizer, truth: TraversabilityMap, grid: PolarGrid
) -> Cells:
    """Return the true cells of the robot's own cloud."""
    cloud = perception.assembler.cloud
    assert cloud is not None
    assert cloud.classes is not None
    severity = truth.severity_of(cloud.points, cloud.classes)
    points = perception.assembler.relative(localizer.pose).points
    return label_cells(points, severity > 0, grid, things=np.isposinf(severity))


def map_cells(
    perception: CloudPerception, localizer: Localizer, truth: TraversabilityMap, grid: PolarGrid
) -> Cells:
    """Return the true map at the middle of each cell, seen or not."""
    edges, pose = grid.ring_edges, localizer.pose
    bearings, rings = np.meshgrid(grid.bearings, (edges[1:] + edges[:-1]) / 2, indexing="ij")
    x = pose.position[0] + rings * np.cos(bearings + pose.yaw)
    y = pose.position[1] + rings * np.sin(bearings + pose.yaw)
    red = truth.clearance_at(x, y) < 0.1
    return np.where(red, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE).astype(np.uint8)


def give_sight(rig: Rig, sight: Sight, truth: TraversabilityMap) -> None:
    """Replace what the forest makes of the clouds."""
    perception = rig.perception
    assert isinstance(perception, CloudPerception)
    plain, grid = perception.look, rig.config.grid

    def look(stamp: float, localizer: Localizer) -> VirtualScan | None:
        if plain(stamp, localizer) is None:
            return None
        return virtual_scan(sight(perception, localizer, truth, grid), grid)

    perception.look = look  # type: ignore[method-assign]


def drive(name: str, config: EvaluationConfig, sight: Sight | None) -> None:
    """Drive all worlds by one sight and print how many reached each goal in a row."""
    (law,) = config.controllers
    ends = Counter[str]()
    reached = np.zeros(3, dtype=int)
    for trial, course in enumerate(config.courses):
        scene = SceneShelf().get(course.world, course.seed, course.difficulty)
        task = choose_task(scene.world.tasks, np.random.default_rng([config.seed, trial]))
        rig = Rig(
            scene, config.rig, shipped_forest(), make_controller(law, scene.world, config.rig)
        )
        if sight is not None:
            give_sight(rig, sight, scene.world.truth)
        rng = np.random.default_rng([config.seed, trial, 1])
        legs = run_trial(rig, task, config.judge, rng)
        rig.close()
        for leg in legs:
            reached[leg.goal - 1] += leg.outcome is Outcome.GOAL
        ends[str(legs[-1].outcome)] += 1
    rates = [
        "{} [{:.2f}, {:.2f}]".format(n, *wilson_interval(n, config.trials))
        for n in reached.tolist()
    ]
    sys.stdout.write(f"{name}: of {config.trials}: {', '.join(rates)}; {dict(ends)}\n")
    sys.stdout.flush()


def main() -> None:
    """Drive by each sight."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    law = sys.argv[2] if len(sys.argv) > 2 else "straight+map"
    world = sys.argv[3] if len(sys.argv) > 3 else "natural-test"
    config = EvaluationConfig(world=world, trials=trials, goals=3, controllers=(law,))
    knowing = config.model_copy(update={"rig": KNOWN_POSE})
    drive("as it is", config, None)
    drive("true pose", knowing, None)
    drive("true cells of the cloud", knowing, labelled_cells)
    drive("true map within reach", knowing, map_cells)
    drive("oracle", knowing.model_copy(update={"controllers": ("oracle",)}), None)


if __name__ == "__main__":
    main()
