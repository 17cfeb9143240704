"""Cost map: clearances and costs of known value."""

import numpy as np
import pytest

from andabata.navigation.planning.cost_map import CostConfig, CostMap, CostWeights, Passage
from andabata.navigation.planning.geofence_bounds import EVERYWHERE, geofence_in_odom
from andabata.navigation.planning.map_transform import MapTransform

CELLS, CELL = 64, 0.2
WEIGHTS = CostWeights.of(CostConfig(), lethal_log_odds=1.0, max_log_odds=3.0)
MIDDLE = CELLS // 2
CENTRE = np.zeros(2, dtype=np.int64)


def free(value=-1.0):
    """Return log odds of the same value everywhere."""
    return np.full((CELLS, CELLS), value, dtype=np.float32)


def mapped(
    log_odds,
    geofence=EVERYWHERE,
    hits=None,
    centre=CENTRE,
    weights=WEIGHTS,
    passage=(0.4, 0.25, 0.7),
):
    """Return the cost map of a small square."""
    found = CostMap(CELLS, CELL, weights, Passage(*passage))
    found.update(log_odds, centre, geofence, hits)
    return found


def test_costs_around_an_obstacle_have_known_values():
    """Twice to once the inscribed cost inside its radius; inflation falls to none at its own."""
    log_odds = free()
    log_odds[0, 0] = 2.0
    found = mapped(log_odds)
    row = found.costs[MIDDLE : MIDDLE + 10, MIDDLE]
    expected = [86.0, 27.0, 21.0, 2.75, 2.25, 1.75, 1.25, 1.0, 1.0, 1.0]
    np.testing.assert_allclose(row, expected, rtol=1e-5)
    np.testing.assert_allclose(found.costs[MIDDLE, MIDDLE : MIDDLE + 10], expected, rtol=1e-5)
    np.testing.assert_allclose(found.costs[MIDDLE, MIDDLE::-1][:10], expected, rtol=1e-5)
    np.testing.assert_allclose(found.costs[MIDDLE::-1, MIDDLE][:10], expected, rtol=1e-5)
    diagonal = 3.0 + 15.0 * (2.0 - 0.2 * np.sqrt(2.0) / 0.5)
    corners = found.costs[MIDDLE - 1 : MIDDLE + 2 : 2, MIDDLE - 1 : MIDDLE + 2 : 2]
    np.testing.assert_allclose(corners, diagonal, rtol=1e-5)


def test_clearance_is_the_chamfer_distance_up_to_the_inflation_radius():
    """Straight steps count one cell, diagonal ones the root of two."""
    log_odds = free()
    log_odds[3, -2] = 1.1
    found = mapped(log_odds)
    i, j = np.abs(np.mgrid[:CELLS, :CELLS] - np.array([MIDDLE + 3, MIDDLE - 2])[:, None, None])
    chamfer = np.maximum(i, j) + (np.sqrt(2.0) - 1.0) * np.minimum(i, j)
    np.testing.assert_allclose(found.clearance, np.minimum(chamfer, 6.5), rtol=1e-5)


def distances_from(places):
    """Return the distance of each cell's middle from the nearest of some places, in cells."""
    x, y = np.mgrid[:CELLS, :CELLS] + 0.5
    return np.min([np.hypot(x - u, y - v) for u, v in places], axis=0)


@pytest.mark.parametrize("seed", range(4))
def test_with_hits_clearance_is_the_distance_from_the_places_in_the_cells(seed):
    """It is exact, for obstacles alone, up to the inflation radius, wherever the square lies."""
    rng = np.random.default_rng(seed)
    log_odds, hits = free(), rng.uniform(0.0, 1.0, (CELLS, CELLS, 2)).astype(np.float32)
    cells, centre = rng.integers(0, CELLS, (30, 2)), rng.integers(-500, 500, 2)
    log_odds[tuple(cells.T)] = 1.1
    found = mapped(log_odds, centre=centre, hits=hits)
    places = (cells - (centre - MIDDLE)) % CELLS + hits[tuple(cells.T)]
    expected = np.minimum(distances_from(places), 6.5)
    np.testing.assert_allclose(found.clearance, expected, atol=1e-5)


def test_with_hits_in_the_middles_of_cells_costs_are_those_without_along_a_row():
    """The two clearances agree where the chamfer transform is exact."""
    log_odds = free()
    log_odds[0, 0] = 2.0
    middles = np.full((CELLS, CELLS, 2), 0.5, dtype=np.float32)
    exact, chamfer = mapped(log_odds, hits=middles), mapped(log_odds)
    np.testing.assert_allclose(exact.costs[MIDDLE], chamfer.costs[MIDDLE], rtol=1e-5)
    np.testing.assert_allclose(exact.costs[:, MIDDLE], chamfer.costs[:, MIDDLE], rtol=1e-5)
    assert (exact.costs[MIDDLE + 1 :, MIDDLE + 1 :] >= 1.0).all()


def test_with_hits_the_geofence_counts_by_the_middles_of_its_cells():
    """Cells outside have no clearance, those inside their distance from the nearest outside."""
    geofence = geofence_in_odom((-2.0, -50.0, 50.0, 50.0), MapTransform())
    hits = np.zeros((CELLS, CELLS, 2))
    found = mapped(free(), geofence=geofence, hits=hits.astype(np.float32))
    first = MIDDLE - 10
    assert (found.clearance[:first] == 0.0).all()
    rows = np.minimum(np.arange(1, CELLS - first + 1), 6.5)
    np.testing.assert_allclose(found.clearance[first:], np.repeat(rows[:, None], CELLS, 1))


