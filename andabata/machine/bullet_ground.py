"""The ground around a robot as a body of the physics.

pybullet takes seconds to read a heightfield that is fine enough for a wheel over a hundred metres.
The robot feels what lies within a step of it: the body is a window, made anew as the robot drives.
"""

import numpy as np

from terrain.heightfield import Heightfield
from worlds.bodies import build_ground
from worlds.quiet_pybullet import pybullet

_REACH = 8.0
"""Distance from its middle up to which a window holds the ground [m]."""

_KEPT = 4.0
"""Distance from the middle of its window up to which a robot may drive [m]."""


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
        if max(abs(x - self._middle[0]), abs(y - self._middle[1])) <= _KEPT:
            return False
        pybullet.removeBody(self.body, physicsClientId=self._client)
        self._make(x, y)
        return True

    def _make(self, x: float, y: float) -> None:
        """Create the window around a place in the map [m]; it ends at the ground's border."""
        ground = self._ground
        spans = []
        for place, half, count in zip(
            (x, y), (ground.width / 2, ground.depth / 2), ground.heights.shape, strict=True
        ):
            first = int(np.clip((place + half - _REACH) / ground.cell, 0, count - 2))
            last = int(
                np.clip(np.ceil((place + half + _REACH) / ground.cell), first + 1, count - 1)
            )
            spans.append((first, last, (first + last) / 2 * ground.cell - half))
        (i, k, middle_x), (j, n, middle_y) = spans
        part = Heightfield(np.ascontiguousarray(ground.heights[i : k + 1, j : n + 1]), ground.cell)
        self._middle = (x, y)
        self.body = build_ground(part, (middle_x, middle_y), self._client)
        pybullet.changeDynamics(self.body, -1, lateralFriction=1.0, physicsClientId=self._client)
