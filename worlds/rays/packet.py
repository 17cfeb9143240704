"""Bounds of neighbouring rays that rise: most of a laser's upper beams meet nothing but the sky.

Rays are taken in packets, and one box holds all of a packet's rays between two ranges. Compared
with the blocks under it, it shows where nothing can be hit, for all of them at once (Wald et al.
2006, "Ray tracing animated scenes using coherent grid traversal").
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import borrowing_kernel, inlined_kernel
from worlds.rays.layout import GROUND_TOP, OBJECTS_BOTTOM, OBJECTS_TOP, Lattice

PACKET = 64
"""Number of consecutive rays that are bounded together."""

_MAX_SPREAD = 0.5
"""Largest difference of a packet's directions along an axis: rays all around have no common way."""

_MARGIN = 1e-3
"""Margin of the boxes [m], over that of the objects' own."""


class Packet(NamedTuple):
    """Box of the origins of some rays, and box of their directions.

    Attributes:
        low: Least x, y, z of the origins [m].
        high: Greatest x, y, z of the origins [m].
        least: Least components of the directions.
        most: Greatest components of the directions.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    least: tuple[float, float, float]
    most: tuple[float, float, float]


@borrowing_kernel
def packet_span(
    rays: NDArray[np.float32], lattice: Lattice, tops: NDArray[np.float64], max_range: float
) -> tuple[float, float]:
    """Return ranges [m] before and after which no ray of a packet hits anything.

    The first is not below the second if they hit nothing at all. Rays of which one descends, or
    that part too far, are not bounded: they come down to the ground soon.

    Args:
        rays: Origin in the map [m] and unit direction of each ray, float32, shape (n, 6).
        lattice: Position and resolution of the blocks.
        tops: Heights of what each block holds [m]; see ``Blocks``.
        max_range: Largest range [m].
    """
    packet = _bounds(rays)
    spread = max(packet.most[0] - packet.least[0], packet.most[1] - packet.least[1])
    if packet.least[2] < 0.0 or not spread <= _MAX_SPREAD:
        return 0.0, max_range
    begin, end = 0.0, min(max_range, _way_out(packet, lattice, tops))
    while begin < end and not _may_hit(packet, begin, begin + lattice.edge, lattice, tops):
        begin += lattice.edge
    while begin < end and not _may_hit(packet, end - lattice.edge, end, lattice, tops):
        end -= lattice.edge
    return begin, end


@inlined_kernel
def _bounds(rays: NDArray[np.float32]) -> Packet:
    """Return the bounds of some rays."""
    x0 = y0 = z0 = u0 = v0 = w0 = np.inf
    x1 = y1 = z1 = u1 = v1 = w1 = -np.inf
    for k in range(len(rays)):
        x, y, z = np.float64(rays[k, 0]), np.float64(rays[k, 1]), np.float64(rays[k, 2])
        u, v, w = np.float64(rays[k, 3]), np.float64(rays[k, 4]), np.float64(rays[k, 5])
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
        u0, v0, w0 = min(u0, u), min(v0, v), min(w0, w)
        u1, v1, w1 = max(u1, u), max(v1, v), max(w1, w)
    return Packet((x0, y0, z0), (x1, y1, z1), (u0, v0, w0), (u1, v1, w1))


@inlined_kernel
def _way_out(packet: Packet, lattice: Lattice, tops: NDArray[np.float64]) -> float:
    """Return a range [m] beyond which no ray of a packet is over the blocks any more."""
    x_max = lattice.x_min + tops.shape[0] * lattice.edge
    y_max = lattice.y_min + tops.shape[1] * lattice.edge
    # Distance of the origins from the farthest corner, of a box that also holds all heights.
    x = max(packet.high[0] - lattice.x_min, x_max - packet.low[0])
    y = max(packet.high[1] - lattice.y_min, y_max - packet.low[1])
    z = max(packet.high[2] - lattice.z_min, lattice.z_max - packet.low[2])
    return float(np.sqrt(x * x + y * y + z * z))


@inlined_kernel
def _may_hit(
    packet: Packet, begin: float, end: float, lattice: Lattice, tops: NDArray[np.float64]
) -> bool:
    """Return True if rays of a packet may hit something between two ranges [m]."""
    x0 = packet.low[0] + min(begin * packet.least[0], end * packet.least[0]) - _MARGIN
    y0 = packet.low[1] + min(begin * packet.least[1], end * packet.least[1]) - _MARGIN
    x1 = packet.high[0] + max(begin * packet.most[0], end * packet.most[0]) + _MARGIN
    y1 = packet.high[1] + max(begin * packet.most[1], end * packet.most[1]) + _MARGIN
    # Rays of a packet rise: they are lowest at the near range.
    z0 = packet.low[2] + begin * packet.least[2] - _MARGIN
    z1 = packet.high[2] + end * packet.most[2] + _MARGIN
    if z0 > lattice.z_max:
        return False
    # Blocks under the box.
    scale = 1.0 / lattice.edge
    i0 = max(int(np.floor((x0 - lattice.x_min) * scale)), 0)
    j0 = max(int(np.floor((y0 - lattice.y_min) * scale)), 0)
    i1 = min(int(np.floor((x1 - lattice.x_min) * scale)), tops.shape[0] - 1)
    j1 = min(int(np.floor((y1 - lattice.y_min) * scale)), tops.shape[1] - 1)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if z0 <= tops[i, j, GROUND_TOP]:
                return True
            if z0 <= tops[i, j, OBJECTS_TOP] and z1 >= tops[i, j, OBJECTS_BOTTOM]:
                return True
    return False
