"""Navigators on flat ground by name."""

from collections.abc import Callable

import numpy as np

from andabata.machine.planar_readings import PlanarNavigator
from andabata.machine.planar_vehicle import PlanarVehicleConfig
from andabata.navigation.planar.constant_arcs import ConstantArcsNavigator
from andabata.navigation.planar.dynamic_window import DynamicWindowConfig, DynamicWindowNavigator
from andabata.navigation.planar.follow_gap import FollowGapNavigator
from andabata.navigation.planar.mpc_navigator import MpcNavigator
from andabata.navigation.planar.null_navigators import RandomNavigator, StraightNavigator

Maker = Callable[[PlanarVehicleConfig, np.random.Generator], PlanarNavigator]
"""Function that makes a navigator for a robot, as far as it is known, and a source of draws."""

PLANAR_NAVIGATORS: dict[str, Maker] = {
    "arcs": lambda vehicle, _: ConstantArcsNavigator(vehicle),
    "dwa": lambda vehicle, _: DynamicWindowNavigator(vehicle),
    "dwa-goal": lambda vehicle, _: DynamicWindowNavigator(vehicle, DynamicWindowConfig(map=None)),
    "gap": lambda vehicle, _: FollowGapNavigator(vehicle),
    "mpc": MpcNavigator,
    "mpc-told": lambda vehicle, rng: MpcNavigator(vehicle, rng, is_told=True),
    "straight": lambda _, __: StraightNavigator(),
    "random": RandomNavigator,
}
"""Constant arcs with a time-to-go; the dynamic window, heading for sub-goals of a map or for the
goal; follow the gap; sampling MPC with dynamics that it identifies, or that it is told; and two
that see nothing."""
