"""Solids near agents, and the way round them."""

import numpy as np
import pytest

from tests.support.walking_worlds import agent, walker
from worlds.agent_surroundings import free_for, gather, going_round, overlapping, sight
from worlds.agents import Agents
from worlds.rooms.mover_motion import Movers, Solids

MADE = [agent("person", (0.0, 0.0)), walker((9.0, 9.0)), agent("person", (5.0, 0.0))]


def state_of(movers):
    """Return the state of movers that are all there."""
    state = Movers.none(1, len(movers))
    for m, mover in enumerate(movers):
        state.places[0, m], state.radii[0, m] = mover.place, mover.plan.radius
    return state


def solids(circles=(), edges=()):
    """Return solids without boxes."""
    made = (np.array(each, dtype=np.float64) for each in (circles, edges))
    circles, edges = made
    return Solids(np.zeros((0, 4)), circles.reshape(-1, 3), edges.reshape(-1, 4))


def test_circles_that_overlap_are_found():
    """They touch at the sum of the radii."""
    places, reaches = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([1.0, 2.0])
    circles = np.array([[1.4, 0.0, 0.5], [1.6, 0.0, 0.5], [7.6, 0.0, 0.5], [0.0, 1.4, 0.5]])
    assert overlapping(places, reaches, circles).tolist() == [True, False, True, True]


def test_people_look_ahead_for_a_second_and_a_half():
    """And a hand's breadth more."""
    np.testing.assert_allclose(sight(np.array([0.0, 2.0])), [0.1, 3.1])


def test_what_is_near_each_agent_is_gathered():
    """Up to 0.25 + 0.1 + 1.25 x 1.5 m; those without a behaviour have none."""
    reach = 0.35 + 1.875
    world = solids(
        [(reach - 0.1 + 0.3, 0.0, 0.3), (0.0, reach + 0.4, 0.3), (5.0, 1.0, 0.3), (9.0, 9.0, 0.1)],
        [(-9.0, -2.0, 9.0, -2.0), (-9.0, 2.3, 9.0, 2.3)],
    )
    found = gather(state_of(MADE), Agents.of(MADE), world)
    assert found.circle_starts.tolist() == [0, 1, 1, 2]
    assert found.circles.tolist() == [0, 2]
    assert found.edge_starts.tolist() == [0, 1, 1, 2]
    assert found.edges.tolist() == [0, 0]


@pytest.mark.parametrize(
    ("place", "expected"),
    [((1.4, 0.0), True), ((1.6, 0.0), False), ((0.0, 0.9), False), ((0.0, 0.7), True)],
)
def test_a_place_is_free_where_nothing_is_overlapped(place, expected):
    """A circle of 0.25 m at 2.05 m, an edge at 1.1 m; the vector points away from them."""
    world = solids([(2.05, 0.0, 0.3)], [(-5.0, 1.1, 5.0, 1.1)])
    state, agents = state_of(MADE), Agents.of(MADE)
    free, nx, ny = free_for(0, *place, state, world, gather(state, agents, world))
    assert free == expected
    if not free:
        assert (nx < 0.0, ny) == (True, 0.0) if place[0] else (nx, ny < 0.0) == (0.0, True)


def test_another_mover_is_in_the_way():
    """Half a metre is enough for two of 0.25 m."""
    made = [agent("person", (0.0, 0.0)), walker((1.0, 0.0))]
    state, agents, world = state_of(made), Agents.of(made), solids()
    nearby = gather(state, agents, world)
    assert free_for(0, 0.49, 0.0, state, world, nearby)[0]
    assert free_for(0, 0.51, 0.0, state, world, nearby) == (False, pytest.approx(-0.49), 0.0)


@pytest.mark.parametrize(("aside", "way"), [(0.3, -1.0), (-0.3, 1.0)])
def test_a_trunk_is_passed_on_the_near_side(aside, way):
    """The velocity turns by whole steps of 20 degrees and keeps its length; the side is kept."""
    state, agents = state_of(MADE), Agents.of(MADE)
    world = solids([(1.0, aside, 0.4)])
    vx, vy = going_round(0, 1.0, 0.0, state, agents, world, gather(state, agents, world))
    assert np.hypot(vx, vy) == pytest.approx(1.0)
    turn = np.rad2deg(np.arctan2(vy, vx)) * way
    assert turn == pytest.approx(20 * round(turn / 20), abs=1e-9)
    assert 20 < turn < 90
    assert agents.sides[0] == way


def test_a_clear_way_is_left_as_it_is():
    """And the side is forgotten."""
    state, agents, world = state_of(MADE), Agents.of(MADE), solids([(-1.0, 0.0, 0.4)])
    agents.sides[0] = 1.0
    nearby = gather(state, agents, world)
    np.testing.assert_allclose(going_round(0, 1.0, 0.2, state, agents, world, nearby), (1.0, 0.2))
    assert agents.sides[0] == 0.0


def test_the_side_once_chosen_is_kept():
    """Half way along a wall the nearer end is behind."""
    wall = [(0.6, -3.0, 0.6, 1.0)]
    state, agents, world = state_of(MADE), Agents.of(MADE), solids(edges=wall)
    nearby = gather(state, agents, world)
    for side in (1.0, -1.0):
        agents.sides[0] = side
        _, vy = going_round(0, 1.0, 0.0, state, agents, world, nearby)
        assert np.sign(vy) == side


def test_nowhere_to_go_ends_the_aim():
    """Between walls all around the aim's time is over."""
    walls = [(-0.4, -9, -0.4, 9), (0.4, -9, 0.4, 9), (-9, -0.4, 9, -0.4), (-9, 0.4, 9, 0.4)]
    state, agents, world = state_of(MADE), Agents.of(MADE), solids(edges=walls)
    agents.until[0] = 7.0
    going_round(0, 1.0, 0.0, state, agents, world, gather(state, agents, world))
    assert agents.until[0] == 0.0
