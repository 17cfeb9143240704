"""Scans of a circle that moves in a bare square room, as tests of tracks and shields take them."""

import numpy as np

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch
from worlds.rooms.room import Room, RoomPlan

LASER = PlanarLidarConfig(resolution_deg=1.0, max_range=10.0)
PERIOD = 0.1
RADIUS = 0.3
"""Radius of the circle [m]."""


class Scanner:
    """Takes scans, with the circle at any place or away."""

    def __init__(self, lidar=LASER, half=5.0):
        """Build a square room of twice ``half`` [m]."""
        room = Room.of("bare", RoomPlan.model_validate({"about": "test", "half": (half, half)}))
        self._batch = RoomBatch(1, [room], DiscRobotConfig(), lidar, movers=1)

    def __call__(self, place, pose=(0.0, 0.0, 0.0)):
        """Return the ranges from a pose of the robot; no place leaves the circle away."""
        movers = self._batch.movers
        movers.radii[:] = 0.0 if place is None else RADIUS
        if place is not None:
            movers.places[0, 0] = place
        self._batch.motions[0, :3] = pose
        self._batch.observe(np.ones(1, dtype=np.bool_))
        return 1.0 / self._batch.reciprocals[0].astype(np.float64)


def straight(count, start, velocity):
    """Return places along a line, one a period."""
    return [tuple(np.array(start) + k * PERIOD * np.array(velocity)) for k in range(count)]
