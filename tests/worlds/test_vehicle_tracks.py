"""Tracks of vehicles: wide enough everywhere, long enough, and away from the robot's starts."""

from itertools import pairwise

import numpy as np

from terrain.classes import SemanticClass
from terrain.objects import box, frustum
from worlds.vehicle_tracks import START_GAP, draw_track
from worlds.walkers import solids_room
from worlds.world import Start, Task

RADIUS, LEAST = 0.9, 10.0


def places_on(track):
    """Return places every few centimetres of a track [m], shape (k, 2)."""
    track = np.array(track)
    shares = np.linspace(0, 1, 400)[:, None]
    return np.concatenate([(1 - shares) * a + shares * b for a, b in pairwise(track)])


def test_a_track_is_wide_long_and_away_from_starts(make_ground):
    """Trunks keep the vehicle's radius and the robot's start 2 m more."""
    rng = np.random.default_rng(5)
    trunks = [
        frustum(SemanticClass.TRUNK, (*place, 0.0), (0.3, 0.3), 3.0)
        for place in rng.uniform(-19, 19, (25, 2))
    ]
    world = make_ground(objects=trunks, size=40.0)
    room = solids_room(world.ground, world.objects)
    tasks = [Task(Start(0.0, 0.0, 0.0), ((9.0, 0.0),))]
    for seed in range(5):
        generator = np.random.default_rng(seed)
        track = draw_track(RADIUS, LEAST, room, world.truth, tasks, generator)
        places = places_on(track)
        assert room.clearance(places).min() > RADIUS
        assert np.hypot(*places.T).min() > RADIUS + START_GAP - 0.05
        assert np.hypot(*np.subtract(track[-1], track[0])) >= LEAST


def test_a_track_in_the_open_is_straight(make_ground):
    """It has two corners, and the same seed gives the same ones."""
    world = make_ground(size=60.0)
    room = solids_room(world.ground, ())
    first, again = (
        draw_track(RADIUS, LEAST, room, world.truth, (), np.random.default_rng(1)) for _ in range(2)
    )
    assert first == again
    (x, y), (u, v) = first[0], first[-1]
    off = [(u - x) * (b - y) - (v - y) * (a - x) for a, b in first]
    assert np.abs(off).max() / np.hypot(u - x, v - y) < 0.3


def test_no_track_where_nothing_wide_is_free(make_ground):
    """Among walls a metre apart there is none."""
    walls = [box(SemanticClass.WALL, (x, 0.0, 0.5), (0.1, 18.0, 1.0)) for x in range(-9, 10)]
    world = make_ground(objects=walls)
    room = solids_room(world.ground, world.objects)
    assert draw_track(RADIUS, 5.0, room, world.truth, (), np.random.default_rng(0)) == ()
