"""Worlds with walkers that tests place by hand."""

from dataclasses import replace

import numpy as np

from worlds.rooms.movers import Behaviour, Mover, MoverPlan


def walker(place, velocity=(0.0, 0.0), radius=0.25, height=1.7, **plan):
    """Return a walker at a place [m] with a velocity [m/s]."""
    speed = (velocity[0] ** 2 + velocity[1] ** 2) ** 0.5
    return Mover(place, velocity, MoverPlan(radius=radius, height=height, speed=speed, **plan))


def agent(kind, place, velocity=(0.0, 0.0), speed=1.0, radius=0.25, **behaviour):
    """Return a person, an animal or a vehicle at a place [m], with its usual speed [m/s]."""
    plan = MoverPlan(radius=radius, height=1.7, speed=speed)
    return Mover(place, velocity, plan, Behaviour(kind=kind, **behaviour))


def heading_east(place=(-4.0, 0.0), **behaviour):
    """Return a person whose first place to go is the middle of the eastern border."""
    return agent("person", place, (1.0, 0.0), seed=_seed(0.97, 1.0), **behaviour)


def heading_west(place=(4.0, 0.0), **behaviour):
    """Return a person whose first place to go is the middle of the western border."""
    return agent("person", place, (-1.0, 0.0), seed=_seed(0.0, 0.03), **behaviour)


def _seed(low, high):
    """Return a seed whose first random numbers are within bounds, and near a half."""
    draws = ((seed, np.random.default_rng(seed).random(2)) for seed in range(10_000))
    return next(seed for seed, (x, y) in draws if low <= x <= high and abs(y - 0.5) < 0.02)


def peopled(world, *walkers):
    """Return a world with walkers in it."""
    return replace(world, movers=walkers)