@pytest.mark.parametrize(
    ("log_odds", "cost"),
    [(0.0, 1.5), (0.5, 2.5), (1.0, 4.0), (-0.5, 1.0), (-3.0, 1.0), (np.nan, 1.0)],
)
def test_log_odds_have_a_known_cost_in_the_open(log_odds, cost):
    """Unknown ground costs half a metre more, uncertain ground its share of lethal log odds."""
    found = mapped(free(log_odds))
    np.testing.assert_allclose(found.costs, cost)


def test_each_cost_is_that_of_the_cells_own_clearance_and_log_odds():
    """To the last bit, in rows near obstacles and in those that are far from all."""
    rng = np.random.default_rng(5)
    log_odds = rng.uniform(-4.0, 1.0, (CELLS, CELLS)).astype(np.float32)
    log_odds[rng.uniform(size=log_odds.shape) < 0.3] = 0.0
    log_odds[:20][rng.uniform(size=(20, CELLS)) < 0.03] = 2.5
    found = mapped(log_odds, centre=np.array([MIDDLE, MIDDLE]))  # Nothing is wrapped around.
    known, clearance = log_odds.astype(float), found.clearance.astype(float) * CELL
    sure = 50.0 * np.maximum(known - 1.0, 0.0)
    seen = np.where(known > 0.0, 3.0 * np.minimum(known, 1.0) + sure, 0.0)
    cost = 1.0 + np.where(known == 0.0, 0.5, seen)
    cost += np.where(clearance < 0.5, 15.0 * (2.0 - clearance / 0.5), 0.0)
    falling = np.minimum((1.3 - clearance) / (1.3 - 0.5), 1.0)
    cost += np.where(clearance < 1.3, 2.0 * falling, 0.0)
    expected = np.where(known <= -3.0, 1.0, cost).astype(np.float32)
    np.testing.assert_array_equal(found.costs, expected)


def test_lethal_is_what_exceeds_the_threshold():
    """Log odds at the threshold are no obstacle, a little more is one."""
    log_odds = free()
    log_odds[0, 0], log_odds[0, 20] = 1.0, 1.001
    found = mapped(log_odds)
    assert found.clearance[MIDDLE, MIDDLE] == 6.5
    assert found.clearance[MIDDLE, MIDDLE + 20] == 0.0


@pytest.mark.parametrize(("lethal", "highest"), [(1.0, 136.0), (2.0, 61.0)])
def test_no_cost_is_higher_than_the_highest(lethal, highest):
    """The highest cost is that of a certain obstacle among others."""
    weights = WEIGHTS._replace(lethal_log_odds=lethal)
    found = mapped(free(3.0), weights=weights)
    assert found.costs.max() == pytest.approx(weights.highest)
    assert weights.highest == pytest.approx(highest)


def test_weights_are_those_of_the_configuration():
    """Each number of the configuration has its place among the weights."""
    config = CostConfig(
        inscribed_radius=0.1,
        inflation_radius=0.2,
        inscribed_cost=3.0,
        inflation_cost=4.0,
        unknown_cost=5.0,
        uncertain_cost=6.0,
        lethal_cost=7.0,
    )
    assert CostWeights.of(config, 8.0, 9.0) == (8.0, 9.0, 0.1, 0.2, 3.0, 4.0, 5.0, 6.0, 7.0)
    assert CostWeights.of(config, 8.0, 9.0)._asdict() == {
        "lethal_log_odds": 8.0,
        "max_log_odds": 9.0,
        **config.model_dump(),
    }


def test_traversed_clearance_grows_where_the_robot_came_through():
    """The passage's clearance at the middle of the trail, less towards its edges, behind alone."""
    log_odds = free()
    log_odds[:, 2], log_odds[:, -2] = 2.0, 2.0
    log_odds[:, 0] = -6.0  # The robot's middle was there.
    log_odds[:, 1] = -3.0  # As far from the middle as counts as driven.
    found = mapped(log_odds, passage=(0.8, 0.15, 1.0))
    clearance, traversed = found.clearance, found.traversed_clearance
    far = MIDDLE + 10
    assert clearance[far, MIDDLE] == 2.0
    assert traversed[far, MIDDLE] == pytest.approx(4.0)
    assert clearance[far, MIDDLE + 1] == 1.0
    assert traversed[far, MIDDLE + 1] == pytest.approx(4.0 - 0.75)
    # Not under the body, nor in obstacles, nor where it has not been.
    assert traversed[MIDDLE + 5, MIDDLE] == 2.0
    assert traversed[MIDDLE + 6, MIDDLE] == pytest.approx(4.0)
    assert traversed[far, MIDDLE + 2] == 0.0
    np.testing.assert_array_equal(traversed[:, MIDDLE + 3 :], clearance[:, MIDDLE + 3 :])


def test_known_clearances_cost_what_they_cost_where_they_are_computed():
    """Costs of the same clearances are the same, to the bit; the far ones count as far."""
    log_odds = free()
    log_odds[MIDDLE, MIDDLE] = 2.0
    expected = mapped(log_odds, centre=np.array([MIDDLE, MIDDLE]))  # Nothing is wrapped around.
    found = CostMap(CELLS, CELL, WEIGHTS, Passage(0.4, 0.25, 0.7))
    metres = expected.clearance * np.float32(CELL)
    metres[expected.clearance == expected.clearance.max()] = 40.0
    found.take(log_odds, metres)
    np.testing.assert_allclose(found.clearance, expected.clearance, rtol=1e-6)
    assert (found.traversed_clearance == found.clearance).all()
    np.testing.assert_allclose(found.costs, expected.costs, rtol=1e-5)
    assert found.costs[0, 0] == 1.0
