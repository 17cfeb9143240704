"""Catalogue of worlds by name, from presets in TOML files with disjoint random streams."""

import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Annotated

import numpy as np
from pydantic import Field, TypeAdapter

from worlds.goals import UnsolvableWorldError
from worlds.hollow import HollowConfig, make_hollow
from worlds.maze import MazeConfig, make_maze
from worlds.natural import NaturalConfig, make_natural
from worlds.splits import refuse_judging
from worlds.world import World
from worlds.world_files import SUFFIX, is_world_file, load_world

PresetConfig = MazeConfig | NaturalConfig | HollowConfig
"""Configuration of any kind of world."""

_ATTEMPTS = 5
"""Number of random worlds that are tried until one has safe paths."""


class UnknownWorldError(ValueError):
    """Raised for a name without a preset."""


@cache
def presets() -> Mapping[str, PresetConfig]:
    """Return the presets by name."""
    adapter: TypeAdapter[PresetConfig] = TypeAdapter(
        Annotated[PresetConfig, Field(discriminator="kind")]
    )
    folder = files("worlds").joinpath("presets")
    configs = {
        entry.name.removesuffix(".toml"): adapter.validate_python(tomllib.loads(entry.read_text()))
        for entry in folder.iterdir()
        if entry.name.endswith(".toml")
    }
    return MappingProxyType(dict(sorted(configs.items())))


def preset_names() -> tuple[str, ...]:
    """Return the presets' names, sorted."""
    return tuple(presets())


def patch(name: str, size: float, cell: float) -> PresetConfig:
    """Return a preset's configuration for a smaller world with the same densities.

    Args:
        name: Name of the preset.
        size: Edge of the world [m].
        cell: Distance between the ground's grid lines [m].

    Raises:
        UnknownWorldError: If there is no such preset.
    """
    config = presets().get(name)
    match config:
        case None:
            known = ", ".join(preset_names())
            raise UnknownWorldError(f"world: expected one of {known}, got {name!r}")
        case MazeConfig():
            new: dict[str, object] = {"size": size, "corridor": 5.0, "tasks": 1}
            new |= {"near": 5.0, "far": size}
        case HollowConfig():
            new = {"length": max(size - 16.0, 30.0), "cell": cell}
        case NaturalConfig():
            share = (size / config.size) ** 2
            counts = ("ditches", "pits", "traps", "terraces")
            new = {count: round(getattr(config, count) * share) for count in counts}
            new |= {"size": size, "cell": cell, "relief": config.relief * size / config.size}
            new["walkers"] = config.walkers.scaled(share).model_dump()
            new["ways"] = config.ways.scaled(share).model_dump()
            new |= {"tasks": 1, "goals": 1, "near": 5.0, "far": size}
    return type(config).model_validate(config.model_dump() | new)


def make_world(
    name: str,
    seed: int = 0,
    difficulty: float | None = None,
    config: PresetConfig | None = None,
    release: str | None = None,
) -> World:
    """Return a world; the same arguments give the same bytes.

    Args:
        name: Name of the preset, or of a world's file, which ends in ``.safetensors``; a file holds
            one world, whatever seed and difficulty are.
        seed: Seed within the preset's own family; the same seed of another preset is independent.
        difficulty: Difficulty from 0 to 1; None for the preset's own.
        config: Densities and sizes that replace the preset's own; None for those.
        release: Release that is judged in the world; None for all other purposes.

    Raises:
        UnknownWorldError: If there is no such preset.
        JudgingSeedError: If the seed judges a release, and it is not ``release``.
        UnsolvableWorldError: If no world with safe paths is found in a few attempts.
        WorldFileError: If a file is no world.
        OSError: If it cannot be read.
        ValueError: If seed or difficulty are out of bounds.
    """
    if is_world_file(name):
        return load_world(Path(name))
    if config is None:
        if name not in presets():
            known = ", ".join(preset_names())
            raise UnknownWorldError(
                f"world: expected one of {known} or a {SUFFIX} file, got {name!r}"
            )
        config = presets()[name]
    if seed < 0:
        raise ValueError(f"seed: expected 0 or more, got {seed}")
    refuse_judging(seed, release)
    level = config.difficulty if difficulty is None else difficulty
    if not 0 <= level <= 1:
        raise ValueError(f"difficulty: expected 0 to 1, got {level}")
    world = first_solvable(config.family, seed, lambda rng: _make(name, seed, config, level, rng))
    if world is not None:
        return world
    raise UnsolvableWorldError(
        f"world: expected {name} {seed} at difficulty {level} to be solvable in {_ATTEMPTS} "
        f"attempts, got none; lower the difficulty"
    )


def first_solvable(
    family: int, seed: int, make: Callable[[np.random.Generator], World]
) -> World | None:
    """Return the first of a few random worlds that has safe paths, None if none has.

    Args:
        family: Number of the stream of seeds.
        seed: Seed within it.
        make: Generator of a world, which raises ``UnsolvableWorldError`` where it has none.
    """
    # Each attempt has a stream of its own: what one drew does not change the next.
    for attempt in np.random.SeedSequence([family, seed]).spawn(_ATTEMPTS):
        try:
            return make(np.random.default_rng(attempt))
        except UnsolvableWorldError:
            continue
    return None


def _make(
    name: str, seed: int, config: PresetConfig, difficulty: float, rng: np.random.Generator
) -> World:
    """Return one attempt at a world."""
    match config:
        case MazeConfig():
            return make_maze(name, seed, config, difficulty, rng)
        case NaturalConfig():
            return make_natural(name, seed, config, difficulty, rng)
        case HollowConfig():
            return make_hollow(name, seed, config, difficulty, rng)
