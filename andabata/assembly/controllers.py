"""Controllers by name, for the command line and the judges."""

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.models import Models, shipped_policy
from andabata.navigation.controller import Controller
from andabata.navigation.guided import GuidedController
from andabata.navigation.learned import LearnedController
from andabata.navigation.oracle import OracleController
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import AROUND, TrajectoryRollouts
from andabata.navigation.reactive import ReactiveController, StraightController
from worlds.world import World

BLIND_CONTROLLERS = (
    "learned",
    "actor-critic",
    "reactive",
    "straight",
    "learned-map",
    "reactive+map",
    "straight+map",
)
"""Those that need no true map, and each of them without or with a local map of its own."""

CONTROLLERS = (*BLIND_CONTROLLERS, "oracle")


def make_controller(
    name: str, world: World | None, config: SimulatedRobotConfig, models: Models | None = None
) -> Controller:
    """Return a controller.

    Args:
        name: One of ``CONTROLLERS``.
        world: The oracle's world; None for a recording or a real robot, where nobody knows it.
        config: The robot and grid that the controller works with.
        models: The learned controller's policy, and the squares of maps; None for the shipped ones.
            ``actor-critic`` always drives with the shipped policy of the paper's scheme, and
            without a map.

    Raises:
        ValueError: If there is no controller of that name.
    """
    known = CONTROLLERS if world is not None else BLIND_CONTROLLERS
    if name not in known:
        why = "; the oracle needs the true map" if name == "oracle" else ""
        raise ValueError(f"--controller: expected {', '.join(known)}, got {name!r}{why}")
    if name == "oracle" and world is not None:
        return OracleController(world, config.robot)
    models = models or Models()
    guided = name.endswith("+map") or name == "learned"
    controller: Controller
    match name.removesuffix("+map").removesuffix("-map"):
        case "learned":
            controller = LearnedController(models.policy)
        case "actor-critic":
            controller = LearnedController(shipped_policy("actor-critic"))
        case "reactive":
            controller = ReactiveController(config.robot, config.grid)
        case _:
            controller = StraightController()
    if guided:
        rollouts = TrajectoryRollouts(config.robot, config.rollouts)
        remembered = config.local_planner.looking_every(config.rollouts.hold)
        local_planner = LocalPlanner(
            config.grid, remembered, config.robot, AROUND, models.ground_classifier
        )
        controller = GuidedController(controller, local_planner, rollouts)
    return controller
