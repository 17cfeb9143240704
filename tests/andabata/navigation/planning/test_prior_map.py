"""Laws of prior maps: slopes cost on unknown ground alone, and the rest of the way knows them."""

import numpy as np
import pytest
from numpy.typing import NDArray

from andabata.navigation.planning.cost_map import CostConfig, CostWeights, Passage
from andabata.navigation.planning.cost_to_go import edge_cells
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.grid_planner import GridPlanner
from andabata.navigation.planning.map_transform import MapTransform
from andabata.navigation.planning.prior_map import PriorMap, PriorMapConfig, slope_costs
from terrain.heightfield import Heightfield

CELLS, CELL = 64, 0.2
COSTS = CostConfig()
UNKNOWN = 1.0 + COSTS.unknown_cost
STEEP = 10.0


def heights(of_x: NDArray[np.float64], cell: float = 1.0) -> Heightfield:
    """Return ground whose height depends on x alone, as wide as it is long."""
    return Heightfield(np.repeat(of_x[:, None], len(of_x), axis=1).astype(np.float32), cell)


def bank() -> Heightfield:
    """Return level ground with a bank of 45 degrees at x = 10 to 14 m, which ends at y = 15 m."""
    lines = np.arange(-30, 31.0)
    up = np.clip(lines - 10, 0, 4)
    shape = np.repeat(up[:, None], len(lines), axis=1)
    shape[:, lines > 15] = 0.0
    return Heightfield(shape.astype(np.float32), 1.0)


def prior_of(ground: Heightfield) -> PriorMap:
    """Return the prior map of heights with known costs."""
    costs = slope_costs(ground, PriorMapConfig(steep_cost=STEEP))
    return PriorMap(costs, ground.cell, UNKNOWN)


def planner(prior: PriorMap | None) -> GridPlanner:
    """Return a planner of a square of 12.8 m."""
    weights = CostWeights.of(COSTS, 1.0, 3.0)
    return GridPlanner(CELLS, CELL, weights, (1.5, 5.0), 0.0, Passage(0.4, 0.25, 0.7), prior)


def square(corner: tuple[float, float], prior: PriorMap, transform: MapTransform) -> np.ndarray:
    """Return the extra costs of a square."""
    extra = np.full((CELLS, CELLS), np.nan, dtype=np.float32)
    prior.price_square(np.array(corner), CELL, transform, extra)
    return extra


@pytest.mark.parametrize(
    ("degrees", "extra"), [(0, 0.0), (15.9, 0.0), (20, STEEP / 2), (24, STEEP), (40, STEEP)]
)
def test_a_slope_costs_where_it_is_likely_forbidden(degrees: float, extra: float) -> None:
    """Nothing where it is gentle, half at the limit, and no more where it is surely too steep."""
    slope = heights(np.tan(np.deg2rad(degrees)) * np.arange(11.0))

    assert prior_of(slope).extra == pytest.approx(extra, abs=1e-3)


def test_extra_costs_lie_where_the_slope_is_in_the_map() -> None:
    """A square that is turned and shifted has the costs of the places where it lies in the map."""
    prior, quarter = prior_of(bank()), MapTransform(0.0, 1.0, 2.0, -1.0)

    extra = square((-5.0, -12.0), prior, quarter)

    i, j = np.indices(extra.shape)
    x, y = -5.0 + (i + 0.5) * CELL, -12.0 + (j + 0.5) * CELL
    map_x, map_y = -y + 2.0, x - 1.0
    on_bank = (map_x > 10.5) & (map_x < 13.5) & (map_y < 14)
    off_bank = (map_x < 9) | (map_x > 15.5) | (map_y > 17.5)
    assert on_bank.any()
    assert (extra[on_bank] == STEEP).all()
    assert off_bank.any()
    assert (extra[off_bank] == 0.0).all()


def test_beyond_the_known_heights_nothing_is_known() -> None:
    """Ground costs as the known one on average, and there is no way to or from it."""
    prior = prior_of(bank())

    assert square((100.0, 0.0), prior, MapTransform()) == pytest.approx(prior.extra.mean())
    far, near = np.array([100.0, 0.0]), np.array([0.0, 0.0])
    assert np.isnan(prior.costs_to(near, far[None], MapTransform())).all()
    assert np.isnan(prior.costs_to(far, near[None], MapTransform())).all()


