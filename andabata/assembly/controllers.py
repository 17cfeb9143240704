"""Controllers by name: what steers, alone or with the local planner around it."""

from collections.abc import Callable, Sequence

import numpy as np

from andabata.assembly.prior_map import make_prior_map
from andabata.assembly.simulated_robot import SimulatedRobotConfig, at_world
from andabata.localization.noisy_ground_truth import NoisyGroundTruthConfig
from andabata.models import Models, shipped_policy
from andabata.navigation.controller import Controller, Steering
from andabata.navigation.map_observation import check_map_policy, sees_map
from andabata.navigation.null_controllers import AwayController, RandomController
from andabata.navigation.oracle import OracleController
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.policy_controller import PolicyController
from andabata.navigation.reactive import ReactiveController, StraightController
from andabata.own_code import is_own, load_own
from rl.policy import Policy
from worlds.world import World

_Make = Callable[[SimulatedRobotConfig, np.random.Generator], Controller]

_MAKERS: dict[str, _Make] = {
    "reactive": lambda config, rng: ReactiveController(config.robot, config.grid),
    "straight": lambda config, rng: StraightController(config.robot.speed),
    "random": lambda config, rng: RandomController(config.robot, rng),
    "away": lambda config, rng: AwayController(config.robot),
}
"""Makers of the controllers that need neither the true map nor a policy."""

_SHIPPED = ("actor-critic", "imitation")
"""Controllers that drive by the shipped policy of their name, whatever the models say."""

_WITH_PLANNER = {
    "policy+planner": "policy",
    "imitation+planner": "imitation",
    "planner": "straight",
    "reactive+planner": "reactive",
    "random+planner": "random",
    "away+planner": "away",
}
"""Controller inside of each that has the local planner around it. ``planner`` heads straight for
the sub-goals: what is left is the planner's."""

MAPLESS_CONTROLLERS = (
    *("policy+planner", "policy", "imitation+planner", "imitation", "actor-critic", "planner"),
    *("reactive", "reactive+planner", "straight", "random+planner", "away+planner"),
)
"""Names of the controllers that need no true map."""

_PLANNER = "+planner"
"""End of the name of a controller with the local planner around it."""

DEFAULT_CONTROLLER = "planner"
"""Steers where none is named: no policy that is shipped arrives more often inside the planner."""

_POLICY_CONTROLLER = "policy+planner"
"""Steers where a policy is named, and no controller."""

_WITH_POLICY = ("policy", _POLICY_CONTROLLER)
"""Names of the controllers that drive by the policy of ``Models``."""

ORACLE = "oracle"
"""Name of the upper bound."""

CONTROLLERS = (*MAPLESS_CONTROLLERS, ORACLE)
"""Names of all controllers."""

_NO_ERRORS = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)


def driven_robot(name: str, config: SimulatedRobotConfig) -> SimulatedRobotConfig:
    """Return the robot that a controller drives: that of the oracle knows its true pose.

    Else a filter that is lost would stop the upper bound.
    """
    if name != ORACLE:
        return config
    return config.model_copy(update={"localizer": "truth", "errors": _NO_ERRORS})


def default_controller(models: Models) -> str:
    """Return the controller where none is named: one with a policy if it is the user's own."""
    return DEFAULT_CONTROLLER if models.policy is shipped_policy() else _POLICY_CONTROLLER


def refuse_unused_policy(names: Sequence[str], models: Models, option: str) -> None:
    """Refuse a policy of the user's own that no controller drives by.

    Args:
        names: Names of the controllers.
        models: Models of the robot.
        option: Option that names controllers, for the error.

    Raises:
        ValueError: If none of them drives by the policy.
    """
    is_used = any(name in _WITH_POLICY or is_own(name) for name in names)
    if models.policy is not shipped_policy() and not is_used:
        raise ValueError(
            f"--policy: expected a controller that drives by it, got {', '.join(names)}; add "
            f"`{option} {_POLICY_CONTROLLER}`, or leave --policy out"
        )


def make_steering(
    name: str,
    world: World | None,
    config: SimulatedRobotConfig,
    models: Models | None = None,
    rng: np.random.Generator | None = None,
) -> Steering:
    """Return a controller, with its planner where the name has one.

    Args:
        name: One of ``CONTROLLERS``, or the file and name of a class of the user's own, with
            ``+planner`` behind it for one with the local planner around it: it is made with the
            settings of the robot and a source of randomness, and is a ``Controller``.
        world: World of the oracle and of a prior map; None for a recording or a real robot, where
            it is not known.
        config: Robot, grid and planner.
        models: Policy of ``policy``; None for the shipped one. ``actor-critic`` and ``imitation``
            always drive with the shipped policy of their name.
        rng: Noise of ``random+planner``; None for a fixed seed.

    Raises:
        ValueError: If there is no controller of that name.
        OwnCodeError: If the user's own cannot be used.
    """
    known = CONTROLLERS if world is not None else MAPLESS_CONTROLLERS
    if name not in known and not is_own(name):
        why = "; the oracle needs the true map: name another" if name == ORACLE else ""
        expected = f"{', '.join(known)} or FILE.py:NAME"
        raise ValueError(f"--controller: expected {expected}, got {name!r}{why}")
    if name == ORACLE and world is not None:
        oracle = OracleController(world, config.robot, config.local_planner, config.rollouts)
        return Steering(oracle, action_repeat=config.rollouts.action_repeat, knows_truth=True)
    inner = name.removesuffix(_PLANNER) if is_own(name) else _WITH_PLANNER.get(name, name)
    policy = _policy(inner, models or Models())
    controller = _inner(inner, config, policy, rng or np.random.default_rng(0))
    # A policy that sees the map has it from the planner, whose rollouts check it, or do nothing.
    has_map = policy is not None and sees_map(policy.observations)
    if policy is not None and has_map:
        check_map_policy(policy, config.robot)
    if inner == name and not has_map:
        held = controller.repeat if isinstance(controller, PolicyController) else 1
        return Steering(controller, action_repeat=held)
    repeat = config.rollouts.action_repeat
    settings = config.local_planner.decimated(repeat)
    planner = LocalPlanner(
        config.grid,
        settings,
        config.robot,
        None if inner == name else config.rollouts,
        config.arrival.distance,
        make_prior_map(config if world is None else at_world(config, world), world),
        only_checks=has_map,
    )
    return Steering(controller, planner, repeat)


def _policy(name: str, models: Models) -> Policy | None:
    """Return the policy of a controller without a planner around it, None where it has none."""
    if name in _SHIPPED:
        return shipped_policy(name)
    return models.policy if name == "policy" else None


def _inner(
    name: str, config: SimulatedRobotConfig, policy: Policy | None, rng: np.random.Generator
) -> Controller:
    """Return a controller without a planner around it."""
    if policy is not None:
        return PolicyController(policy, config.robot.speed)
    if not is_own(name):
        return _MAKERS[name](config, rng)
    made: Controller = load_own(name, ("reset", "act"))(config, rng)
    return made
