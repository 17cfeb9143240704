"""Forecast: who counts, where movers are expected, and what it costs to be near them then."""

import numpy as np
import pytest

from andabata.navigation.mover_forecast import (
    MoverForecastConfig,
    forecast_of,
    mover_offset,
    mover_price,
)
from andabata.navigation.mover_tracks import TrackedMovers

CONFIG = MoverForecastConfig()
ORIGIN, SPEED = np.zeros(2), 0.6
RADIUS = 0.3
MIDDLE = (0.0, 0.0)


def tracks(places, velocities, doubt=0.0):
    """Return movers of one size."""
    count = len(places)
    places, velocities = np.array(places, dtype=float), np.array(velocities, dtype=float)
    filled = [np.full(count, value) for value in (RADIUS, 1.0, doubt)]
    return TrackedMovers(
        places.reshape(-1, 2), velocities.reshape(-1, 2), *filled, np.arange(float(count))
    )


def near(places, velocities, doubt=0.0, **settings):
    """Return the forecast for a robot at the origin."""
    config = MoverForecastConfig(**settings)
    return forecast_of(tracks(places, velocities, doubt), config, ORIGIN, SPEED)


def price(x, y, time, forecast, ahead=MIDDLE):
    return mover_price(x, y, ahead, RADIUS, time, forecast)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 4.1, 1e300])
def test_velocities_that_nothing_has_are_not_believed(bad):
    """Not finite, or faster than anything that the robot meets: the others still count."""
    found = near([(1.0, 0.0), (2.0, 0.0)], [(bad, 0.0), (0.5, 0.0)])
    np.testing.assert_array_equal(found.places, [(2.0, 0.0)])
    assert not len(near([(1.0, 0.0)], [(0.0, bad)]).radii)


@pytest.mark.parametrize("column", [0, 2, 4])
def test_places_radii_and_doubts_that_are_no_numbers_are_not_believed(column):
    """A price that is no number would choose nothing."""
    movers = tracks([(1.0, 0.0), (2.0, 0.0)], [(0.5, 0.0), (0.5, 0.0)])
    movers[column][0] = np.nan
    found = forecast_of(movers, CONFIG, ORIGIN, SPEED)
    np.testing.assert_array_equal(found.places, [(2.0, 0.0)])
    assert np.isfinite(price(1.5, 0.0, 0.0, found))


def test_of_five_hundred_movers_the_first_to_arrive_count():
    """The cost of a decision is bounded, whatever the number."""
    rng = np.random.default_rng(0)
    places = rng.uniform(-6.0, 6.0, (500, 2))
    movers = tracks(places, rng.uniform(-1.0, 1.0, (500, 2)))
    found = forecast_of(movers, CONFIG, ORIGIN, SPEED)
    assert len(found.radii) == CONFIG.max_movers
    times = (np.hypot(*places.T) - RADIUS) / (np.hypot(*movers.velocities.T) + SPEED)
    nearest = places[np.argsort(times)[: CONFIG.max_movers]]
    np.testing.assert_array_equal(found.places, nearest)


def test_what_cannot_be_there_in_time_does_not_count():
    """At 0.9 m/s and the robot's 0.6 a gap of 10.5 m closes in 7 s."""
    far = RADIUS + 10.5
    assert len(near([(far - 0.1, 0.0)], [(-0.9, 0.0)]).radii) == 1
    assert not len(near([(far + 0.1, 0.0)], [(-0.9, 0.0)]).radii)


def test_places_count_from_an_origin():
    """The square of a plan lies anywhere in odom."""
    corner = np.array([-25.0, 3.0])
    found = forecast_of(tracks([(1.0, 2.0)], [(0.5, 0.0)]), CONFIG, ORIGIN, SPEED, corner)
    np.testing.assert_allclose(found.places, [(26.0, -1.0)])


def test_movers_go_on_straight():
    """A place and a time give where the mover is from there."""
    found = near([(1.0, 2.0)], [(0.5, -1.0)])
    np.testing.assert_allclose(mover_offset(*found[:2], 0, 2.0, 0.5, -1.0), (1.5, 1.0))


def test_only_the_time_of_the_meeting_costs():
    """Where a mover will be in four seconds is free before."""
    crossing = near([(0.0, -4.0)], [(0.0, 1.0)])
    assert price(0.0, 0.0, 4.0, crossing) > 0.0
    assert price(0.0, 0.0, 1.0, crossing) == 0.0
    assert price(0.0, 0.0, 7.0, crossing) == 0.0


def test_contact_costs_most_and_distance_less_and_less():
    """In contact the cost is that of the settings; beyond doubt and margin there is none."""
    still = near([(0.0, 0.0)], [(0.0, 0.0)])
    assert price(0.5, 0.0, 0.0, still) == pytest.approx(CONFIG.contact_cost)
    half = 2 * RADIUS + CONFIG.margin / 2
    assert price(half, 0.0, 0.0, still) == pytest.approx(CONFIG.contact_cost / 4)
    assert price(2 * RADIUS + CONFIG.margin + 0.01, 0.0, 0.0, still) == 0.0


def test_doubt_grows_with_time_and_widens_and_lowers_the_cost():
    """What is less sure is kept away from farther, and weighs less."""
    for now, later in ((near([(0, 0)], [(0, 0)]), near([(0, 0)], [(0, 0)], doubt=2.0)),):
        aside = 2 * RADIUS + CONFIG.margin + 0.3
        assert price(aside, 0.0, 0.0, now) == 0.0 < price(aside, 0.0, 0.0, later)
        assert price(aside, 0.0, 3.0, now) > 0.0
        assert price(0.0, 0.0, 0.0, later) < price(0.0, 0.0, 0.0, now)
    assert price(0.0, 0.0, 100.0, now) == pytest.approx(
        CONFIG.contact_cost * CONFIG.sure_doubt / CONFIG.max_doubt
    )


def test_nobody_crosses_close_before_a_mover():
    """The way of the next moment belongs to it; what lies behind does not."""
    going = near([(0.0, 0.0)], [(1.0, 0.0)])
    before = 2 * RADIUS + CONFIG.headway
    assert price(before, 0.0, 0.0, going) == pytest.approx(CONFIG.contact_cost)
    assert price(-before, 0.0, 0.0, going) == 0.0


def test_both_ends_of_the_body_count():
    """Two circles cover it, before and behind its middle."""
    still = near([(0.0, 0.0)], [(0.0, 0.0)])
    beside = 2 * RADIUS + CONFIG.margin + 0.1
    assert price(beside, 0.0, 0.0, still) == 0.0
    assert price(beside, 0.0, 0.0, still, (0.17, 0.0)) > 0.0
    assert price(beside, 0.0, 0.0, still, (-0.17, 0.0)) > 0.0
    assert price(beside, 0.0, 0.0, still, (0.0, 0.17)) == 0.0


def test_without_doubt_and_margin_prices_are_numbers():
    """Contact costs all, and a hair beyond it nothing."""
    bare = near([(0.0, 0.0)], [(0.0, 0.0)], doubt_growth=0.0, margin=0.0)
    assert price(0.5, 0.0, 0.0, bare) == pytest.approx(CONFIG.contact_cost)
    assert price(0.61, 0.0, 0.0, bare) == 0.0
