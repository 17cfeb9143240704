"""Time to go: known times, and the same judgement of gaps as the rollouts' margin."""

import numpy as np
import pytest

from andabata.navigation.planar.time_to_go import (
    MarginConfig,
    TimeToGo,
    TimeToGoConfig,
    allowed_speed,
    limits_of,
    time_at,
)
from tests.support.hit_squares import hits_at

CELLS, CELL = 128, 0.05
HALF_WIDTH, MARGIN, CONFIG = 0.215, MarginConfig(), TimeToGoConfig()
LIMITS = limits_of(HALF_WIDTH, 2.0, MARGIN, CONFIG)


def field_of(places, start=(0.0, 0.0), goal=(2.0, 0.0), **options):
    """Return the field around some obstacles."""
    config = CONFIG.model_copy(update=options)
    field = TimeToGo(CELLS, CELL, limits_of(HALF_WIDTH, 2.0, MARGIN, config), config)
    field.update(hits_at(places, CELLS, CELL), np.array(start), np.array(goal))
    return field.field


def wall(x, y_from, y_to):
    """Return hits of a wall across the way."""
    return [(x, y) for y in np.arange(y_from, y_to, 0.04)]


@pytest.mark.parametrize("speed", [0.3, 1.0, 2.0])
def test_the_allowed_speed_is_the_one_whose_margin_fits(speed):
    """A robot in the middle of a gap at that speed has exactly the margin of its rollouts."""
    assert allowed_speed(HALF_WIDTH + MARGIN.at(speed), LIMITS) == pytest.approx(speed)


def test_allowed_speeds_end_at_the_least_and_the_largest():
    """Contact still allows the least speed, open ground no more than the largest."""
    assert allowed_speed(0.0, LIMITS) == CONFIG.min_speed
    assert allowed_speed(10.0, LIMITS) == 2.0


def test_in_the_open_the_time_is_the_way_at_the_largest_speed():
    """Unknown ground is free, also beyond the square."""
    assert time_at(field_of([]), 0.0, 0.0) == pytest.approx(1.0, abs=0.05)
    assert time_at(field_of([], goal=(20.0, 0.0)), 0.0, 0.0) == pytest.approx(10.0, abs=0.1)


def test_a_corridor_takes_the_time_that_its_clearance_allows():
    """0.365 m to either side allow 1 m/s."""
    along = np.arange(-3.2, 3.2, 0.04)
    for half, speed in ((0.365, 1.0), (0.415, 1.5)):
        sides = [(x, y) for x in along for y in (-half, half)]
        # The middles of the field's cells are 0.05 m beside the corridor's.
        spent = time_at(field_of([(x, y + 0.05) for x, y in sides]), -1.0, 0.05)
        assert spent == pytest.approx(3.0 / speed, rel=0.03)


def test_a_way_without_the_standing_margin_costs_its_proximity():
    """A corridor as wide as the robot takes many times longer, one with the margin does not."""
    along = np.arange(-3.2, 3.2, 0.04)
    for half, costs in ((HALF_WIDTH, True), (0.365, False)):
        sides = [(x, y + 0.05) for x in along for y in (-half, half)]
        free, spent = (
            time_at(field_of(sides, proximity_cost=cost), -1.0, 0.05) for cost in (0.0, 40.0)
        )
        assert spent > 3.0 * free if costs else spent == free


def test_a_gap_without_room_for_the_margin_is_gone_round():
    """With room the way leads through; without, the field falls towards the wall's end."""
    for half, through in ((0.5, True), (0.2, False)):
        barrier = wall(0.8, -1.5, 0.05 - half) + wall(0.8, 0.05 + half, 3.0)
        field = field_of(barrier, goal=(2.5, 0.05))
        ahead, aside = time_at(field, 0.3, 0.05), time_at(field, 0.3, -0.6)
        assert (ahead < aside) == through


def test_where_the_search_has_not_been_the_time_is_a_lower_bound():
    """It is the robot's and the margin, not infinite."""
    field = field_of([], start=(1.5, 0.0), goal=(2.0, 0.0), margin=0.2)
    assert np.isinf(field.times[0, 0])
    assert time_at(field, -3.1, -3.1) == pytest.approx(0.25 + 0.2, abs=0.06)


def test_a_least_speed_above_the_largest_is_refused():
    """The message says what to change."""
    with pytest.raises(ValueError, match="min_speed: expected at most"):
        limits_of(HALF_WIDTH, 0.2, MARGIN, CONFIG)
