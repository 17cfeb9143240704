"""Mazes: flat ground, walls on the borders of cells, as many as the difficulty asks for."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from tests.support.true_maps import solid_at
from worlds.maze import MazeConfig, _walls, make_maze

CONFIG = MazeConfig(family=1, tasks=2)


@pytest.fixture(scope="module")
def maze():
    return make_maze("maze", 0, CONFIG, 0.5, np.random.default_rng(0))


def test_a_maze_is_flat_and_closed(maze):
    """The ground is level, and the border is solid on all sides."""
    world = maze
    assert (world.ground.heights == 0).all()
    assert {each.semantic for each in world.objects} == {SemanticClass.WALL}
    along = np.linspace(-39.9, 39.9, 200)
    for side in (-40.0, 40.0):
        assert solid_at(world.truth, np.full(200, 0.99 * side + np.sign(side) * 0.35), along).all()
        assert solid_at(world.truth, along, np.full(200, 0.99 * side + np.sign(side) * 0.35)).all()


def test_every_start_faces_east(maze):
    """The paper's headings are zero."""
    assert [task.start.yaw for task in maze.tasks] == [0.0, 0.0]


@pytest.mark.parametrize("difficulty", [0.0, 0.5, 1.0])
def test_the_share_of_walls_rises_with_difficulty(difficulty):
    """At 0.5 the share is the configured one; at 0 it is half, at 1 one and a half times it."""
    borders = 2 * 9 * 10
    counts = [
        len(_walls(CONFIG, difficulty, np.random.default_rng(seed))) - 4 for seed in range(20)
    ]
    expected = 0.21 * (0.5 + difficulty)
    assert np.mean(counts) / borders == pytest.approx(expected, abs=0.015)


def test_walls_stand_on_the_borders_between_cells(maze):
    """Each wall is as long as a cell and lies on a multiple of the corridor's width."""
    for wall in maze.objects[4:]:
        low, high = wall.vertices.min(axis=0), wall.vertices.max(axis=0)
        assert sorted((high - low).tolist()) == pytest.approx([0.4, 2.0, 8.4], abs=1e-4)
        thin = int(np.argmin((high - low)[:2]))
        middle = float((low + high)[thin] / 2)
        assert middle % 8.0 == pytest.approx(0.0, abs=1e-4)
