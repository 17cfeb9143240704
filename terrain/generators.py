"""Kinds of ground, one pure function each: shapes of hills, ditches, pits and banks.

All functions take map coordinates of grid lines and return heights to be added, so that they
compose.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

Field = NDArray[np.float64]


def smooth_noise(
    shape: tuple[int, int], cell: float, wavelength: float, rng: np.random.Generator
) -> Field:
    """Return smooth random heights of unit standard deviation.

    Args:
        shape: Grid lines (nx, ny).
        cell: Distance between grid lines [m].
        wavelength: Typical distance from hill to hill [m].
        rng: Source of randomness.
    """
    sigma = wavelength / (4.0 * cell)
    pad = int(2 * sigma)
    step = max(1, int(sigma / 4))  # Coarse noise, stretched: the same spectrum for less work.
    coarse = rng.standard_normal([(n + 2 * pad) // step + 2 for n in shape])
    coarse = gaussian_filter(coarse, sigma / step, mode="reflect")
    field = _stretch(coarse, shape, pad, step)
    return (field - field.mean()) / field.std()


def _stretch(coarse: Field, shape: tuple[int, int], pad: int, step: int) -> Field:
    """Return the middle of a coarse field on the fine grid, by bilinear interpolation."""
    rows = (np.arange(shape[0]) + pad) / step
    columns = (np.arange(shape[1]) + pad) / step
    i, j = rows.astype(int), columns.astype(int)
    u, v = (rows - i)[:, None], (columns - j)[None, :]
    near = coarse[i][:, j] * (1 - v) + coarse[i][:, j + 1] * v
    far = coarse[i + 1][:, j] * (1 - v) + coarse[i + 1][:, j + 1] * v
    return near * (1 - u) + far * u


def hills(
    shape: tuple[int, int],
    cell: float,
    relief: float,
    max_slope: float,
    rng: np.random.Generator,
) -> Field:
    """Return rolling ground with a given relief [m] and a given steepest slope.

    Long hills give the relief; shorter ones are made as strong as ``max_slope`` [rad] allows.
    """
    long_hills = smooth_noise(shape, cell, 70.0, rng)
    short_hills = smooth_noise(shape, cell, 18.0, rng) * (
        0.35 + np.abs(smooth_noise(shape, cell, 50.0, rng))
    )
    bumps = smooth_noise(shape, cell, 3.0, rng)
    heights = long_hills * relief / np.ptp(long_hills)
    low, high = 0.0, relief
    for _ in range(12):  # Bisection on the strength of the short hills.
        strength = (low + high) / 2
        steep = _steep(heights + strength * short_hills, cell)
        low, high = (strength, high) if steep < np.tan(max_slope) else (low, strength)
    heights = heights + low * short_hills + 0.012 * bumps
    return (heights - heights.min()) * relief / np.ptp(heights)


def _steep(heights: Field, cell: float) -> float:
    """Return the slope (rise over run) that 0.1 % of the ground exceeds."""
    every = heights[::2, ::2]
    dx, dy = np.gradient(every, 2 * cell)
    return float(np.quantile(np.hypot(dx, dy), 0.999))


def distance_to_line(x: Field, y: Field, line: Field) -> Field:
    """Return the distance from each grid point to a polyline [m].

    Args:
        x: Grid lines along x [m], shape (nx,).
        y: Grid lines along y [m], shape (ny,).
        line: Corners of the polyline [m], shape (k, 2).

    Returns:
        Distances [m], shape (nx, ny).
    """
    nearest = np.full((len(x), len(y)), np.inf)
    for start, end in pairwise(line):
        along = end - start
        length2 = max(float(along @ along), 1e-12)
        px, py = x[:, None] - start[0], y[None, :] - start[1]
        share = np.clip((px * along[0] + py * along[1]) / length2, 0.0, 1.0)
        np.minimum(nearest, np.hypot(px - share * along[0], py - share * along[1]), out=nearest)
    return nearest


def ditch(distance: Field, width: float, depth: float) -> Field:
    """Return the heights [m] of a ditch with a flat floor along a line at ``distance`` [m]."""
    return -depth * np.clip((width / 2 - distance) / (width / 4), 0.0, 1.0)


def bank(distance: Field, foot: float, height: float, slope: float) -> Field:
    """Return the heights [m] of banks that rise with ``slope`` [rad] beyond ``foot`` [m]."""
    return np.clip((distance - foot) * np.tan(slope), 0.0, height)


def winding_line(
    start: NDArray[np.float64], heading: float, length: float, turn: float, rng: np.random.Generator
) -> Field:
    """Return a line that wanders: corners every 1.5 m, shape (k, 2).

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
