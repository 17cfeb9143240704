"""Plants in pictures: crowns and bushes as leaves, grass as blades.

A world has their hulls, which is what beams and wheels need to know. A picture of a hull hides that
one can see through, and looks like a stump.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.report.class_colours import CLASS_COLOURS
from andabata.report.rendering.canvas import Canvas
from andabata.report.rendering.lighting import hazy, lit
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject

LEAFY = (SemanticClass.FOLIAGE, SemanticClass.BUSH)
"""Classes of plants that are drawn as leaves."""

GRASSY = (
    SemanticClass.HIGH_GRASS,
    SemanticClass.STALKS,
    SemanticClass.MEADOW,
    SemanticClass.THICKET,
)
"""Classes of plants that are drawn as blades."""

_LEAF = {SemanticClass.FOLIAGE: 0.1, SemanticClass.BUSH: 0.085}
"""Radius of a cluster of leaves [m]."""

_COVER = 2.2
"""Area of a plant's leaves over that of its hull."""

_MOST_LEAVES = 1200
"""Largest number of clusters of a plant."""

_BLADES = {
    SemanticClass.HIGH_GRASS: 150.0,
    SemanticClass.STALKS: 40.0,
    SemanticClass.MEADOW: 90.0,
    SemanticClass.THICKET: 90.0,
}
"""Number of blades on a square metre."""

_BLADE = 0.014
"""Half of a blade's width at its foot [m]."""

_LEAN = 0.35
"""Largest distance of a blade's tip from above its foot, over its length."""

_DETAIL = 22.0
"""Distance beyond which a plant has fewer and larger parts [m]."""

_FEWEST = 0.12
"""Least share of its parts that a plant has."""


@dataclass(frozen=True)
class Plants:
    """Leaves and blades of a world.

    Attributes:
        leaves: Centres of clusters of leaves [m], shape (n, 3).
        radii: Radii of the clusters [m], shape (n,).
        leaf_colours: Colours of the clusters in the sun, shape (n, 3).
        feet: Feet of blades [m], shape (m, 3).
        tips: Tips of blades [m], shape (m, 3).
        blade_colours: Colours of blades, shape (m, 3).
        leaf_ranks: Uniform draws, by which clusters are left out, shape (n,).
        blade_ranks: Uniform draws of the blades, shape (m,).
    """

    leaves: NDArray[np.float32]
    radii: NDArray[np.float64]
    leaf_colours: NDArray[np.float64]
    feet: NDArray[np.float32]
    tips: NDArray[np.float32]
    blade_colours: NDArray[np.float64]
    leaf_ranks: NDArray[np.float64]
    blade_ranks: NDArray[np.float64]

    @classmethod
    def of(cls, objects: Sequence[SceneObject], ground: Heightfield) -> "Plants":
        """Return the leaves and blades of objects; the same objects have the same ones.

        Args:
            objects: Objects, of which those of other classes are left out.
            ground: Ground that they stand on.
        """
        rng = np.random.default_rng(0)
        leafy = [_leaves(each, rng) for each in objects if each.semantic in LEAFY]
        grassy = [_blades(each, ground, rng) for each in objects if each.semantic in GRASSY]
        leaves = np.concatenate([np.empty((0, 7)), *leafy])
        blades = np.concatenate([np.empty((0, 9)), *grassy])
        return cls(
            leaves=leaves[:, :3].astype(np.float32),
            radii=leaves[:, 3],
            leaf_colours=leaves[:, 4:],
            feet=blades[:, :3].astype(np.float32),
            tips=blades[:, 3:6].astype(np.float32),
            blade_colours=blades[:, 6:],
            leaf_ranks=rng.random(len(leaves)),
            blade_ranks=rng.random(len(blades)),
        )

    def draw(self, canvas: Canvas, focus: float = 0.0, in_haze: bool = True) -> None:
        """Draw the plants.

        Args:
            canvas: Canvas.
            focus: Distance of what the picture is about [m]: plants that are nearer thin out, so
                that they do not hide it.
            in_haze: True for haze.
        """
        eye = canvas.camera.place
        distances = np.linalg.norm(self.leaves - eye, axis=1)
        share = shares(distances, focus)
        shown = self.leaf_ranks < share
        scale = np.sqrt(1.0 / _details(distances[shown]))
        colours = self.leaf_colours[shown]
        colours = hazy(colours, distances[shown]) if in_haze else colours
        canvas.discs(self.leaves[shown], self.radii[shown] * scale, colours)
        distances = np.linalg.norm(self.feet - eye, axis=1)
        shown = self.blade_ranks < shares(distances, focus)
        colours = self.blade_colours[shown]
        colours = hazy(colours, distances[shown]) if in_haze else colours
        canvas.lines(self.feet[shown], self.tips[shown], (_BLADE, 0.2 * _BLADE), colours)


