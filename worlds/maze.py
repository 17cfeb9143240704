"""The maze of stages 1 and 2: long thick walls on flat ground (section 5.1)."""

from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box
from worlds.goals import sample_tasks
from worlds.truth import TruthConfig, build_truth
from worlds.world import World


class MazeConfig(BaseModel):
    """Size and walls of a maze (assumption: the paper shows its layout in a picture only).

    Attributes:
        kind: Family of worlds.
        family: Number of the preset's own stream of seeds.
        about: Description in one line.
        difficulty: Default difficulty from 0 to 1; the number of walls rises with it.
        size: Edge of the square [m] (paper: 80).
        corridor: Distance between parallel walls [m].
        wall: Thickness of the walls [m]; thinner walls would fall between the beams end-on.
        height: Height of the walls [m].
        share: Share of the borders between neighbouring cells with a wall, at difficulty 0.5.
        tasks: Number of tasks.
        near: Least straight distance from start to goal [m].
        far: Largest straight distance from start to goal [m].
        longest: Largest length of a safe path from start to goal [m]; in 180 s a robot drives 54 m.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["maze"] = "maze"
    family: int = Field(ge=0)
    about: str = ""
    difficulty: float = Field(default=0.5, ge=0, le=1)
    size: float = Field(default=80.0, ge=20, le=200)
    corridor: float = Field(default=8.0, ge=3, le=20)
    wall: float = Field(default=0.4, ge=0.2, le=2)
    height: float = Field(default=2.0, gt=0.8, le=5)
    share: float = Field(default=0.21, ge=0, le=0.5)
    tasks: int = Field(default=12, ge=1, le=100)
    near: float = Field(default=20.0, gt=2)
    far: float = Field(default=40.0, gt=2)
    longest: float = Field(default=45.0, gt=2)


def make_maze(
    name: str, seed: int, config: MazeConfig, difficulty: float, rng: np.random.Generator
) -> World:
    """Return a maze; every start heading is zero, as in the paper.

    Args:
        name: Name of the preset.
        seed: Seed, for the record.
        config: Size and walls.
        difficulty: Difficulty from 0 to 1.
        rng: Source of randomness.

    Raises:
        UnsolvableWorldError: If no tasks with safe paths are found.
    """
    n = round(config.size) + 1
    ground = Heightfield(np.zeros((n, n), dtype=np.float32), config.size / (n - 1))
    walls = tuple(_walls(config, difficulty, rng))
    truth = build_truth(ground, walls, TruthConfig(border=0.0))
    tasks = sample_tasks(
        truth, config.tasks, 1, (config.near, config.far), config.longest, rng, 0.0
    )
    surface = np.full((n - 1, n - 1), SemanticClass.GROUND, dtype=np.uint8)
    return World(name, seed, difficulty, ground, surface, walls, tasks, truth)


def _walls(config: MazeConfig, difficulty: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return the boundary and random walls between the cells of a square grid."""
    half, thick = config.size / 2, config.wall
    cells = max(2, round(config.size / config.corridor))
    pitch = config.size / cells
    height, z = config.height, config.height / 2
    walls = [
        box(SemanticClass.WALL, centre, size)
        for side in (-half, half)
        for centre, size in (
            ((side, 0.0, z), (thick, config.size + thick, height)),
            ((0.0, side, z), (config.size + thick, thick, height)),
        )
    ]
    share = config.share * (0.5 + difficulty)
    for line in range(1, cells):
        for cell in range(cells):
            across, along = -half + line * pitch, -half + (cell + 0.5) * pitch
            stands = rng.random(2) < share
            if stands[0]:
                size = (thick, pitch + thick, height)
                walls.append(box(SemanticClass.WALL, (across, along, z), size))
            if stands[1]:
                size = (pitch + thick, thick, height)
                walls.append(box(SemanticClass.WALL, (along, across, z), size))
    return walls
