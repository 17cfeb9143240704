"""Semantic classes, and how each affects wheels and lidar beams."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from types import MappingProxyType


class SemanticClass(IntEnum):
    """The kind of a surface. The values are stored in clouds and never change meaning."""

    GROUND = 0
    PATH = 1
    TRUNK = 2
    FOLIAGE = 3
    BUSH = 4
    ROCK = 5
    HIGH_GRASS = 6
    WALL = 7
    POST = 8
    LAMP = 9
    BENCH = 10
    TABLE = 11
    BIN = 12
    CABLE = 13
    STONE = 14
    WATER = 15
    WALKER = 16
    STALKS = 17
    MEADOW = 18
    THICKET = 19
    SHORT_GRASS = 20
    KERB = 21
    ROOT = 22


@dataclass(frozen=True)
class ClassTraits:
    """Physical properties of a semantic class.

    Attributes:
        traversable: True if the robot may drive on it (slope and step of ground still count).
        solid: True if it has a collision body; wheels pass through the others.
        hits_per_metre: Expected number of returns per metre of beam inside it [1/m]; ``inf`` if
            opaque.
        returns: Probability that a beam that hits it returns.
        by_height: True if the robot may drive over it where it is no higher than its limit of
            plants, ``TruthConfig.max_traversable_vegetation``.
    """

    traversable: bool
    solid: bool
    hits_per_metre: float
    returns: float = 1.0
    by_height: bool = False


_GROUND = ClassTraits(traversable=True, solid=True, hits_per_metre=inf)
_OBSTACLE = ClassTraits(traversable=False, solid=True, hits_per_metre=inf)


def _plants(hits_per_metre: float) -> ClassTraits:
    """Return the traits of plants whose height decides whether they are crossed."""
    return ClassTraits(
        traversable=False, solid=False, hits_per_metre=hits_per_metre, by_height=True
    )


# Porosity is an assumption: mean free paths of 0.7 m in crowns, 0.33 m in clumps of grass, 0.2 m in
# bushes. In half a metre, continuous stands stop 0.14 (stalks of reeds or crops), 0.36 (meadow) and
# 0.59 (thicket: brambles, ferns, undergrowth) of the beams.
# Water reflects: one beam in twenty returns. A stone is a rock too low to stop a wheel, a root one
# of a tree; a higher one is a trunk.
TRAITS: Mapping[SemanticClass, ClassTraits] = MappingProxyType(
    {
        SemanticClass.GROUND: _GROUND,
        SemanticClass.PATH: _GROUND,
        SemanticClass.TRUNK: _OBSTACLE,
        SemanticClass.FOLIAGE: ClassTraits(traversable=False, solid=False, hits_per_metre=1.4),
        SemanticClass.BUSH: ClassTraits(traversable=False, solid=False, hits_per_metre=5.0),
        SemanticClass.ROCK: _OBSTACLE,
        SemanticClass.HIGH_GRASS: _plants(3.0),
        SemanticClass.WALL: _OBSTACLE,
        SemanticClass.POST: _OBSTACLE,
        SemanticClass.LAMP: _OBSTACLE,
        SemanticClass.BENCH: _OBSTACLE,
        SemanticClass.TABLE: _OBSTACLE,
        SemanticClass.BIN: _OBSTACLE,
        SemanticClass.CABLE: _OBSTACLE,
        SemanticClass.STONE: ClassTraits(traversable=True, solid=True, hits_per_metre=inf),
        SemanticClass.WATER: ClassTraits(False, solid=True, hits_per_metre=inf, returns=0.05),
        SemanticClass.WALKER: _OBSTACLE,
        SemanticClass.STALKS: _plants(0.3),
        SemanticClass.MEADOW: _plants(0.9),
        SemanticClass.THICKET: _plants(1.8),
        # Low plants and leaves on the ground; they have no bodies, see ``World.cover``.
        SemanticClass.SHORT_GRASS: _GROUND,
        SemanticClass.KERB: _OBSTACLE,
        SemanticClass.ROOT: ClassTraits(traversable=True, solid=True, hits_per_metre=inf),
    }
)
"""Properties of all semantic classes."""
