"""The ground around a robot as a body of the physics.

pybullet takes seconds to read a heightfield that is fine enough for a wheel over a hundred metres.
The robot feels what lies within a step of it: the body is a window, made anew as the robot drives.
"""

from andabata.machine.ground_window import ground_around, has_left
from terrain.heightfield import Heightfield
from worlds.bodies import build_ground
from worlds.quiet_pybullet import pybullet


class GroundWindow:
    """A heightfield in a physics client that follows the robot."""

    def __init__(self, ground: Heightfield, client: int) -> None:
        """Take the whole ground; the first window lies in its middle.

        Args:
            ground: The whole ground.
            client: Identifier of the physics client.
        """
        self._ground = ground
        self._client = client
        self._middle, self.body = (0.0, 0.0), -1
        self._make(0.0, 0.0)

    def follow(self, x: float, y: float) -> bool:
        """Make a new window if the robot comes too near to the end of the old one.

        Args:
            x: Map x of the robot [m].
            y: Map y of the robot [m].

        Returns:
            True if ``body`` is another one than before.
        """
        if not has_left(self._middle, x, y):
            return False
        pybullet.removeBody(self.body, physicsClientId=self._client)
        self._make(x, y)
        return True

    def _make(self, x: float, y: float) -> None:
        """Create the window around a place in the map [m]; it ends at the ground's border."""
        part, middle = ground_around(self._ground, x, y)
        self._middle = (x, y)
        self.body = build_ground(part, middle, self._client)
        pybullet.changeDynamics(self.body, -1, lateralFriction=1.0, physicsClientId=self._client)
