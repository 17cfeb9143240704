"""Micro-relief of natural ground: clods, gravel and ruts, which a wheel rolls over.

Its parts are arrays of heights over the grid of a heightfield of 10 cm or less, to be added to the
ground. None of them is a step: truth is built of the ground without them.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

Field = NDArray[np.float64]
"""Values on grid points or along grid lines."""

SHORTEST, LONGEST = 0.2, 1.5
"""Wavelengths of clods and tussocks [m] (assumption)."""

_PEAK = 3.0
"""Limit that peaks approach, in standard deviations of the unlimited heights: soil falls apart,
noise does not. The limited heights vary less, and are scaled back: their peaks stay below 3.4."""

_RUT_WIDTH = 0.25
"""Width of a rut at the top [m]: a tyre and its bulges."""


def roughness(
    shape: tuple[int, int],
    cell: float,
    rng: np.random.Generator,
    wavelengths: tuple[float, float] = (SHORTEST, LONGEST),
) -> Field:
    """Return random heights of mean 0 and standard deviation 1, shape (nx, ny).

    The power of a profile falls with the square of the wave number, as that of tilled and natural
    soil does at these lengths (assumption).

    Args:
        shape: Number of grid lines (nx, ny).
        cell: Distance between grid lines [m].
        rng: Source of randomness.
        wavelengths: Shortest and longest wavelength [m]; the grid holds none below two cells.

    Raises:
        ValueError: If the grid holds none of the wavelengths.
    """
    shortest, longest = max(wavelengths[0], 2 * cell), wavelengths[1]
    if shortest > longest:
        raise ValueError(
            f"cell: expected at most {longest / 2:.3g} m for waves of {longest:.3g} m, "
            f"got {cell:.3g}; refine the grid"
        )
    sizes = [fft.next_fast_len(n, real=True) for n in shape]
    spectrum = fft.rfft2(rng.standard_normal(sizes, dtype=np.float32))
    waves = np.hypot(fft.fftfreq(sizes[0], cell)[:, None], fft.rfftfreq(sizes[1], cell)[None])
    band = (waves >= 1 / longest) & (waves <= 1 / shortest)
    # A profile's power is that of the surface summed across it: one power of the wave number more.
    gain = np.where(band, np.maximum(waves, 1e-9) ** -1.5, 0.0).astype(np.float32)
    field = fft.irfft2(spectrum * gain, s=sizes)[: shape[0], : shape[1]].astype(np.float64)
    field /= field.std()
    limited = _PEAK * np.tanh(field / _PEAK)
    limited -= limited.mean()
    return np.asarray(limited / limited.std())


def rut(distance: Field, track: float, depth: float) -> Field:
    """Return the heights of the two ruts of a vehicle's track [m].

    Args:
        distance: Distance to the middle of the track [m], any shape.
        track: Distance between the ruts' middles [m].
        depth: Depth of their floor [m].
    """
    away = np.abs(distance - track / 2)
    return -depth * np.clip((_RUT_WIDTH / 2 - away) / (_RUT_WIDTH / 4), 0.0, 1.0)
