"""Worlds with their ray scenes, made once and shared by all robots that drive in them."""

from collections import OrderedDict
from dataclasses import dataclass, replace

from worlds.catalogue import make_world
from worlds.rays.scene import RayScene
from worlds.truth import with_vegetation_limit
from worlds.world import World
from worlds.world_files import is_world_file


@dataclass(frozen=True)
class Scene:
    """A world and what its rays are cast against.

    Attributes:
        world: Ground, objects, tasks and true traversability.
        rays: Ray caster of the world.
    """

    world: World
    rays: RayScene

    def with_vegetation_limit(self, limit: float) -> "Scene":
        """Return the scene with the true map of a robot that crosses plants up to a height [m]."""
        world = with_vegetation_limit(self.world, limit)
        return self if world is self.world else replace(self, world=world)


class SceneCache:
    """Least-recently-used cache of scenes, shared by the environments of a process."""

    def __init__(self, capacity: int = 32) -> None:
        """Make an empty cache.

        Args:
            capacity: Largest number of scenes.
        """
        self._capacity = capacity
        self._scenes: OrderedDict[tuple[str, int, float | None, str | None], Scene] = OrderedDict()

    def get(
        self,
        preset: str,
        seed: int,
        difficulty: float | None = None,
        release: str | None = None,
    ) -> Scene:
        """Return the scene of a preset and a seed, from the cache or newly made.

        Args:
            preset: Name of the preset, or of a world's file.
            seed: Seed of the world.
            difficulty: Difficulty from 0 to 1; None for the preset's own.
            release: Release that is judged in the world; None for all other purposes.

        Raises:
            UnknownWorldError: If there is no such preset.
            JudgingSeedError: If the seed judges a release, and it is not ``release``.
            UnsolvableWorldError: If no world with safe paths is found in a few attempts.
        """
        # A file holds one world.
        key = (preset, seed, difficulty, release)
        if is_world_file(preset):
            key = (preset, 0, None, None)
        if key not in self._scenes:
            world = make_world(preset, seed, difficulty, release=release)
            self._scenes[key] = Scene(world, RayScene(world))
        self._scenes.move_to_end(key)
        while len(self._scenes) > self._capacity:
            self._scenes.popitem(last=False)
        return self._scenes[key]
