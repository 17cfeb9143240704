"""What limits driving: what the cloud shows, or what the forest makes of it?

Run with ``python tests/benchmarks/bench_sight.py [WORLDS]``. The reactive controller drives natural
worlds that nobody trains or judges in (seeds from 200 on), in bullet and with the true pose, three
times over: by the forest's cells, by true cells of the same clouds, and by the true map itself.
"""

import sys
from collections import Counter
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Localizer
from andabata.localization.noisy_truth import NoisyTruthConfig
from andabata.models import shipped_forest
from andabata.navigation.perception import CloudPerception
from andabata.tasks.controllers import make_controller
from andabata.tasks.judge import JudgeConfig
from andabata.tasks.rig import Rig, RigConfig
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.trial import run_trial
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import VirtualScan, virtual_scan
from worlds.truth import TraversabilityMap

CONFIG = RigConfig(localizer="truth", errors=NoisyTruthConfig(position_sigma=0.0, yaw_sigma=0.0))
SCANNER = TraversabilityScanner(shipped_forest())
Cells = NDArray[np.uint8]
Sight = Callable[[CloudPerception, Localizer, TraversabilityMap, PolarGrid], Cells]


def forest_cells(
    perception: CloudPerception, localizer: Localizer, truth: TraversabilityMap, grid: PolarGrid
) -> Cells:
    """Return what the robot itself believes."""
    return SCANNER.cells(perception.assembler.relative(localizer.pose).points)


def labelled_cells(
    perception: CloudPerception, localizer: Localizer, truth: TraversabilityMap, grid: PolarGrid
) -> Cells:
    """Return the true cells of the robot's own cloud."""
    cloud = perception.assembler.cloud
    assert cloud is not None
    assert cloud.classes is not None
    bad = truth.severity_of(cloud.points, cloud.classes) > 0
    return label_cells(perception.assembler.relative(localizer.pose).points, bad, grid)


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


def drive(name: str, sight: Sight, worlds: int) -> None:
    """Drive all worlds by one sight and print how the first legs ended and how good cells were."""
    outcomes: Counter[str] = Counter()
    counts = np.zeros((2, 2))
    for seed in range(200, 200 + worlds):
        scene = SceneShelf().get("natural", seed)
        controller = make_controller("reactive", scene.world, CONFIG)
        rig = Rig(scene, CONFIG, shipped_forest(), controller)
        perception = rig.perception
        assert isinstance(perception, CloudPerception)
        plain, truth = perception.look, scene.world.truth

        def look(
            stamp: float,
            localizer: Localizer,
            plain: Callable[[float, Localizer], VirtualScan | None] = plain,
            perception: CloudPerception = perception,
            truth: TraversabilityMap = truth,
        ) -> VirtualScan | None:
            if plain(stamp, localizer) is None:
                return None
            cells = sight(perception, localizer, truth, CONFIG.grid)
            near = slice(0, 5)  # Rings to 2.4 m.
            true = labelled_cells(perception, localizer, truth, CONFIG.grid)[:, near]
            for k in (0, 1):
                for j in (0, 1):
                    counts[k, j] += ((true == k + 1) & (cells[:, near] == j + 1)).sum()
            return virtual_scan(cells, CONFIG.grid)

        perception.look = look  # type: ignore[method-assign]
        legs = run_trial(rig, scene.world.tasks[0], JudgeConfig(), np.random.default_rng([seed, 1]))
        outcomes[str(legs[0].outcome)] += 1
        rig.close()
    false_alarms, recall = counts[:, 1] / counts.sum(axis=1)
    figures = f"rings to 2.4 m: recall {recall:.3f}, false alarms {false_alarms:.3f}"
    sys.stdout.write(f"{name}: {dict(outcomes)}; {figures}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    worlds = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    drive("forest's cells", forest_cells, worlds)
    drive("true cells of the cloud", labelled_cells, worlds)
    drive("true map", map_cells, worlds)
