"""What limits driving: the filter, what clouds show, what squares make of it, or the world?

Run with ``python -m tests.benchmarks.bench_sight [WORLD] [FIRST] [COUNT] [SIGHT ...]``: drives of
``learned`` to three goals in so many worlds from that seed on, in bullet, whole chain; sensors draw
their noise from the same seeds. They are driven as the robot does and, one thing at a time, with
its true pose, with true squares wherever a cloud shows one, with the true map as far as squares
reach, seen or not, and by the oracle. A square is red where the true map forbids a quarter of it.
"""

import sys
from collections import Counter
from functools import partial

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.engine import run_tasks
from andabata.evaluation.failure_cause import failure_cause
from andabata.evaluation.statistics import wilson_interval
from andabata.evaluation.trial import run_trial
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.models import shipped_forest
from andabata.navigation.guided import GuidedController
from andabata.navigation.planning.ground_layer import GroundLayer
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from tests.benchmarks.bench_squares import forbidden, moved
from traversability.cartesian.elevation_grid import EVER, ElevationGrid
from traversability.cartesian.features import NEAREST, REACH, SQUARE, GroundFeatures
from worlds.scenes import SceneCache

GOALS = 3
SIGHTS = ("as it is", "true pose", "true squares", "true map", "oracle")
KNOWN_POSE = SimulatedRobotConfig(
    localizer="truth",
    errors=NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0),
)


def know(simulated_robot: SimulatedRobot, squares: GroundLayer, unseen: bool) -> None:
    """Write the truth where squares are judged, or within their reach, seen or not."""
    features, config = GroundFeatures(), simulated_robot.config.local_planner.squares
    reach = int(REACH / simulated_robot.config.local_planner.cell) + 1
    around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)

    def take(
        tiles: ElevationGrid, here: NDArray[np.float64], span: tuple[float, float] = EVER
    ) -> None:
        squares.follow(here)
        places, edge = around + squares.centre, SQUARE * tiles.cell
        if not unseen:
            features.describe(tiles, here, span)
            places = features.places[features.due]
        middles = (places + 0.5) * edge - here
        far = np.hypot(*middles.T)
        near = (far >= NEAREST) & (far <= REACH)
        there, true = (
            simulated_robot.localizer.odometry,
            simulated_robot.simulator.vehicle.state.pose,
        )
        spots = moved(*middles[near].T, true.yaw - there.yaw) + true.position[:2]
        red, _ = forbidden(simulated_robot.scene.world.truth, spots)
        i, j = (places[near] & (len(squares.odds) - 1)).T
        squares.odds[i, j] = np.where(red, config.most, -config.most)

    squares.take = take  # type: ignore[method-assign]


def drive(sight: str, place: tuple[str, int]) -> tuple[list[float], str]:
    """Return the SPL of each goal that a drive reached in a row, and what ended it."""
    config = KNOWN_POSE if sight == "true pose" else SimulatedRobotConfig()
    scene = SceneCache().get(*place)
    law = "oracle" if sight == "oracle" else "learned"
    controller = make_controller(law, scene.world, config)
    simulated_robot = SimulatedRobot(scene, config, shipped_forest(), controller)
    if sight in ("true squares", "true map"):
        assert isinstance(controller, GuidedController)
        squares = controller.local_planner.evidence.squares
        assert squares is not None
        know(simulated_robot, squares, sight == "true map")
    rng = np.random.default_rng([place[1], 1])
    attempts = run_trial(simulated_robot, scene.world.tasks[0], TerminationConfig(), rng)
    simulated_robot.close()
    met = failure_cause(scene.world, attempts[-1].path[-1], attempts[-1].outcome)
    return [attempt.spl for attempt in attempts if attempt.outcome is Outcome.GOAL], str(
        met or attempts[-1].outcome
    )


def main() -> None:
    """Drive by each sight and print how many reached each goal in a row."""
    preset = sys.argv[1] if len(sys.argv) > 1 else "natural-test"
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 7200
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 30
    places = [(preset, seed) for seed in range(first, first + count)]
    for sight in sys.argv[4:] or SIGHTS:
        found = [end for _, end in run_tasks(partial(drive, sight), places, 2)]
        rates = [
            "{} [{:.2f}, {:.2f}]".format(n, *wilson_interval(n, count))
            for n in (sum(len(goals) > k for goals, _ in found) for k in range(GOALS))
        ]
        ends = Counter(end for goals, end in found if len(goals) < GOALS)
        ways = np.mean(np.concatenate([goals for goals, _ in found]))
        sys.stdout.write(f"{sight}: {', '.join(rates)} of {count}, SPL {ways:.3f}; {dict(ends)}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
