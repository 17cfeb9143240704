"""Navigators on flat ground by name."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from andabata.machine.planar.readings import PlanarNavigator
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.constant_arcs import ConstantArcsNavigator
from andabata.navigation.planar.distilled_navigator import DistilledNavigator
from andabata.navigation.planar.dynamic_window import DynamicWindowConfig, DynamicWindowNavigator
from andabata.navigation.planar.follow_gap import FollowGapNavigator
from andabata.navigation.planar.mpc_navigator import WITH_MOVERS, WITH_TRUE_MOVERS, MpcNavigator
from andabata.navigation.planar.null_navigators import RandomNavigator, StraightNavigator
from andabata.own_code import is_own, load_own

SHIPPED = "distilled"
"""Name of the policy that comes with the package, distilled from the sampling MPC."""

Maker = Callable[[PlanarVehicleConfig, np.random.Generator], PlanarNavigator]
"""Function that makes a navigator for a robot, as far as it is known, and a source of draws."""


def _distilled(
    vehicle: PlanarVehicleConfig, has_shield: bool, file: Path | None = None
) -> DistilledNavigator:
    """Return a navigator with the policy of a file, None for the shipped one."""
    from andabata.models import shipped_policy
    from rl.policy import load_policy

    policy = shipped_policy(SHIPPED) if file is None else load_policy(file)
    return DistilledNavigator(vehicle, policy, has_shield, str(file or SHIPPED))


DISTILLED = {"distilled": False, "distilled+shield": True}
"""Names of the navigators that drive by a policy, and whether behind a brake shield."""

PLANAR_NAVIGATORS: dict[str, Maker] = {
    "arcs": lambda vehicle, _: ConstantArcsNavigator(vehicle),
    "dwa": lambda vehicle, _: DynamicWindowNavigator(vehicle),
    "dwa-goal": lambda vehicle, _: DynamicWindowNavigator(vehicle, DynamicWindowConfig(map=None)),
    "gap": lambda vehicle, _: FollowGapNavigator(vehicle),
    "mpc": MpcNavigator,
    "mpc-told": lambda vehicle, rng: MpcNavigator(vehicle, rng, are_dynamics_known=True),
    "mpc-movers": lambda vehicle, rng: MpcNavigator(vehicle, rng, WITH_MOVERS),
    "mpc-true-movers": lambda vehicle, rng: MpcNavigator(vehicle, rng, WITH_TRUE_MOVERS),
    "distilled": lambda vehicle, _: _distilled(vehicle, has_shield=False),
    "distilled+shield": lambda vehicle, _: _distilled(vehicle, has_shield=True),
    "straight": lambda _, __: StraightNavigator(),
    "random": RandomNavigator,
}
"""Constant arcs with a time-to-go; the dynamic window, heading for sub-goals of a map or for the
goal; follow the gap; sampling MPC with dynamics that it identifies, or that are known, or one that
identifies them and follows what moves, or is told it, an upper bound; the policy that was distilled
from it, alone or behind a brake shield; and two that see nothing."""


def planar_navigator(
    name: str,
    vehicle: PlanarVehicleConfig,
    rng: np.random.Generator,
    policy: Path | None = None,
) -> PlanarNavigator:
    """Return a navigator by its name.

    Args:
        name: Name in ``PLANAR_NAVIGATORS``, or the file and name of a class of the user's own that
            is made with the same two and is a ``PlanarNavigator``.
        vehicle: Robot, as far as it is known.
        rng: Source of draws.
        policy: File of the policy of those that drive by one, None for the shipped one.

    Raises:
        ValueError: If the file is no policy, or not a distilled one.
        OSError: If it cannot be read.
        OwnCodeError: If the user's own cannot be used.
    """
    if policy is not None and name in DISTILLED:
        return _distilled(vehicle, DISTILLED[name], policy)
    if is_own(name):
        made: PlanarNavigator = load_own(name, ("reset", "act"))(vehicle, rng)
        return made
    return PLANAR_NAVIGATORS[name](vehicle, rng)
