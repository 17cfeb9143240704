"""Wind in leaves: some of their cells hold others after a while.

Which cells, and when, follows from the world's seed, the place and the time alone: rays of one
instant see the same leaves, in whatever order they are cast.
"""

from typing import NamedTuple

import numpy as np

from terrain.counter_rng import uniform
from terrain.kernel import inlined_kernel

_SPELL = np.uint64(0xD1342543DE82EF95)
"""Odd number that parts the keys of one spell from those of the next."""


class Wind(NamedTuple):
    """What wind does to leaves: a share of their cells holds others after a while.

    Attributes:
        share: Share of the cells that wind moves; 0 for still air.
        period: Time after which such a cell holds others [s]; each has its own instant.
        key: Key of the random numbers.
    """

    share: float
    period: float
    key: np.uint64


STILL_AIR = Wind(0.0, 1.0, np.uint64(0))
"""No wind."""

WIND_PERIOD = 20.0
"""``Wind.period`` of worlds [s] (assumption: a branch is blown aside and stays there a while)."""


@inlined_kernel
def stirred_chance(chance: float, cell: np.uint64, wind: Wind, time: float) -> float:
    """Return the random number of a cell of leaves in wind, from 0 to 1.

    Args:
        chance: Its random number in still air.
        cell: Number of the cell.
        wind: Wind that moves a share of the cells.
        time: Time [s].
    """
    moving = uniform(wind.key, cell)
    if moving >= wind.share:
        return chance
    # The one draw says that the cell moves and, scaled, in which part of the period it changes.
    spell = np.uint64(np.int64(np.floor(time / wind.period + moving / wind.share)))
    return uniform(wind.key + (spell + np.uint64(1)) * _SPELL, cell)
