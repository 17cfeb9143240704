"""Generators of terrain: hills, ditches, terraces and banks as pure functions.

Heights are arrays over the grid of the heightfield, to be added to each other, so that generators
compose.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from terrain.kernel import kernel

Field = NDArray[np.float64]
"""Values on grid points or along grid lines."""


def smooth_noise(
    shape: tuple[int, int], cell: float, wavelength: float, rng: np.random.Generator
) -> Field:
    """Return smooth random heights of mean 0 and standard deviation 1, shape (nx, ny).

    Args:
        shape: Number of grid lines (nx, ny).
        cell: Distance between grid lines [m].
        wavelength: Typical distance from hill to hill [m].
        rng: Source of randomness.
    """
    sigma = wavelength / (4.0 * cell)
    pad = int(2 * sigma)
    step = max(1, int(sigma / 4))  # Filtered on a coarser grid: the same spectrum for less work.
    coarse = rng.standard_normal([(n + 2 * pad) // step + 2 for n in shape])
    coarse = gaussian_filter(coarse, sigma / step, mode="reflect")
    field = _stretch(coarse, shape, pad, step)
    return (field - field.mean()) / field.std()


@kernel
def _stretch(coarse: Field, shape: tuple[int, int], pad: int, step: int) -> Field:
    """Return the middle of a coarse field on the fine grid, by bilinear interpolation.

    Args:
        coarse: Field on every ``step``-th line of the padded fine grid.
        shape: Number of fine grid lines (nx, ny).
        pad: Number of fine grid lines before the first returned one.
        step: Number of fine grid lines per coarse one.
    """
    fine = np.empty(shape)
    lines = (np.arange(shape[1]) + pad) / step
    columns = lines.astype(np.int64)
    shares = lines - columns
    for row in range(shape[0]):
        i = int((row + pad) / step)
        u = (row + pad) / step - i
        for k in range(shape[1]):
            j, v = columns[k], shares[k]
            near = coarse[i, j] * (1 - v) + coarse[i, j + 1] * v
            far = coarse[i + 1, j] * (1 - v) + coarse[i + 1, j + 1] * v
            fine[row, k] = near * (1 - u) + far * u
    return fine


def hills(
    shape: tuple[int, int],
    cell: float,
    relief: float,
    max_slope: float,
    rng: np.random.Generator,
) -> Field:
    """Return hills with a given relief and a given largest slope, shape (nx, ny) [m].

    Long hills give the relief; short ones are made as high as ``max_slope`` allows.

    Args:
        shape: Number of grid lines (nx, ny).
        cell: Distance between grid lines [m].
        relief: Difference between highest and lowest point [m].
        max_slope: Slope of the steepest 0.1 % of the ground [rad].
        rng: Source of randomness.
    """
    long_hills = smooth_noise(shape, cell, 70.0, rng)
    short_hills = smooth_noise(shape, cell, 18.0, rng) * (
        0.35 + np.abs(smooth_noise(shape, cell, 50.0, rng))
    )
    roughness = smooth_noise(shape, cell, 3.0, rng)
    heights = long_hills * relief / np.ptp(long_hills)
    low, high = 0.0, relief
    coarse, coarse_hills = heights[::2, ::2], short_hills[::2, ::2]
    for _ in range(12):  # Bisection on the height of the short hills.
        strength = (low + high) / 2
        gentle = _is_gentle(coarse + strength * coarse_hills, 2 * cell, np.tan(max_slope))
        low, high = (strength, high) if gentle else (low, strength)
    heights = heights + low * short_hills + 0.012 * roughness
    return (heights - heights.min()) * relief / np.ptp(heights)


def _is_gentle(heights: Field, cell: float, limit: float) -> bool:
    """Return True if the slope that 0.1 % of the ground exceeds is below a limit (rise over run).

    That is ``np.quantile(slopes, 0.999) < limit``, and mostly counted.
    """
    dx, dy = np.gradient(heights, cell)
    slopes = np.hypot(dx, dy)
    # The quantile lies between two of the sorted slopes: most often both are on one side.
    first = int(0.999 * (slopes.size - 1))
    below = int(np.count_nonzero(slopes < limit))
    if below == first + 1:
        return bool(np.quantile(slopes, 0.999) < limit)
    return below > first


def distance_to_line(x: Field, y: Field, line: Field, reach: float = np.inf) -> Field:
    """Return the distance from each grid point to a polyline [m].

    Beyond ``reach`` it is the distance to a part of the line, or infinite: more than ``reach``.

    Args:
        x: Grid lines along x [m], shape (nx,).
        y: Grid lines along y [m], shape (ny,).
        line: Corners of the polyline [m], shape (k, 2).
        reach: Largest distance to compute [m].

    Returns:
        Distances [m], shape (nx, ny).
    """
    squares = np.full((len(x), len(y)), np.inf)
    _lower_squares(x, y, np.asarray(line, dtype=np.float64), reach, squares)
    return np.sqrt(squares, out=squares)


@kernel
def _lower_squares(x: Field, y: Field, line: Field, reach: float, squares: Field) -> None:
    """Lower the squared distance of grid points within reach of a segment to that distance.

    Args:
        x: Grid lines along x [m], shape (nx,).
        y: Grid lines along y [m], shape (ny,).
        line: Corners of the polyline [m], shape (k, 2).
        reach: Largest distance to compute [m].
        squares: Squared distances [m^2], changed in place, shape (nx, ny).
    """
    for k in range(len(line) - 1):
        (ax, ay), (bx, by) = line[k], line[k + 1]
        dx, dy = bx - ax, by - ay
        length = max(dx * dx + dy * dy, 1e-12)
        # Only around the segment: a line is long, and its bounding box mostly out of reach.
        first, last = (
            np.searchsorted(y, min(ay, by) - reach),
            np.searchsorted(y, max(ay, by) + reach),
        )
        for i in range(
            np.searchsorted(x, min(ax, bx) - reach), np.searchsorted(x, max(ax, bx) + reach)
        ):
            for j in range(first, last):
                px, py = x[i] - ax, y[j] - ay
                # The foot of the perpendicular, kept between the ends of the segment.
                share = min(max((px * dx + py * dy) / length, 0.0), 1.0)
                px, py = px - share * dx, py - share * dy
                squares[i, j] = min(squares[i, j], px * px + py * py)


def ditch(distance: Field, width: float, depth: float) -> Field:
    """Return the heights of a ditch with sloping sides and a flat floor [m].

    Args:
        distance: Distance to the ditch's middle line [m], any shape.
        width: Width at the top [m]; the floor is half as wide.
        depth: Depth of the floor [m].
    """
    return -depth * np.clip((width / 2 - distance) / (width / 4), 0.0, 1.0)


def terrace(distance: Field, radius: float, height: float, edge: float) -> Field:
    """Return the heights of a plateau around a line [m].

    Args:
        distance: Distance to the line [m], any shape.
        radius: Distance at which the ground outside begins [m].
        height: Height of the plateau [m]; negative for a basin.
        edge: Width of the sloping edge [m].
    """
    return height * np.clip((radius - distance) / edge, 0.0, 1.0)


def bank(distance: Field, foot: float, height: float, slope: float) -> Field:
    """Return the heights of banks along a line [m].

    Args:
        distance: Distance to the line [m], any shape.
        foot: Distance at which the banks begin [m].
        height: Height at which they end [m].
        slope: Slope [rad].
    """
    return np.clip((distance - foot) * np.tan(slope), 0.0, height)


def winding_line(
    start: NDArray[np.float64], heading: float, length: float, turn: float, rng: np.random.Generator
) -> Field:
    """Return a winding polyline with corners every 1.5 m [m], shape (k, 2).

    Args:
        start: First corner [m], shape (2,).
        heading: First direction [rad].
        length: Length [m].
        turn: Standard deviation of the change of direction at each corner [rad].
        rng: Source of randomness.
    """
    steps = max(2, int(length / 1.5))
    headings = heading + np.cumsum(turn * rng.standard_normal(steps))
    moves = 1.5 * np.stack([np.cos(headings), np.sin(headings)], axis=1)
    return np.concatenate([start[None], start + np.cumsum(moves, axis=0)])
