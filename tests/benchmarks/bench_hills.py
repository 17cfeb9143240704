"""How far away does the robot's map know ground that is too steep, and what does it make up?

Run with ``python -m tests.benchmarks.bench_hills [WORLD] [FIRST] [COUNT]``: drives of ``learned``
to one goal each in so many worlds from that seed on, kinematic plant, whole chain. Every 10 s each
patch of the hills is held against the true map: steep where a slope forbids more than half of it,
free where nothing forbids a tenth.
"""

import sys
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.app.workers import run_tasks
from andabata.machine.senses import Senses
from andabata.models import shipped_forest
from andabata.navigation.guided import GuidedController
from andabata.tasks.controllers import make_controller
from andabata.tasks.judge import JudgeConfig
from andabata.tasks.rig import Rig, RigConfig
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.trial import run_trial
from worlds.truth import Reason

BANDS = (8.0, 10.0, 13.0, 16.0, 20.0, 25.0)
EVERY = 100
"""Control steps between two questions."""


class Asker:
    """Asks the map that steers a robot."""

    def __init__(self, rig: Rig, controller: GuidedController) -> None:
        self._rig = rig
        self._evidence = controller.local_map.evidence
        self._steps = 0
        self.rows: list[NDArray[np.float64]] = []

    def __call__(self, senses: Senses) -> None:
        """Ask after a control step."""
        self._steps += 1
        if self._steps % EVERY:
            return
        hills, world = self._evidence.hills, self._rig.scene.world
        steep, cells = hills.side
        edge, last = cells * self._evidence.config.cell, len(steep) - 1
        reach = int(BANDS[-1] / edge) + 1
        around = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
        patches = around + hills.centre
        there, true = self._rig.localizer.odometry, self._rig.simulator.vehicle.state.pose
        middles = (patches + 0.5) * edge - there.position[:2]
        c, s = np.cos(true.yaw - there.yaw), np.sin(true.yaw - there.yaw)
        slope, forbidden = np.zeros(len(patches)), np.zeros(len(patches))
        parts = (np.arange(5) - 2) * edge / 5
        for part in np.stack(np.meshgrid(parts, parts), axis=-1).reshape(-1, 2):
            dx, dy = (middles + part).T
            x, y = true.position[0] + c * dx - s * dy, true.position[1] + s * dx + c * dy
            reason = world.truth.reason_at(x, y)
            slope += (reason == Reason.SLOPE) / len(parts) ** 2
            forbidden += (reason != Reason.FREE) / len(parts) ** 2
        known = steep[tuple((patches & last).T)]
        self.rows.append(np.column_stack([np.hypot(*middles.T), known, slope, forbidden]))


def drive(config: RigConfig, place: tuple[str, int]) -> list[NDArray[np.float64]]:
    """Drive in the world of a preset and seed."""
    scene = SceneShelf().get(*place)
    controller = make_controller("learned", scene.world, config)
    assert isinstance(controller, GuidedController)
    rig = Rig(scene, config, shipped_forest(), controller)
    asker = Asker(rig, controller)
    task = scene.world.tasks[0]
    run_trial(rig, task, JudgeConfig(), np.random.default_rng([place[1], 1]), asker)
    rig.close()
    return asker.rows


def main() -> None:
    """Drive, ask and print."""
    preset = sys.argv[1] if len(sys.argv) > 1 else "natural-test"
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 7200
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 12
    places = [(preset, seed) for seed in range(first, first + count)]
    work = partial(drive, RigConfig(plant="kinematic"))
    rows = np.concatenate([row for _, rows in run_tasks(work, places, 2) for row in rows])
    for near, end in pairwise(BANDS):
        _, known, slope, forbidden = rows[(rows[:, 0] >= near) & (rows[:, 0] < end)].T
        steep, free = slope > 0.5, forbidden < 0.1
        sys.stdout.write(
            f"{near:g} to {end:g} m: steep are {known[steep].mean():.2f} of {steep.sum()} patches "
            f"that are, {known[free].mean():.3f} of {free.sum()} that are free\n"
        )


if __name__ == "__main__":
    main()
