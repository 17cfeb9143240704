"""The one table of semantic classes: what stops a wheel and what stops a beam."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from types import MappingProxyType


class SemanticClass(IntEnum):
    """What a surface is. The values are written into clouds and never change meaning."""

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


@dataclass(frozen=True)
class ClassTraits:
    """How a class behaves.

    Attributes:
        traversable: Whether the robot may drive on it (ground still has to be flat enough).
        solid: Whether it is a body that the robot can touch; the others let wheels through.
        hits_per_metre: Expected returns per metre of beam inside it [1/m]; ``inf`` is opaque.
        returns: Probability that a beam that ends on it comes back.
    """

    traversable: bool
    solid: bool
    hits_per_metre: float
    returns: float = 1.0


_GROUND = ClassTraits(traversable=True, solid=True, hits_per_metre=inf)
_OBSTACLE = ClassTraits(traversable=False, solid=True, hits_per_metre=inf)

# Porosity is an assumption: mean free paths of 0.7 m in crowns, 0.33 m in grass, 0.2 m in bushes.
# Water is a mirror that sends one beam in twenty back. A stone is a rock too low to stop a wheel.
TRAITS: Mapping[SemanticClass, ClassTraits] = MappingProxyType(
    {
        SemanticClass.GROUND: _GROUND,
        SemanticClass.PATH: _GROUND,
        SemanticClass.TRUNK: _OBSTACLE,
        SemanticClass.FOLIAGE: ClassTraits(traversable=False, solid=False, hits_per_metre=1.4),
        SemanticClass.BUSH: ClassTraits(traversable=False, solid=False, hits_per_metre=5.0),
        SemanticClass.ROCK: _OBSTACLE,
        SemanticClass.HIGH_GRASS: ClassTraits(traversable=False, solid=False, hits_per_metre=3.0),
        SemanticClass.WALL: _OBSTACLE,
        SemanticClass.POST: _OBSTACLE,
        SemanticClass.LAMP: _OBSTACLE,
        SemanticClass.BENCH: _OBSTACLE,
        SemanticClass.TABLE: _OBSTACLE,
        SemanticClass.BIN: _OBSTACLE,
        SemanticClass.CABLE: _OBSTACLE,
        SemanticClass.STONE: ClassTraits(traversable=True, solid=True, hits_per_metre=inf),
        SemanticClass.WATER: ClassTraits(False, solid=True, hits_per_metre=inf, returns=0.05),
    }
)
