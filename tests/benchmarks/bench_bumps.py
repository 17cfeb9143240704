"""Small rocks beside the way: are they walls of the local map before the robot is there?

Run with ``python tests/benchmarks/bench_bumps.py [WORLD] [FIRST] [COUNT]``: drives of ``learned``
in so many worlds from that seed on, kinematic plant, watched by two maps, one with bumps and one
without. They are asked once for each rock of 3 to 25 cm, when its middle comes nearer than each
distance, and every 3 s for cells from 0.8 to 2 m away with more than 0.5 m of true clearance.
"""

import sys
from collections import defaultdict
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.models import shipped_forest, shipped_squares
from andabata.navigation.bumps import BumpsConfig
from andabata.navigation.local_map import LocalMap
from andabata.navigation.navigator import Step
from andabata.navigation.view import View
from andabata.tasks.controllers import make_controller
from andabata.tasks.judge import JudgeConfig
from andabata.tasks.rig import Rig, RigConfig
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.trial import run_trial
from terrain.classes import TRAITS
from worlds.world import World

DISTANCES = (2.8, 2.0, 1.4)
HEIGHTS = (0.03, 0.05, 0.07, 0.09, 0.13, 0.25)
NONE = BumpsConfig(rise=10.0)


class Watcher:
    """Feeds two maps with what the robot sees, and asks them."""

    def __init__(self, world: World, config: RigConfig) -> None:
        plain = config.local_map.model_copy(update={"bumps": NONE})
        squares = shipped_squares()
        self._maps = [
            LocalMap(config.grid, each, config.robot, squares=squares)
            for each in (config.local_map, plain)
        ]
        self._truth = world.truth
        self._rocks = small_rocks(world)
        self._asked: set[tuple[int, float]] = set()
        self._steps = 0
        self.known: dict[tuple[float, float], list[list[bool]]] = defaultdict(list)
        self.false = np.zeros(3)

    def __call__(self, step: Step) -> None:
        """Take in a control step."""
        view = step.view
        if view is None or view.truth is None:
            return
        for each in self._maps:
            each.guide(view)
        self._steps += 1
        here = view.truth.pose.position[:2]
        for k, (middle, height) in enumerate(self._rocks):
            for distance in DISTANCES:
                near = np.hypot(*(middle - here)) < distance
                if near and (k, distance) not in self._asked:
                    self._asked.add((k, distance))
                    answers = [
                        bool(walls(each, view, middle[None], 1).any()) for each in self._maps
                    ]
                    self.known[distance, height].append(answers)
        if self._steps % 30 == 0:
            x, y = here[:, None, None] + np.mgrid[-10:11, -10:11] * 0.2
            far = np.hypot(x - here[0], y - here[1])
            clear = (far > 0.8) & (far < 2.0) & (self._truth.clearance_at(x, y) > 0.5)
            places = np.stack([x[clear], y[clear]], axis=1)
            found = [walls(each, view, places, 0).sum() for each in self._maps]
            self.false += [len(places), *found]


def small_rocks(world: World) -> list[tuple[NDArray[np.float64], float]]:
    """Return the middle, shape (2,), and the height [m] of each small solid thing."""
    found = []
    for thing in world.objects:
        traits = TRAITS[thing.semantic]
        low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
        middle = ((low + high) / 2)[:2]
        height = float(high[2] - world.ground.height_at(middle[0], middle[1]))
        small = HEIGHTS[0] < height < HEIGHTS[-1] and (high - low)[:2].max() < 0.6
        if traits.solid and not traits.traversable and small:
            found.append((middle, height))
    return found


def walls(
    local_map: LocalMap, view: View, places: NDArray[np.float64], around: int
) -> NDArray[np.bool_]:
    """Return whether places of the true map, shape (n, 2), are walls, or cells around them."""
    assert view.truth is not None
    there, true = view.odometry, view.truth.pose
    local_map.subgoal(there.position[:2], there.position[:2] + 5.0)
    turn = there.yaw - true.yaw
    c, s = np.cos(turn), np.sin(turn)
    dx, dy = (places - true.position[:2]).T
    spots = np.stack([c * dx - s * dy, s * dx + c * dy], axis=1) + there.position[:2]
    i, j = np.floor((spots - local_map.plan.corner) / local_map.config.cell).astype(int).T
    found = np.zeros(len(places), dtype=bool)
    for a in range(-around, around + 1):
        for b in range(-around, around + 1):
            found |= local_map.plan.gaps[i + a, j + b] == 0
    return found


def main() -> None:
    """Drive, watch and print."""
    preset = sys.argv[1] if len(sys.argv) > 1 else "natural-far"
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 5200
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 20
    config = RigConfig(plant="kinematic")
    known: dict[tuple[float, float], list[list[bool]]] = defaultdict(list)
    false = np.zeros(3)
    for seed in range(first, first + count):
        scene = SceneShelf().get(preset, seed)
        controller = make_controller("learned", scene.world, config)
        rig = Rig(scene, config, shipped_forest(), controller)
        watcher = Watcher(scene.world, config)
        rig.navigator.watch(watcher)
        run_trial(rig, scene.world.tasks[0], JudgeConfig(), np.random.default_rng([seed, 1]))
        rig.close()
        for key, answers in watcher.known.items():
            known[key] += answers
        false += watcher.false
    for distance in DISTANCES:
        for low, high in pairwise(HEIGHTS):
            rows = np.array(
                [
                    a
                    for (d, h), all_ in known.items()
                    for a in all_
                    if d == distance and low <= h < high
                ]
            ).reshape(-1, 2)
            sys.stdout.write(
                f"{distance} m, rocks of {low} to {high} m: {len(rows)}; walls with bumps "
                f"{rows[:, 0].sum()}, without {rows[:, 1].sum()}\n"
            )
    sys.stdout.write(
        f"clear cells {false[0]:.0f}: walls with bumps {false[1] / false[0]:.4f}, "
        f"without {false[2] / false[0]:.4f}\n"
    )


if __name__ == "__main__":
    main()
