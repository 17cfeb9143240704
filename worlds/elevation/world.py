"""World of real terrain: ground from an elevation model, and what a preset puts on it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.catalogue import UnknownWorldError, first_solvable, presets
from worlds.elevation.objects_file import PlacedObject, make_objects
from worlds.elevation.square import GroundSquare
from worlds.goals import UnsolvableWorldError
from worlds.natural import NaturalConfig, Streams, natural_on
from worlds.splits import refuse_judging
from worlds.traversability_map import Reason
from worlds.truth import TruthConfig, build_truth
from worlds.world import World

BARE = "none"
"""Name of the preset that puts nothing on the ground."""

_TOO_STEEP = 0.5
"""Share of ground that is too steep from which on no robot gets far on it (assumption)."""

_BARE = NaturalConfig(
    family=15, trees=0.0, grass=0.0, bushes=0.0, rocks=0.0, logs=0.0, traps=0, tasks=4
)


def ground_presets() -> tuple[str, ...]:
    """Return the names of the presets whose plants and objects go on any ground."""
    natural = (name for name, each in presets().items() if isinstance(each, NaturalConfig))
    return (*natural, BARE)


def config_on(preset: str, size: float) -> NaturalConfig:
    """Return what a preset puts on a square of ground: the same densities, numbers by its area.

    Args:
        preset: Name of a natural preset, or ``BARE``.
        size: Edge of the square [m].

    Raises:
        UnknownWorldError: If there is no such preset.
    """
    if preset not in ground_presets():
        known = ", ".join(ground_presets())
        raise UnknownWorldError(f"preset: expected one of {known}, got {preset!r}")
    config = presets().get(preset, _BARE)
    assert isinstance(config, NaturalConfig)
    share = (size / config.size) ** 2
    walkers = config.walkers.scaled(share).model_dump()
    roughness = config.roughness.model_dump() | {"ruts": round(config.roughness.ruts * share)}
    new: dict[str, object] = {"walkers": walkers, "roughness": roughness, "size": size}
    new["ways"] = config.ways.scaled(share).model_dump()
    new |= {"traps": round(config.traps * share), "near": min(config.near, size / 4)}
    return NaturalConfig.model_validate(config.model_dump() | new)


def world_on(
    name: str,
    square: GroundSquare,
    preset: str,
    seed: int = 0,
    difficulty: float | None = None,
    placed: Sequence[PlacedObject] = (),
) -> World:
    """Return a world on a square of real ground; the same arguments give the same bytes.

    Of the preset are roughness, cover, ways, plants, objects, tasks and walkers; ditches, pits,
    terraces, paths and water are the ground's own affair.

    Args:
        name: Name of the world.
        square: Ground.
        preset: Name of a natural preset, or ``BARE``.
        seed: Seed of everything random.
        difficulty: Difficulty from 0 to 1; None for the preset's own.
        placed: Objects at given places.

    Raises:
        UnknownWorldError: If there is no such preset.
        JudgingSeedError: If the seed judges a release.
        UnsolvableWorldError: If no tasks with safe paths are found in a few attempts.
    """
    refuse_judging(seed)
    ground = square.ground
    config = config_on(preset, ground.width)
    level = config.difficulty if difficulty is None else difficulty
    surface = np.full(np.subtract(ground.heights.shape, 1), SemanticClass.GROUND, dtype=np.uint8)

    def on_ground(rough: Heightfield) -> list[SceneObject]:
        return make_objects(placed, rough, seed)

    def attempt(rng: np.random.Generator) -> World:
        streams = Streams(*rng.spawn(len(Streams._fields)))
        return natural_on(name, seed, config, level, ground, surface, streams, on_ground)

    world = first_solvable(config.family, seed, attempt)
    if world is None:
        raise UnsolvableWorldError(_unsolvable(square, config))
    return replace(world, datum=square.datum)


def _unsolvable(square: GroundSquare, config: NaturalConfig) -> str:
    """Return why there are no tasks, and what to do."""
    reason = build_truth(square.ground, (), TruthConfig()).reason
    share = (reason[reason != Reason.BORDER] != Reason.FREE).mean()
    # Fewer objects do not help where the ground itself is what stops a robot.
    advice = f"a lower difficulty, preset {BARE}, a larger size or " if share < _TOO_STEEP else ""
    return (
        f"world: expected {config.tasks} tasks with safe paths of {config.near:g} to "
        f"{config.longest:g} m about {square.frame.text}, got fewer; {share:.0%} of the bare "
        f"ground is too steep or has steps: take {advice}another place"
    )
