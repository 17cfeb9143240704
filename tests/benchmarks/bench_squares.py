"""Squares against the true map along drives, beside the polar cell that each of them lies in.

Run with ``python tests/benchmarks/bench_squares.py [WORLD] [FIRST] [COUNT] [SQUARES]``: drives of
``learned`` to one goal each in so many worlds from that seed on, kinematic plant. What has settled
since the last look is judged where it lies; a square is red when the true map forbids a quarter of
it. The polar cell's odds are those of the scan at the same instant, where the forest looked at all.
With SQUARES, a file, these trees watch the same drives instead of the shipped ones.

The last lines are the map's, which remembers several passes of the laser: which squares are walls
to the plan.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.metrics import average_precision_score, roc_auc_score

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.models import shipped_forest, shipped_ground_classifier
from andabata.navigation.navigator import Step
from andabata.navigation.planning.ground_layer import GroundLayer
from andabata.navigation.planning.local_planner import LocalPlannerConfig
from andabata.tasks.episode_monitor import TerminationConfig
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures
from traversability.grid import PolarGrid
from worlds.scenes import SceneCache
from worlds.truth import Reason, TraversabilityMap
from worlds.world import World

BANDS = ((0.7, 1.8), (1.8, 3.2), (3.2, 5.0), (5.0, 10.0))
MAP_BANDS = ((0.7, 2.5), (2.5, 5.0))
CONFIG = LocalPlannerConfig()
WALL = CONFIG.wall / CONFIG.certain * CONFIG.squares.most
"""Log odds from which a square is a wall."""

EVERY = 5
"""Control steps between two looks: as often as a robot with a map decides."""


class Watcher:
    """Gathers, for each square of each cloud, what was said of it and what is true."""

    def __init__(self, world: World, grid: PolarGrid, forest: GroundClassifier) -> None:
        self._truth, self._grid, self._forest = world.truth, grid, forest
        self._tiles, self._features = ElevationGrid(), GroundFeatures()
        self._map = GroundLayer(CONFIG.cells, forest, CONFIG.squares)
        self._settled = -np.inf
        self._steps = 0
        self.rows: list[NDArray[np.float64]] = []
        self.walls: list[NDArray[np.float64]] = []

    def __call__(self, step: Step) -> None:
        """Take in a control step."""
        view = step.view
        self._steps += 1
        if view is None or view.truth is None or view.recent is None or self._steps % EVERY:
            return
        if view.recent.settled <= self._settled:
            return
        points, ages, span = view.recent.since(self._settled)
        self._settled = view.recent.settled
        here, yaw, true = view.odometry.position[:2], view.odometry.yaw, view.truth.pose
        self._tiles.describe(points, here, ages)
        self._features.describe(self._tiles, here, span)
        due = self._features.due
        values = self._features.values[due]
        squares = self._forest.odds(self._features.values, self._features.places, due)
        x, y = (0.2 * self._features.places[due] + 0.1 - here).T
        bearing = np.arctan2(y, x) - yaw
        sector = np.floor((bearing / (2 * np.pi) + 1.5) * self._grid.n_sectors).astype(int)
        ring = np.searchsorted(self._grid.ring_edges, np.hypot(x, y), side="right") - 1
        ring = np.minimum(ring, self._grid.n_rings - 1)  # Squares reach as far as the last one.
        cells = view.scan.odds_of(self._grid)[sector % self._grid.n_sectors, ring]
        red, clearance = forbidden(self._truth, moved(x, y, true.yaw - yaw) + true.position[:2])
        far = values[:, GROUND_FEATURES.index("range")]
        self.rows.append(np.stack([far, red, clearance, cells, squares], axis=1))
        self._map.take(self._tiles, here, span)
        reach = int(MAP_BANDS[-1][1] / 0.2) + 1
        around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
        places = around + self._map.centre
        odds = self._map.odds[tuple((places & (CONFIG.cells - 1)).T)]
        x, y = (0.2 * places[odds != 0] + 0.1 - here).T
        red, clearance = forbidden(self._truth, moved(x, y, true.yaw - yaw) + true.position[:2])
        self.walls.append(np.stack([np.hypot(x, y), red, clearance, odds[odds != 0]], axis=1))


def moved(x: NDArray[np.float64], y: NDArray[np.float64], turn: float) -> NDArray[np.float64]:
    """Return places turned about the origin [m], shape (n, 2)."""
    c, s = np.cos(turn), np.sin(turn)
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def forbidden(
    truth: TraversabilityMap, places: NDArray[np.float64]
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Return which squares have a forbidden quarter, and the clearance of their middles [m]."""
    red = np.zeros(len(places), dtype=bool)
    for u in (-0.05, 0.05):
        for v in (-0.05, 0.05):
            red |= truth.reason_at(places[:, 0] + u, places[:, 1] + v) != Reason.FREE
    return red, truth.clearance_at(places[:, 0], places[:, 1]).astype(float)


def main() -> None:
    """Drive, watch and print."""
    preset = sys.argv[1] if len(sys.argv) > 1 else "natural-test"
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 7050
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 6
    forest = (
        GroundClassifier.load(Path(sys.argv[4]))
        if len(sys.argv) > 4
        else shipped_ground_classifier()
    )
    config = SimulatedRobotConfig(plant="kinematic")
    rows, walls = [], []
    for seed in range(first, first + count):
        scene = SceneCache().get(preset, seed)
        controller = make_controller("learned", scene.world, config)
        simulated_robot = SimulatedRobot(scene, config, shipped_forest(), controller)
        watcher = Watcher(scene.world, config.grid, forest)
        simulated_robot.navigator.watch(watcher)
        run_trial(
            simulated_robot,
            scene.world.tasks[0],
            TerminationConfig(),
            np.random.default_rng([seed, 1]),
        )
        simulated_robot.close()
        rows += watcher.rows
        walls += watcher.walls
    table = np.concatenate(rows)
    judged = table[np.isfinite(table[:, 3])]
    lean = np.log(CONFIG.squares.miss)
    sys.stdout.write(f"{len(table)} squares, {len(judged)} of them in cells that were judged\n")
    for near, end in (*BANDS, (BANDS[0][0], BANDS[-1][1])):
        some = judged[(judged[:, 0] >= near) & (judged[:, 0] < end)]
        red, clear = some[:, 1] > 0, some[:, 2] > 0.3
        for name, odds in (("polar cells", some[:, 3]), ("squares", some[:, 4] + lean)):
            sys.stdout.write(
                f"{near} to {end} m, {name}: average precision "
                f"{average_precision_score(red, odds):.3f}, AUC {roc_auc_score(red, odds):.3f}; "
                f"called red: {(odds[red] > 0).mean():.3f} of the red ones, "
                f"{(odds[clear] > 0).mean():.4f} of those with 0.3 m of clearance\n"
            )
    table = np.concatenate(walls)
    for near, end in MAP_BANDS:
        some = table[(table[:, 0] >= near) & (table[:, 0] < end)]
        red, clear = some[:, 1] > 0, (some[:, 1] == 0) & (some[:, 2] > 0.3)
        wall = some[:, 3] > WALL
        sys.stdout.write(
            f"{near} to {end} m, the map: walls are {wall[red].mean():.3f} of the red squares, "
            f"{wall[clear].mean():.4f} of those with 0.3 m of clearance\n"
        )


if __name__ == "__main__":
    main()
