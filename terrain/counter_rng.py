"""Counter-based random numbers: each is a function of a key and an index.

Numbers can be drawn where they are needed, in any order: the noise of one beam does not depend on
whether other beams need any. Uniform numbers are those of splitmix64 (Steele et al. 2014), whose
state is a counter; normal ones come from the inverse of the normal distribution function (Wichura
1988, algorithm AS 241, routine PPND7, seven figures).
"""

import numpy as np

from terrain.kernel import inlined_kernel, kernel

_GAMMA = np.uint64(0x9E3779B97F4A7C15)
"""Increment of the counter: 2^64 divided by the golden ratio, made odd."""

_MIX_1, _MIX_2 = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
"""Multipliers of the finaliser (Stafford's variant 13)."""

_27, _30, _31, _11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
_ULP = 2.0**-53
"""Distance between two draws: a float64 holds 53 bits."""


@inlined_kernel
def uniform(key: np.uint64, index: np.uint64) -> np.float64:
    """Return the ``index``-th uniform number of a key, from 0 to 1, 1 not included."""
    # State of the generator after index + 1 increments, then its finaliser: two xor-shift
    # multiplications and a last xor-shift.
    z = key + (index + np.uint64(1)) * _GAMMA
    z = (z ^ (z >> _30)) * _MIX_1
    z = (z ^ (z >> _27)) * _MIX_2
    return np.float64((z ^ (z >> _31)) >> _11) * _ULP


@kernel
def normal(p: float) -> float:
    """Return the quantile of the standard normal distribution at probability ``p``.

    Source: Wichura 1988, PPND7: a rational approximation in each of three regions.
    """
    q = p - 0.5
    # Central region, |p - 0.5| <= 0.425: a function of q^2.
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        numerator = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179
        denominator = ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0
        return q * numerator / denominator
    # Tails: a function of sqrt(-log p); the floor keeps p = 0 and p = 1 finite.
    r = np.sqrt(-np.log(max(min(p, 1.0 - p), 1e-300)))
    if r <= 5.0:
        r -= 1.6
        numerator = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
        denominator = (0.12021132975 * r + 0.73700164250) * r + 1.0
    else:
        r -= 5.0
        numerator = ((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150
        denominator = (0.012258202635 * r + 0.24197894225) * r + 1.0
    return np.copysign(numerator / denominator, q)
