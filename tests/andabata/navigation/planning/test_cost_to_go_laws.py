"""Laws of the cost to go: bounds, growth with the costs, both ways alike, mirrored maps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from andabata.navigation.planning.cost_to_go import search, search_for
from tests.support.properties import law

CELLS = 24
HIGHEST = 40.0
cells = st.integers(0, CELLS - 1)
places = st.tuples(cells, cells)


@st.composite
def maps(draw):
    """Return costs of cells: even ground with expensive patches, none below 1."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    share = draw(st.floats(0.0, 0.6, allow_subnormal=False))
    costs = np.where(rng.random((CELLS, CELLS)) < share, rng.uniform(1.0, HIGHEST), 1.0)
    return (costs * rng.uniform(1.0, 1.5, costs.shape)).astype(np.float32)


def cost_to_go(costs, last, first=(0, 0)):
    """Return the cost of the way to a cell from everywhere."""
    around = search_for(costs, np.empty_like(costs), float(costs.max()), 1.0)
    around.first[:] = first
    search(around, np.array(last), 1e6)
    return around.cost_to_go.copy()


def octile(last):
    """Return the length of the way to a cell in steps to eight neighbours."""
    i, j = np.abs(np.mgrid[:CELLS, :CELLS] - np.array(last)[:, None, None])
    return np.maximum(i, j) + (np.sqrt(2.0) - 1.0) * np.minimum(i, j)


@law
@given(maps(), places)
def test_no_way_is_cheaper_than_its_length(costs, last):
    """And none dearer than its length over the dearest ground; at the goal it is zero."""
    found = cost_to_go(costs, last)
    assert found[last] == 0.0
    assert (found >= octile(last) * costs.min() * (1 - 1e-5)).all()
    assert (found <= octile(last) * costs.max() * (1 + 1e-5)).all()


@law
@given(maps(), places, places, st.floats(1.0, 30.0, allow_subnormal=False))
def test_dearer_ground_makes_no_way_cheaper(costs, last, place, factor):
    """One cell more expensive: no cost to go falls."""
    dearer = costs.copy()
    dearer[place] *= np.float32(factor)
    assert (cost_to_go(dearer, last) >= cost_to_go(costs, last) * (1 - 1e-5)).all()


@law
@given(maps(), places)
def test_neighbours_differ_by_a_step_at_most(costs, last):
    """The field is consistent: no cell is dearer than its neighbour and the step there."""
    found = cost_to_go(costs, last)
    for di, dj in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a, b = _shifted(found, di, dj)
        p, q = _shifted(costs, di, dj)
        step = np.hypot(di, dj) * (p + q) / 2
        assert (np.abs(a - b) <= step * (1 + 1e-4)).all()


def _shifted(field, di, dj):
    """Return a field and itself a step apart, where both are."""
    n = CELLS
    rows, others = slice(0, n - di), slice(di, n)
    here = slice(max(-dj, 0), n - max(dj, 0))
    there = slice(max(dj, 0), n - max(-dj, 0))
    return field[rows, here].astype(np.float64), field[others, there].astype(np.float64)


@law
@given(maps(), places, places)
def test_there_costs_as_much_as_back(costs, first, last):
    """A step costs both cells' cost, whichever way it goes."""
    there, back = cost_to_go(costs, last)[first], cost_to_go(costs, first)[last]
    np.testing.assert_allclose(there, back, rtol=1e-4, atol=1e-4)


@law
@given(maps(), places)
def test_a_mirrored_map_has_a_mirrored_cost(costs, last):
    """Left and right, and rows and columns, are alike."""
    found = cost_to_go(costs, last)
    mirrored = cost_to_go(np.ascontiguousarray(costs[:, ::-1]), (last[0], CELLS - 1 - last[1]))
    np.testing.assert_allclose(mirrored[:, ::-1], found, rtol=1e-5)
    turned = cost_to_go(np.ascontiguousarray(costs.T), last[::-1])
    np.testing.assert_allclose(turned.T, found, rtol=1e-5)
