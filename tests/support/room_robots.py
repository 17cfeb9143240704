"""What tests of robots in rooms share: actions, drives, steps, terms of observations."""

import numpy as np

from worlds.rooms.room import RoomTask
from worlds.world import Start

AHEAD, STAND, SPIN = ([1.0, 0.0], [-1.0, 0.0], [-1.0, 1.0])


def drive(x, y, yaw, goal):
    """Return the options of a drive in the first room."""
    return {"room": 0, "drive": RoomTask(Start(x, y, yaw), goal)}


def step(env, *actions):
    """Drive all robots for a period."""
    return env.step(np.array(actions, dtype=np.float32))


def part(env, states, name):
    """Return one term of observations."""
    spec = env.config.observations
    return states[:, spec.slice_of(name)].reshape(-1, *spec.term(name).shape)
