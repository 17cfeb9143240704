"""Worlds with their ray scenes, made once and shared by every robot that drives in them."""

from collections import OrderedDict
from dataclasses import dataclass

from worlds.catalogue import make_world
from worlds.rays import RayScene
from worlds.world import Geofence, World

_MARGIN = 1.0
"""A robot is told to keep so far from the world's border [m] (assumption)."""


@dataclass(frozen=True)
class Scene:
    """A world and the triangles that rays meet in it."""

    world: World
    rays: RayScene

    @property
    def geofence(self) -> Geofence:
        """Where a robot may be: beyond its border the world ends, and no real one does."""
        ground = self.world.ground
        x, y = ground.width / 2 - _MARGIN, ground.depth / 2 - _MARGIN
        return -x, -y, x, y


class SceneCache:
    """Keeps the scenes used last; environments in one process share a shelf."""

    def __init__(self, capacity: int = 32) -> None:
        """Keep at most ``capacity`` scenes."""
        self._capacity = capacity
        self._scenes: OrderedDict[tuple[str, int, float | None], Scene] = OrderedDict()

    def get(self, preset: str, seed: int, difficulty: float | None = None) -> Scene:
        """Return the scene of a preset and seed, making it when it is not on the shelf."""
        key = (preset, seed, difficulty)
        if key not in self._scenes:
            world = make_world(preset, seed, difficulty)
            self._scenes[key] = Scene(world, RayScene(world))
        self._scenes.move_to_end(key)
        while len(self._scenes) > self._capacity:
            self._scenes.popitem(last=False)
        return self._scenes[key]
