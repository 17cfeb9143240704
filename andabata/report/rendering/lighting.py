"""Light of pictures: the sun, hillshade, shadows and haze."""

import numpy as np
from numpy.typing import NDArray

from terrain.heightfield import Heightfield
from worlds.rays.scene import RayScene

SUN = np.array([0.52, -0.52, 0.677])
"""Unit vector towards the sun."""

SKY = np.array([214.0, 228.0, 240.0])
"""Colour of the sky, and of haze."""

_AMBIENT, _DIRECT = 0.5, 0.78
"""Light from all over the sky, and from the sun."""

_RELIEF = 2.0
"""Factor on slopes in the shading of ground: light from one side alone hides gentle ones."""

_SHADOW = 0.55
"""Share of the sun's light that is left in a shadow, which bushes and crowns do not fill."""

_CLEAR, _HAZE = 25.0, 120.0
"""Distance up to which there is no haze, and over which it hides two thirds [m]."""

_SHADOW_CELL = 0.25
"""Distance of the places that are asked whether the sun shines there [m]."""


def lit(
    normals: NDArray[np.float64], sunny: NDArray[np.float64] | float = 1.0
) -> NDArray[np.float64]:
    """Return the brightness of surfaces, shape (n,).

    Args:
        normals: Unit normals, shape (n, 3).
        sunny: Share of the sun's light that arrives, shape (n,).
    """
    return np.asarray(_AMBIENT + _DIRECT * sunny * np.maximum(normals @ SUN, 0.0))


def hazy(colours: NDArray[np.float64], depths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return colours at depths [m], with the more of the sky's colour the farther they are."""
    share = 1.0 - np.exp(-np.maximum(depths - _CLEAR, 0.0) / _HAZE)
    return np.asarray(colours + share[:, None] * (SKY - colours))


class GroundLight:
    """Light on the ground of a world: hillshade, with the shadows of what stands on it."""

    def __init__(self, ground: Heightfield, rays: RayScene) -> None:
        """Look from places on the ground to the sun.

        Args:
            ground: Ground.
            rays: Ground and objects that throw shadows.
        """
        heights = ground.heights.astype(np.float64)
        self._slope_x, self._slope_y = (
            Heightfield(
                np.asarray(np.gradient(heights, ground.cell, axis=axis), dtype=np.float32),
                ground.cell,
            )
            for axis in (0, 1)
        )
        count = int(max(ground.width, ground.depth) / _SHADOW_CELL) + 1
        half = _SHADOW_CELL * (count - 1) / 2
        axis = np.linspace(-half, half, count)
        x, y = (
            np.clip(each, low + 1e-3, -low - 1e-3)
            for each, low in zip(
                np.meshgrid(axis, axis, indexing="ij"),
                (-ground.width / 2, -ground.depth / 2),
                strict=True,
            )
        )
        places = np.stack([x, y, ground.height_at(x, y) + 0.05], axis=-1).reshape(-1, 3)
        lines = np.hstack([places, np.broadcast_to(SUN, places.shape)]).astype(np.float32)
        ranges, _ = rays.cast(lines, np.zeros(len(lines), dtype=np.float32), 60.0)
        sunny = np.where(np.isfinite(ranges), _SHADOW, 1.0).reshape(count, count)
        self._sunny = Heightfield(sunny.astype(np.float32), _SHADOW_CELL)

    def normals(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return unit normals at places [m], of ground that is steeper than it is, shape (n, 3)."""
        slopes = [_RELIEF * each.height_at(x, y) for each in (self._slope_x, self._slope_y)]
        found = np.stack([-slopes[0], -slopes[1], np.ones_like(slopes[0])], axis=-1)
        return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))

    def steepness(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the slope of the ground at places [m], as rise over run, shape (n,)."""
        return np.hypot(self._slope_x.height_at(x, y), self._slope_y.height_at(x, y))

    def brightness(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the brightness of the ground at places [m], shape (n,)."""
        return lit(self.normals(x, y), self._sunny.height_at(x, y))
