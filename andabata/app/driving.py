"""One drive, from a world's name to a path."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.senses import Senses
from andabata.models import shipped_forest
from andabata.tasks.controllers import make_controller
from andabata.tasks.judge import JudgeConfig, Outcome
from andabata.tasks.rig import Rig, RigConfig
from andabata.tasks.scenes import SceneShelf
from andabata.tasks.seeds import evaluation_world
from andabata.tasks.trial import Leg, run_trial
from rl.policy import Policy
from traversability.cloud import PointCloud
from traversability.forest import Forest
from worlds.world import Task, World


@dataclass(frozen=True)
class Driven:
    """A finished drive.

    Attributes:
        world: Where.
        task: Start and goals.
        controller: Who drove.
        legs: A drive to each goal that was tried.
        cloud: The last levelled cloud around the robot, None with the horizontal scanner.
    """

    world: World
    task: Task
    controller: str
    legs: tuple[Leg, ...]
    cloud: PointCloud | None

    @property
    def path(self) -> NDArray[np.float64]:
        """All positions [m], shape (k, 3)."""
        return np.concatenate([leg.path for leg in self.legs])

    @property
    def title(self) -> str:
        """One line about it."""
        reached = sum(leg.outcome is Outcome.GOAL for leg in self.legs)
        return (
            f"{self.controller} in {self.world.name} {self.world.seed}: {reached} of "
            f"{len(self.task.goals)} goals"
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the drive, ready for JSON."""
        return {
            "controller": self.controller,
            "world": self.world.name,
            "world_seed": self.world.seed,
            "goals": [list(goal) for goal in self.task.goals],
            "success": self.legs[-1].outcome is Outcome.GOAL
            and len(self.legs) == len(self.task.goals),
            "legs": [
                {
                    "goal": leg.goal,
                    "outcome": str(leg.outcome),
                    "time_s": leg.time,
                    "distance_m": leg.distance,
                    "shortest_m": leg.shortest,
                    "spl": leg.spl,
                    "trespass_m": leg.trespass,
                    "min_clearance_m": leg.min_clearance,
                }
                for leg in self.legs
            ],
            "path": np.round(self.path, 3).tolist(),
        }


def drive_once(
    world: str,
    seed: int,
    controller: str,
    config: RigConfig,
    forest: Forest | None = None,
    policy: Policy | None = None,
    on_second: Callable[[], None] | None = None,
) -> Driven:
    """Visit the goals of a world's first task.

    Args:
        world: Preset.
        seed: Of the drive; its world is one of the judges', that nothing trains on.
        controller: By name.
        config: The robot.
        forest: Cell classifier; None for the shipped one.
        policy: The learned controller's; None for the shipped one.
        on_second: Called after each simulated second.
    """
    scene = SceneShelf(1).get(world, evaluation_world(seed, 0))
    driver = make_controller(controller, scene.world, config, policy)
    rig = Rig(scene, config, forest or shipped_forest(), driver)
    task = scene.world.tasks[0]

    def on_step(senses: Senses) -> None:
        if on_second is not None and round(senses.stamp * 10) % 10 == 0:
            on_second()

    legs = run_trial(rig, task, JudgeConfig(), np.random.default_rng([seed, 0, 1]), on_step)
    cloud = rig.last_cloud()
    rig.close()
    return Driven(scene.world, task, controller, legs, cloud)