def shares(distances: NDArray[np.floating], focus: float) -> NDArray[np.float64]:
    """Return the share of its parts that a plant has in a picture, shape (n,).

    Args:
        distances: Distances from the camera [m], shape (n,).
        focus: Distance of what the picture is about [m]; 0 for nothing in particular.
    """
    found = _details(distances)
    if focus > 0:
        found = found * np.clip((distances / focus - 0.85) / 0.3, 0.0, 1.0)
    return found


def _details(distances: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return the share of its parts that are told apart at distances [m], shape (n,)."""
    return np.clip(_DETAIL / np.maximum(distances.astype(np.float64), 1e-3), _FEWEST, 1.0) ** 1.5


def _leaves(plant: SceneObject, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return rows of place [m], radius [m] and colour of leaves near a hull, shape (n, 7)."""
    corners = plant.vertices[plant.triangles].astype(np.float64)
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    radius = _LEAF[plant.semantic]
    count = int(np.clip(_COVER * areas.sum() / 2 / (np.pi * radius**2), 30, _MOST_LEAVES))
    chosen = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    u, v = rng.random((2, count))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    places = chosen[:, 0] + u[:, None] * (chosen[:, 1] - chosen[:, 0])
    places += v[:, None] * (chosen[:, 2] - chosen[:, 0])
    middle = plant.vertices.mean(axis=0).astype(np.float64)
    inward = rng.uniform(0.72, 1.04, count)
    places = middle + inward[:, None] * (places - middle)
    outward = places - middle
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    # Deep inside it is darker; no two clusters are of the same green.
    light = lit(outward) * np.interp(inward, (0.72, 1.0), (0.62, 1.05))
    light *= rng.uniform(0.86, 1.14, count)
    colours = CLASS_COLOURS[plant.semantic] * light[:, None]
    return np.column_stack([places, radius * rng.uniform(0.7, 1.3, count), colours])


def _blades(
    plant: SceneObject, ground: Heightfield, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return rows of foot [m], tip [m] and colour of the blades of a stand, shape (n, 9)."""
    low, high = plant.vertices.min(axis=0), plant.vertices.max(axis=0)
    size = (high - low)[:2].astype(np.float64)
    count = max(int(_BLADES[plant.semantic] * size.prod()), 8)
    spots = rng.uniform(-0.5, 0.5, (count, 2))
    if plant.semantic is SemanticClass.HIGH_GRASS:
        # Clumps are round, tiles of a stand are not.
        radius, angle = 0.5 * np.sqrt(rng.random(count)), rng.uniform(0, 2 * np.pi, count)
        spots = radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    feet = (low + high)[:2] / 2 + spots * size
    z = ground.height_at(feet[:, 0], feet[:, 1])
    heights = np.maximum(float(high[2]) - z, 0.04) * rng.uniform(0.6, 1.0, count)
    lean = rng.normal(0, 0.12, (count, 2)) + 0.25 * spots
    lean = np.clip(lean, -_LEAN, _LEAN) * heights[:, None]
    colour = CLASS_COLOURS[plant.semantic] * rng.uniform(0.62, 1.1, count)[:, None]
    return np.column_stack([feet, z, feet + lean, z + heights, colour])
