"""Worlds with walkers that tests place by hand."""

from dataclasses import replace

from worlds.rooms.movers import Mover, MoverPlan


def walker(place, velocity=(0.0, 0.0), radius=0.25, height=1.7, **plan):
    """Return a walker at a place [m] with a velocity [m/s]."""
    speed = (velocity[0] ** 2 + velocity[1] ** 2) ** 0.5
    return Mover(place, velocity, MoverPlan(radius=radius, height=height, speed=speed, **plan))


def peopled(world, *walkers):
    """Return a world with walkers in it."""
    return replace(world, movers=walkers)
