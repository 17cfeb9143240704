"""Selection of the beams that go into a cloud: in range, outside of the robot, not hidden."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.beams import SIN
from terrain.kernel import kernel


class RangeLimits(NamedTuple):
    """Ranges of beams that are kept; as in ``CloudAssemblyConfig``.

    Attributes:
        max_range: Largest range [m].
        body_radius: Least distance from the vertical axis [m].
        dense_range: Range below which beams are thinned [m].
        dense_stride: Number of beams there of which one is kept.
    """

    max_range: float
    body_radius: float
    dense_range: float
    dense_stride: int


def is_hidden(
    bearings: NDArray[np.floating], blind_deg: Sequence[tuple[float, float]]
) -> NDArray[np.bool_]:
    """Return True for bearings [rad] within a blind sector; its bounds [deg] may pass 180."""
    hidden = np.zeros(bearings.shape, dtype=np.bool_)
    for begin, end in blind_deg:
        width = 360.0 if abs(end - begin) >= 360.0 else (end - begin) % 360.0
        hidden |= (np.degrees(bearings) - begin) % 360.0 <= width
    return hidden


@kernel
def useful_beams(
    ranges: NDArray[np.float32], tilts: NDArray[np.float64], limits: RangeLimits
) -> NDArray[np.int64]:
    """Return the indices of beams to keep: in range, not the robot's body, thinned where dense.

    Args:
        ranges: Ranges of the sweeps [m], shape (s, b).
        tilts: Sine and cosine of the beams' elevations, shape (1 or s, 2, b).
        limits: Ranges that are kept.
    """
    beams = ranges.shape[1]
    kept = np.empty(ranges.size, dtype=np.int64)
    count = 0
    for i in range(ranges.shape[0]):
        row = i % len(tilts)
        for j in range(beams):
            distance = ranges[i, j]
            outward = distance * abs(tilts[row, SIN, j])
            near = distance < limits.max_range and outward > limits.body_radius
            # The turning head measures the ground beside the robot again and again.
            if near and (distance > limits.dense_range or j % limits.dense_stride == 0):
                kept[count] = i * beams + j
                count += 1
    return kept[:count]
