"""Driving by hand: a controller that does what the keys say, with the planner's map kept alive."""

import threading

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput, Planner, Steering
from andabata.navigation.planning.cartesian_layers import CartesianLayers

BY_HAND = "by hand"
"""Name of the controller."""

_HELD = 8
"""Number of control steps for which a key counts without being pressed again: a keyboard repeats a
held key after half a second, and a page that has gone repeats nothing."""

_KEYS = {"forward": (1, 0), "back": (-1, 0), "left": (0, 1), "right": (0, -1)}
"""Signs of speed and yaw rate by the name of a key."""


class HandController:
    """Drives as the keys say, and stands when none is held.

    Keys may be pressed from any thread.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Begin at rest.

        Args:
            robot: Speed and steering limit.
        """
        self._robot, self._lock = robot, threading.Lock()
        self._left: dict[str, int] = {}

    def press(self, key: str) -> None:
        """Hold a key for the next control steps.

        Args:
            key: ``forward``, ``back``, ``left`` or ``right``.

        Raises:
            ValueError: If it is none of them.
        """
        if key not in _KEYS:
            raise ValueError(f"key: expected {', '.join(_KEYS)}, got {key!r}")
        with self._lock:
            self._left[key] = _HELD

    def release(self) -> None:
        """Let all keys go."""
        with self._lock:
            self._left.clear()

    def reset(self) -> None:
        """There is nothing to forget: keys that are held when it takes over count."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return the twist of the keys that are held."""
        with self._lock:
            speed = sum(_KEYS[key][0] for key in self._left)
            turn = sum(_KEYS[key][1] for key in self._left)
            self._left = {key: left - 1 for key, left in self._left.items() if left > 1}
        return Twist(speed * self._robot.speed, turn * self._robot.max_steering)


class Onlooker:
    """Planner that looks on: another one goes on with its map and plan, and commands pass.

    Attributes:
        planner: The other one.
    """

    def __init__(self, planner: Planner, every: int) -> None:
        """Take the planner that led before.

        Args:
            planner: Planner.
            every: Number of control steps between two scans that it expects.
        """
        self.planner = planner
        self._every, self._calls = every, 0

    def reset(self) -> None:
        """Forget what the planner remembers."""
        self.planner.reset()

    def guide(self, situation: ControllerInput, layers: CartesianLayers | None) -> ControllerInput:
        """Show the planner one situation in several, and return the situation as it is."""
        if self._calls % self._every == 0:
            self.planner.guide(situation, layers)
        self._calls += 1
        return situation

    def select(self, situation: ControllerInput, command: Twist) -> Twist:
        """Return the command as it is."""
        return command


def by_hand(controller: HandController, before: Steering) -> Steering:
    """Return the steering by hand, with the map of the steering before.

    Args:
        controller: Controller that the keys go to.
        before: Steering so far.
    """
    planner = led_by(before.planner)
    return Steering(controller, Onlooker(planner, before.action_repeat))


def led_by(planner: Planner) -> Planner:
    """Return a planner itself, or the one that an onlooker shows situations to."""
    return planner.planner if isinstance(planner, Onlooker) else planner
