"""Random numbers that are a function of a key and a number: drawn where needed, in any order.

A beam's noise then is its own, whether or not its neighbours need any. The numbers are those of
splitmix64 (Steele et al. 2014), whose state is a counter; normal ones come from the inverse of the
distribution function (Wichura 1988, algorithm AS 241, seven figures).
"""

import numpy as np

from terrain.kernel import inlined_kernel, kernel

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_27, _30, _31, _11 = np.uint64(27), np.uint64(30), np.uint64(31), np.uint64(11)
_UNIT = 2.0**-53


@inlined_kernel
def uniform(key, number):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the ``number``-th draw of a key, both uint64: from 0 to 1, 1 not included."""
    z = key + (number + np.uint64(1)) * _GOLDEN
    z = (z ^ (z >> _30)) * _FIRST
    z = (z ^ (z >> _27)) * _SECOND
    return np.float64((z ^ (z >> _31)) >> _11) * _UNIT


@kernel
def normal(share):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the standard normal number below which a share of them lies."""
    q = share - 0.5
    if abs(q) <= 0.425:
        r = 0.180625 - q * q
        above = ((59.109374720 * r + 159.29113202) * r + 50.434271938) * r + 3.3871327179
        below = ((67.187563600 * r + 78.757757664) * r + 17.895169469) * r + 1.0
        return q * above / below
    r = np.sqrt(-np.log(max(min(share, 1.0 - share), 1e-300)))
    if r <= 5.0:
        r -= 1.6
        above = ((0.17023821103 * r + 1.3067284816) * r + 2.7568153900) * r + 1.4234372777
        below = (0.12021132975 * r + 0.73700164250) * r + 1.0
    else:
        r -= 5.0
        above = ((0.017337203997 * r + 0.42868294337) * r + 3.0812263860) * r + 6.6579051150
        below = (0.012258202635 * r + 0.24197894225) * r + 1.0
    return np.copysign(above / below, q)
