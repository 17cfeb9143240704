"""Kinds of ground, one pure function each: shapes of hills, ditches, pits and banks.

All functions take map coordinates of grid lines and return heights to be added, so that they
compose.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from terrain.kernel import kernel

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


def distance_to_line(x: Field, y: Field, line: Field, reach: float = np.inf) -> Field:
    """Return the distance from each grid point to a polyline [m], infinite beyond ``reach``.

    Args:
        x: Grid lines along x [m], shape (nx,).
        y: Grid lines along y [m], shape (ny,).
        line: Corners of the polyline [m], shape (k, 2).
        reach: Largest distance that matters [m].

    Returns:
        Distances [m], shape (nx, ny).
    """
    nearest = np.full((len(x), len(y)), np.inf)
    low, high = line.min(axis=0) - reach, line.max(axis=0) + reach
    rows = slice(*np.searchsorted(x, [low[0], high[0]]))
    columns = slice(*np.searchsorted(y, [low[1], high[1]]))
    _approach(x[rows], y[columns], np.asarray(line, dtype=np.float64), nearest[rows, columns])
    return nearest


@kernel
def _approach(x, y, line, nearest):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Lower ``nearest`` to the distance from the polyline."""
    for i in range(len(x)):
        for j in range(len(y)):
            best = np.inf
            for k in range(len(line) - 1):
                ax, ay = line[k, 0], line[k, 1]
                dx, dy = line[k + 1, 0] - ax, line[k + 1, 1] - ay
                px, py = x[i] - ax, y[j] - ay
                share = (px * dx + py * dy) / max(dx * dx + dy * dy, 1e-12)
                share = min(max(share, 0.0), 1.0)
                px, py = px - share * dx, py - share * dy
                best = min(best, px * px + py * py)
            nearest[i, j] = np.sqrt(best)


def ditch(distance: Field, width: float, depth: float) -> Field:
    """Return the heights [m] of a ditch with a flat floor along a line at ``distance`` [m]."""
    return -depth * np.clip((width / 2 - distance) / (width / 4), 0.0, 1.0)


def terrace(distance: Field, radius: float, height: float, edge: float) -> Field:
    """Return the heights [m] of a plateau within ``radius`` [m] of a line, its edge ``edge`` wide.

    A negative height makes a basin.
    """
    return height * np.clip((radius - distance) / edge, 0.0, 1.0)


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