def test_level_ground_costs_the_way_over_unknown_ground() -> None:
    """Along the grid and its diagonals the cost of the way is its length over unknown ground."""
    prior = prior_of(heights(np.zeros(61)))
    places = np.array([[10.0, 0.0], [0.0, -7.0], [5.0, 5.0], [0.0, 0.0]])

    costs = prior.costs_to(np.zeros(2), places, MapTransform())

    assert costs == pytest.approx(UNKNOWN * np.array([10.0, 7.0, np.hypot(5, 5), 0.0]))


def test_the_way_leads_around_a_bank() -> None:
    """Before a bank with an open end it costs less from nearer to that end."""
    prior = prior_of(bank())
    places = np.array([[8.0, 14.0], [8.0, 0.0]])

    end, middle = prior.costs_to(np.array([25.0, 0.0]), places, MapTransform())

    assert end < middle


def test_another_goal_is_searched_anew() -> None:
    """Costs are those to the goal that is asked for, whatever was asked before."""
    prior, place = prior_of(bank()), np.zeros((1, 2))

    first = prior.costs_to(np.array([-5.0, 0.0]), place, MapTransform())
    prior.costs_to(np.array([25.0, 0.0]), place, MapTransform())

    assert prior.costs_to(np.array([-5.0, 0.0]), place, MapTransform()) == first


def plan_to(plan: GridPlanner, goal: tuple[float, float], seen: float = 0.0) -> np.ndarray:
    """Return the way of a plan from the origin to a goal, over ground of some log odds."""
    log_odds = np.full((CELLS, CELLS), seen, dtype=np.float32)
    plan.plan(log_odds, np.zeros(2, dtype=np.int64), EVERYWHERE, np.zeros(2), np.array(goal))
    return plan.way(np.zeros(2))


def test_a_plan_heads_for_the_end_of_a_bank_that_no_scan_has_seen() -> None:
    """The square ends before the bank, and its goal lies behind it."""
    straight, around = planner(None), planner(prior_of(bank()))
    shift = MapTransform(1.0, 0.0, 2.0, 5.0)
    straight.map_of_odom = around.map_of_odom = shift

    assert plan_to(straight, (20.0, 0.0))[-1, 1] == pytest.approx(0.0, abs=0.5)
    assert plan_to(around, (20.0, 0.0))[-1, 1] > 3.0


def test_what_was_seen_counts_as_it_was_seen() -> None:
    """Ground that scans have seen free costs nothing extra, however steep it was said to be."""
    steep = prior_of(heights(np.arange(61.0)))
    plan = planner(steep)

    plan_to(plan, (3.0, 0.0), seen=-1.0)
    assert (plan.costs == 1.0).all()
    plan_to(plan, (3.0, 0.0))
    assert (plan.costs == np.float32(UNKNOWN + STEEP)).all()


def test_a_level_prior_changes_little() -> None:
    """Over level ground the way to a goal beyond the square is as straight as without a prior."""
    way = plan_to(planner(prior_of(heights(np.zeros(61)))), (20.0, 0.0))

    assert np.abs(way[:, 1]).max() < 0.5


def test_to_a_goal_beyond_the_known_heights_the_way_is_straight_over_average_ground() -> None:
    """From each cell of the edge; where the way is unknown it is neither free nor without hills."""
    prior = prior_of(bank())
    plan = planner(prior)

    plan_to(plan, (100.0, 0.0))

    cells = np.array([500, 0]) - (edge_cells(CELLS) - CELLS // 2)
    straight = (UNKNOWN + prior.outside) * np.hypot(*cells.T)
    assert prior.outside > 0.1
    np.testing.assert_allclose(plan.search.beyond, straight, rtol=1e-5)


def test_costs_beyond_the_square_stay_within_the_queue() -> None:
    """A cell of the edge that is deep in steep ground costs a bounded amount more than the best."""
    lines = np.arange(-30, 31.0)
    shape = np.repeat(np.minimum(lines, 0.0)[None, :], len(lines), axis=0)
    plan = planner(prior_of(Heightfield(shape.astype(np.float32), 1.0)))

    plan_to(plan, (20.0, 2.0))

    beyond = plan.search.beyond
    assert beyond.max() == pytest.approx(beyond.min() + 2 * UNKNOWN * CELLS, rel=1e-6)
