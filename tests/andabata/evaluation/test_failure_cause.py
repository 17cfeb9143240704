"""Causes of failures, from the true world."""

import numpy as np
import pytest

from andabata.evaluation.failure_cause import failure_cause, touched_kind
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.episode_monitor import Outcome
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from tests.support.walking_worlds import agent, peopled, walker
from worlds.truth import TruthConfig, build_truth
from worlds.world import World


def hazardous_world():
    """Return a slope of 30 degrees in the east, a low rock, a trunk and a wall."""
    heights = np.zeros((101, 101), dtype=np.float32)
    heights[80:] = (np.arange(21) * 0.2 * np.tan(np.deg2rad(30)))[:, None]
    ground = Heightfield(heights, 0.2)
    objects = (
        box(SemanticClass.ROCK, (0.0, 0.0, 0.05), (0.2, 0.2, 0.1)),
        box(SemanticClass.TRUNK, (0.0, 5.0, 1.0), (0.3, 0.3, 2.0)),
        box(SemanticClass.STONE, (0.0, -5.0, 0.02), (0.2, 0.2, 0.04)),
    )
    surface = np.full((100, 100), SemanticClass.GROUND, dtype=np.uint8)
    truth = build_truth(ground, objects, TruthConfig())
    return World("made", 0, 0.5, ground, surface, objects, (), truth)


@pytest.mark.parametrize(
    ("x", "y", "outcome", "cause"),
    [
        (0.4, 0.0, Outcome.COLLISION, "low rock"),
        (0.4, 5.0, Outcome.COLLISION, "trunk"),
        (0.0, -5.0, Outcome.COLLISION, "ground"),
        (7.5, 0.0, Outcome.TIPOVER, "slope"),
        (-9.9, 0.0, Outcome.TIPOVER, "border"),
        (-4.0, 0.0, Outcome.TIMEOUT, "no way"),
        (-4.0, 0.0, Outcome.STUCK, "free ground"),
        (0.4, 0.0, Outcome.GOAL, ""),
        (0.0, -9.9, Outcome.COLLISION, "border"),
        (0.0, -9.9, Outcome.LEFT_WORLD, "border"),
        (0.4, 0.0, Outcome.FALSE_ARRIVAL, "own estimate"),
        (9.9, 0.0, Outcome.TIMEOUT, "border"),
        (9.9, 0.0, Outcome.GOAL, ""),
        (0.99, 0.0, Outcome.COLLISION, "low rock"),
        (1.02, 0.0, Outcome.COLLISION, "ground"),
        (0.0, 1.2, Outcome.COLLISION, "ground"),
        (0.5, 5.0, Outcome.TIPOVER, "solid"),
    ],
)
def test_the_true_world_gives_the_cause(x, y, outcome, cause):
    """The nearest solid object, the kind of ground, the border, or that there was no way."""
    assert failure_cause(hazardous_world(), np.array([x, y]), outcome) == cause


@pytest.mark.parametrize(
    ("contact", "cause"),
    [
        (Contact.OBSTACLE, "trunk"),
        (Contact.MOVER, "walker"),
        (Contact.HIT, "hit by walker"),
        (Contact.HIT_AT_REST, "hit by walker while standing"),
    ],
)
def test_walkers_are_causes_of_their_own(contact, cause):
    """Who drove into whom decides, whatever stands near."""
    found = failure_cause(hazardous_world(), np.array([0.4, 5.0]), Outcome.COLLISION, contact)
    assert found == cause


def test_the_kind_of_the_walker_that_is_touched():
    """Edges count, not centres; one that is not there, or is not touched, is none."""
    world = peopled(
        hazardous_world(),
        agent("person", (0.0, 0.0)),
        agent("vehicle", (0.0, 0.0), radius=1.0, track=((0.0, 0.0), (1.0, 0.0))),
        walker((0.0, 0.0)),
    )
    rows = np.array([[0.9, 0, 0, 0.25, 1.7], [-1.2, 0, 0, 1.0, 2.0], [0, 0.8, 0, 0.25, 1.7]])
    place = np.zeros(3)
    assert touched_kind(world, place, rows, Contact.HIT) == "vehicle"
    rows[1, 3] = 0.0
    assert touched_kind(world, place, rows, Contact.MOVER) == "walker"
    rows[2, 1] = 3.0
    assert touched_kind(world, place, rows, Contact.HIT_AT_REST) == "person"
    assert touched_kind(world, place, rows, Contact.OBSTACLE) == ""
    assert touched_kind(world, place, None, Contact.HIT) == ""


def test_the_nearest_object_is_the_cause():
    """Of two solid objects in reach the nearer one is named, foliage and stones never."""
    ground = Heightfield(np.zeros((101, 101), dtype=np.float32), 0.2)
    objects = (
        box(SemanticClass.TRUNK, (0.7, 0.0, 1.0), (0.2, 0.2, 2.0)),
        box(SemanticClass.WALL, (-0.6, 0.0, 1.0), (0.2, 2.0, 2.0)),
        box(SemanticClass.HIGH_GRASS, (0.0, 0.3, 0.3), (0.2, 0.2, 0.6)),
    )
    surface = np.full((100, 100), SemanticClass.GROUND, dtype=np.uint8)
    truth = build_truth(ground, objects, TruthConfig())
    world = World("made", 0, 0.5, ground, surface, objects, (), truth)
    for x, cause in ((0.0, "wall"), (0.2, "trunk")):
        assert failure_cause(world, np.array([x, 0.0, 0.0]), Outcome.COLLISION) == cause
