"""What a laser measures along its beams: first hits, mixed pixels, noise and lost returns."""

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS
from terrain.counter_rng import normal, uniform
from terrain.kernel import inlined_kernel, kernel
from worlds.rays.geometry import NO_CLASS
from worlds.rays.layout import Layout
from worlds.rays.walk import cast_rays
from worlds.walking import WalkerTrack, cover_rays

_DRAWS = np.uint64(3)
"""Number of random draws per beam: mixed pixel, noise, dropout."""

_NOISE, _DROPOUT = np.uint64(1), np.uint64(2)
"""Numbers of a beam's draws after the one of its mixed pixel."""

_RETURNS = np.ones(256, dtype=np.float32)
"""Probability that a surface of each semantic class returns a beam."""

for _semantic, _traits in TRAITS.items():
    _RETURNS[_semantic] = _traits.returns


@kernel
def measure_beams(
    rays: NDArray[np.float32],
    times: NDArray[np.float64],
    optical_depths: NDArray[np.float32],
    layout: Layout,
    walkers: WalkerTrack | None,
    reach: float,
    key: np.uint64,
    errors: NDArray[np.float64],
    stride: int,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Cast the beams of some sweeps and fill what the laser measures.

    A mixed pixel lies between a near surface and the one behind it, however far: beams that may be
    one are cast again without end. All other returns beyond the reach are left out, so that most of
    the world is never traversed.

    Args:
        rays: Origin in the map [m] and unit direction of each beam, shape (s * b, 6).
        times: Time of each beam [s], shape (s * b,).
        optical_depths: Depth in porous objects at which each beam ends, shape (s * b,).
        layout: The world.
        walkers: Walkers of the world; None without any.
        reach: Range up to which returns have to be right [m].
        key: Key of the random numbers of the beams.
        errors: ``noise``, ``dropout``, ``edge_step``, ``mixed``, ``min_range`` and ``max_range`` of
            ``LidarConfig``, shape (6,).
        stride: Number of beams from one to its neighbour, 0 without any.
        ranges: Ranges that are filled [m], ``inf`` is no return, shape (s, b).
        classes: Semantic classes that are filled, shape (s, b).
    """
    true, kinds = np.empty(len(rays), dtype=np.float32), classes.reshape(-1)
    cast_rays(rays, optical_depths, times, reach, layout, true, kinds)
    if walkers is not None:
        cover_rays(rays, times, walkers, reach, true, kinds)
    if stride and np.isfinite(reach):
        row = ranges.shape[1] if stride == 1 else len(rays)
        edges = _possibly_mixed(true, row, stride, key, errors[3])
        far_rays = np.empty((6, len(edges)), dtype=np.float32).T
        for n, k in enumerate(edges):
            far_rays[n] = rays[k]
        far, far_kinds = np.empty(len(edges), dtype=np.float32), kinds[edges]
        depths, when = optical_depths[edges], times[edges]
        cast_rays(far_rays, depths, when, np.inf, layout, far, far_kinds)
        if walkers is not None:
            cover_rays(far_rays, when, walkers, np.inf, far, far_kinds)
        true[edges], kinds[edges] = far, far_kinds
    _measure(true.reshape(ranges.shape), key, errors, stride, ranges, classes)


@inlined_kernel
def _mixing_draw(key: np.uint64, beam: int) -> np.float64:
    """Return a beam's first draw, which decides on a mixed pixel and on its place."""
    return uniform(key, _DRAWS * np.uint64(beam))


@kernel
def _possibly_mixed(
    ranges: NDArray[np.float32], row: int, stride: int, key: np.uint64, mixed: float
) -> NDArray[np.int64]:
    """Return the beams without a return that draw a mixed pixel and have a neighbour with one.

    Args:
        ranges: True ranges within reach [m], shape (k,).
        row: Number of beams of a row, in which neighbours lie.
        stride: Number of beams from one to its neighbour.
        key: Key of the random numbers.
        mixed: Probability of a mixed pixel.

    Returns:
        Numbers of the beams, shape (m,).
    """
    found = np.empty(len(ranges), dtype=np.int64)
    count = 0
    for first in range(0, len(ranges), row):
        last = first + row - 1
        for k in range(first, last + 1):
            if np.isfinite(ranges[k]):
                continue
            before = k - stride >= first and np.isfinite(ranges[k - stride])
            after = k + stride <= last and np.isfinite(ranges[k + stride])
            if (before or after) and _mixing_draw(key, k) < mixed:
                found[count] = k
                count += 1
    return found[:count]


@kernel
def _measure(
    true: NDArray[np.float32],
    key: np.uint64,
    errors: NDArray[np.float64],
    stride: int,
    ranges: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> None:
    """Fill measured ranges with noise, dropouts and mixed pixels; ``inf`` is no return.

    A lost return loses its class; a mixed pixel keeps that of the surface behind. Each beam has its
    own draws, so that none depends on another's surface.

    Args:
        true: True ranges [m], shape (s, b).
        key: Key of the random numbers.
        errors: Errors as in ``measure_beams``.
        stride: Number of beams from one to its neighbour, 0 without any.
        ranges: Ranges that are filled [m], shape (s, b).
        classes: True semantic classes, changed in place, shape (s, b).
    """
    noise, dropout, edge, mixed, min_range, max_range = errors
    last = true.shape[1] - 1
    sweeps, beams = true.shape[0] - 1, true.shape[1]
    for i in range(true.shape[0]):
        for j in range(true.shape[1]):
            here = true[i, j]
            if not np.isfinite(here):
                ranges[i, j], classes[i, j] = np.inf, NO_CLASS
                continue
            beam = i * beams + j
            number = _DRAWS * np.uint64(beam)
            # Nearer of the two neighbours: along the sweep of a 2D laser, from column to column of
            # a multi-beam one.
            near = here
            if stride == 1:
                near = min(true[i, max(j - 1, 0)], true[i, min(j + 1, last)])
            elif stride == beams:
                near = min(true[max(i - 1, 0), j], true[min(i + 1, sweeps), j])
            # Mixed pixel: the one draw says that there is one and, scaled, where it falls.
            measured = np.float64(here)
            if here - near > edge:
                mix = _mixing_draw(key, beam)
                if mix < mixed:
                    measured = near + mix / mixed * (here - near)
            measured += noise * normal(uniform(key, number + _NOISE))
            # Dropout, and surfaces that return only a part of the beams.
            keep = uniform(key, number + _DROPOUT)
            lost = keep >= (1 - dropout) * _RETURNS[classes[i, j]]
            if lost or not min_range <= measured <= max_range:
                ranges[i, j], classes[i, j] = np.inf, NO_CLASS
            else:
                ranges[i, j] = measured
