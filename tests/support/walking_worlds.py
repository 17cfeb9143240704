"""Worlds with walkers that tests place by hand."""

from dataclasses import replace

from worlds.rooms.movers import Behaviour, Mover, MoverPlan


def walker(place, velocity=(0.0, 0.0), radius=0.25, height=1.7, **plan):
    """Return a walker at a place [m] with a velocity [m/s]."""
    speed = (velocity[0] ** 2 + velocity[1] ** 2) ** 0.5
    return Mover(place, velocity, MoverPlan(radius=radius, height=height, speed=speed, **plan))


def agent(kind, place, velocity=(0.0, 0.0), speed=1.0, radius=0.25, **behaviour):
    """Return a person, an animal or a vehicle at a place [m], with its usual speed [m/s]."""
    plan = MoverPlan(radius=radius, height=1.7, speed=speed)
    return Mover(place, velocity, plan, Behaviour(kind=kind, **behaviour))


def peopled(world, *walkers):
    """Return a world with walkers in it."""
    return replace(world, movers=walkers)
