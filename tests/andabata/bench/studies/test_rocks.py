"""Low rocks: which objects count, and how readings of the map are counted."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.bench.studies.rocks import (
    DISTANCES,
    MapReading,
    RockDrive,
    drive_row,
    low_rocks,
    rock_rows,
)
from andabata.tasks.episode_monitor import Outcome
from terrain.classes import SemanticClass
from terrain.objects import box, frustum


def flat_world(*objects):
    ground = SimpleNamespace(height_at=lambda x, y: 1.0)
    return SimpleNamespace(objects=objects, ground=ground)


def test_low_rocks_are_solid_small_and_of_5_to_25_cm():
    """Height is above the ground; wide, high and flat rocks and trees do not count."""

    def rock(x, height, width=0.4):
        return box(SemanticClass.ROCK, (x, 2.0, 1.0), (width, 0.3, 2 * height))

    trunk = frustum(SemanticClass.TRUNK, (9.0, 0.0, 1.0), (0.1, 0.1), 3.0)
    world = flat_world(rock(1, 0.1), rock(3, 0.04), rock(5, 0.3), rock(7, 0.1, 0.7), trunk)
    np.testing.assert_allclose(low_rocks(world), [[1.0, 2.0, 0.1]], atol=1e-6)
    assert low_rocks(flat_world()).shape == (0, 3)


def test_readings_are_counted_by_height_and_distance():
    """Each class of heights includes its lower edge."""
    readings = (
        MapReading(2.0, 0.05, True),
        MapReading(2.0, 0.06, False),
        MapReading(0.8, 0.06, True),
        MapReading(2.0, 0.07, True),
    )
    rows = rock_rows([RockDrive(readings[:2], 0, 0, ()), RockDrive(readings[2:], 0, 0, ())])
    assert [row["height [m]"] for row in rows][:2] == ["0.05 to 0.07", "0.07 to 0.09"]
    assert rows[0]["2.0 m"] == "1 of 2"
    assert rows[0]["0.8 m"] == "1 of 1"
    assert rows[1]["2.0 m"] == "1 of 1"
    assert rows[2]["2.0 m"] == "0 of 0"
    assert len(rows[0]) == 1 + len(DISTANCES)


def test_false_walls_are_a_share_of_the_clear_cells():
    """Attempts of all drives count."""
    goal = SimpleNamespace(outcome=Outcome.GOAL, time=10.0, spl=0.8)
    miss = SimpleNamespace(outcome=Outcome.COLLISION, time=20.0, spl=0.0)
    row = drive_row([RockDrive((), 30, 3, (goal, miss)), RockDrive((), 10, 0, (goal,))])
    assert row["clear cells"] == 40
    assert row["false walls"] == pytest.approx(0.075)
    assert row["goals"] == "2 of 3"
    assert row["mean time [s]"] == pytest.approx(40 / 3)
    assert row["SPL"] == pytest.approx(1.6 / 3)
