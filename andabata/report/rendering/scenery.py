"""Scenery of a world in perspective: ground with hillshade and contour lines, objects, plants.

Rays find what each pixel shows of the ground and of solid objects; plants are drawn on top.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.rendering.camera import Camera
from andabata.report.rendering.canvas import Canvas
from andabata.report.rendering.lighting import SKY, GroundLight, hazy, lit
from andabata.report.rendering.plants import GRASSY, LEAFY, Plants
from terrain.classes import SemanticClass
from worlds.rays.scene import RayScene
from worlds.walking import WalkerTrack, cover_rays
from worlds.world import World

_FAR = 400.0
"""Reach of the rays [m]."""

_PAPER = np.array([255.0, 255.0, 255.0])

_STEEP = np.array([128.0, 100.0, 74.0])
"""Colour of steep ground."""

_GENTLE, _STEEPEST = 0.08, 0.55
"""Slopes from which on ground takes that colour, and at which it has it, as rise over run."""

_CONTOUR = 1.0
"""Difference of height between two contour lines [m]."""

_CONTOUR_INK = 0.22
"""Share of black in a contour line."""

_GROUND = (SemanticClass.GROUND, SemanticClass.PATH, SemanticClass.WATER)
"""Classes of the ground's surface."""


@dataclass(frozen=True)
class View:
    """What the rays of a camera have met.

    Attributes:
        camera: Camera.
        hits: Place of each pixel's hit in the map, far away for the sky [m], shape (n, 3).
        depths: Depth of each hit along the view, infinite for the sky [m], shape (n,).
        colours: Colour of each pixel without haze, shape (n, 3).
    """

    camera: Camera
    hits: NDArray[np.float64]
    depths: NDArray[np.float64]
    colours: NDArray[np.float64]

    def canvas(self, colours: NDArray[np.float64] | None = None, in_haze: bool = True) -> Canvas:
        """Return a canvas that shows the view.

        Args:
            colours: Colours to show, shape (n, 3); None for those of the view.
            in_haze: True for haze and a sky, False for clear air and white paper around the world.
        """
        shown = self.colours if colours is None else colours
        is_sky = ~np.isfinite(self.depths)
        found = hazy(shown, np.where(is_sky, 0.0, self.depths)) if in_haze else shown.copy()
        found[is_sky] = SKY if in_haze else _PAPER
        return Canvas.of(self.camera, found, self.depths)


class Scenery:
    """A world to be drawn from anywhere.

    Attributes:
        world: World.
        plants: Leaves and blades of its plants.
    """

    def __init__(self, world: World) -> None:
        """Prepare a world."""
        self.world = world
        solid = [each for each in world.objects if each.semantic not in (*LEAFY, *GRASSY)]
        shady = [each for each in world.objects if each.semantic not in GRASSY]
        self._rays = RayScene(replace(world, objects=tuple(solid)))
        self._light = GroundLight(world.ground, RayScene(replace(world, objects=tuple(shady))))
        self.plants = Plants.of(world.objects, world.ground)

    def view(self, camera: Camera, near: float = 0.0, walkers: WalkerTrack | None = None) -> View:
        """Return what a camera sees of ground, solid objects and walkers.

        Args:
            camera: Camera.
            near: Distance from the camera from which on it sees something [m]. Where the ground is
                nearer it sees that, and what stands there.
            walkers: Walkers; None without any.
        """
        directions = camera.directions()
        origins = camera.place + near * directions
        ground = self.world.ground.height_at(origins[:, 0], origins[:, 1])
        origins[origins[:, 2] < ground] = camera.place
        lines = np.hstack([origins, directions]).astype(np.float32)
        ranges, classes = self._rays.cast(lines, np.zeros(len(lines), dtype=np.float32), _FAR)
        if walkers is not None:
            times = np.full(len(lines), walkers.latest)
            cover_rays(lines, times, walkers, _FAR, ranges, classes)
        is_sky = ~np.isfinite(ranges)
        reach = np.where(is_sky, _FAR, ranges).astype(np.float64)
        hits = np.asarray(origins + directions * reach[:, None])
        depths = (hits - camera.place) @ camera.axes[2]
        depths[is_sky] = np.inf
        return View(camera, hits, depths, self._colours(hits, classes, camera))

    def _colours(
        self, hits: NDArray[np.float64], classes: NDArray[np.uint8], camera: Camera
    ) -> NDArray[np.float64]:
        """Return the colour of each hit in the light, shape (n, 3)."""
        colours = CLASS_COLOURS[classes].astype(np.float64)
        is_ground = np.isin(classes, _GROUND)
        x, y = hits[is_ground, 0], hits[is_ground, 1]
        steep = np.interp(self._light.steepness(x, y), (_GENTLE, _STEEPEST), (0.0, 1.0))
        dry = np.isin(classes[is_ground], _GROUND[:2])
        steep = np.where(dry, steep, 0.0)[:, None]
        light = self._light.brightness(x, y)[:, None]
        colours[is_ground] = ((1 - steep) * colours[is_ground] + steep * _STEEP) * light
        lines = contour_lines(hits[:, 2].reshape(camera.height, camera.width)).ravel()
        colours[is_ground] *= 1.0 - _CONTOUR_INK * lines[is_ground, None]
        shaded = lit(_normals(hits, camera))[:, None]
        return np.where(is_ground[:, None], colours, colours * shaded)


def contour_lines(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how much of each pixel a contour line covers, 0 to 1, shape (height, width).

    Where lines would lie in each other's pixels there are none.

    Args:
        heights: Height of what each pixel shows [m], shape (height, width).
    """
    slope = np.maximum(np.abs(np.gradient(heights, axis=0)), np.abs(np.gradient(heights, axis=1)))
    away = np.abs(heights / _CONTOUR - np.round(heights / _CONTOUR)) * _CONTOUR
    cover = np.clip(1.5 - away / np.maximum(slope, 1e-9), 0.0, 1.0)
    # A level floor at a contour's height has no line on it.
    return np.asarray(np.where((slope > 1e-6) & (slope < 0.12 * _CONTOUR), cover, 0.0))


def _normals(hits: NDArray[np.float64], camera: Camera) -> NDArray[np.float64]:
    """Return unit normals of what the pixels show, towards the camera, shape (n, 3)."""
    places = hits.reshape(camera.height, camera.width, 3)
    found = np.cross(np.gradient(places, axis=0), np.gradient(places, axis=1)).reshape(-1, 3)
    found /= np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-9)
    towards = np.einsum("ij,ij->i", found, camera.place - hits) > 0
    return np.where(towards[:, None], found, -found)
