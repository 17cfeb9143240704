"""Spaces: the order, bounds and scale of observations, and actions in SI units."""

import numpy as np
import pytest
from pydantic import ValidationError

from rl.spaces import (
    MIDDLE_RANGE,
    ActionSpec,
    ObservationSpec,
    ObservationTerm,
    points_of,
    steering_actions,
    steering_observations,
    steering_points,
)

SPEC = steering_observations(32, 10.0, 0.5)


def observation(ranges, previous, error):
    parts = {"ranges": ranges, "previous_actions": previous, "heading_error": [error]}
    return SPEC.vector(parts)


def test_the_papers_order():
    """32 ranges, the last two actions, the heading error; float32."""
    state = observation(np.arange(32.0) / 4, (0.3, -0.2), 1.5)
    assert state.dtype == np.float32
    np.testing.assert_allclose(state[:32], np.arange(32) / 4)
    np.testing.assert_allclose(state[32:], [0.3, -0.2, 1.5])
    assert SPEC.size == 35


def test_bounds_hold_every_state():
    """Bounds are float32 and hold the extreme values, pi included."""
    low, high = SPEC.bounds()
    assert low.dtype == high.dtype == np.float32
    assert len(low) == SPEC.size == 35
    for sign in (-1, 1):
        state = observation(np.full(32, 10.0), (0.5 * sign, -0.5 * sign), np.pi * sign)
        assert ((low <= state) & (state <= high)).all()
    np.testing.assert_array_equal(low[:34], [0.0] * 32 + [-0.5] * 2)
    np.testing.assert_array_equal(high[:34], [10.0] * 32 + [0.5] * 2)
    assert float(high[34]) >= np.pi
    assert float(low[34]) <= -np.pi


def scaled(state):
    a, b, c, d = SPEC.scale()
    return (a + b * state) / (c + d * state)


def test_scaled_states_lie_between_minus_one_and_one():
    """The bounds of the linear parts become -1 and 1; ranges stay within."""
    for state in SPEC.bounds():
        x = scaled(state)
        assert (np.abs(x) <= 1.0 + 1e-6).all()
        np.testing.assert_allclose(np.abs(x[32:]), 1.0, rtol=1e-6)


def test_near_ranges_are_resolved_better_than_far_ones():
    """A range is 1 at contact and 0 at the middle range; a step near counts ten times."""
    ranges = np.array([0.0, MIDDLE_RANGE, 0.5, 1.0, 9.0, 9.5])
    x = scaled(observation(np.resize(ranges, 32), (0.0, 0.0), 0.0))
    assert x[0] == 1.0
    assert x[1] == 0.0
    assert x[2] - x[3] > 10 * (x[4] - x[5]) > 0


def points(k=3):
    return ObservationSpec(
        terms=(
            ObservationTerm(name="goal", shape=(2,), low=-9.0, high=9.0, unit="m"),
            ObservationTerm(name="points", shape=(k, 2), low=-4.0, high=4.0, unit="m"),
            ObservationTerm(name="mask", shape=(k,), low=0.0, high=1.0, unit=""),
        )
    )


def test_a_set_of_points_and_its_mask():
    """A term of shape (k, 2) stands row by row in the vector, its mask of k beside it."""
    spec = points()
    assert spec.size == 2 + 6 + 3
    assert spec.slice_of("goal") == slice(0, 2)
    assert spec.slice_of("points") == slice(2, 8)
    assert spec.slice_of("mask") == slice(8, 11)
    places = np.array([[1.0, 2.0], [3.0, -4.0], [0.0, 0.0]])
    vector = spec.vector({"goal": [7.0, 8.0], "points": places, "mask": [1, 1, 0]})
    np.testing.assert_array_equal(vector, [7, 8, 1, 2, 3, -4, 0, 0, 1, 1, 0])
    term = spec.term("points")
    np.testing.assert_array_equal(vector[spec.slice_of("points")].reshape(term.shape), places)
    np.testing.assert_array_equal(spec.bounds()[1][2:8], 4.0)
    np.testing.assert_array_equal(spec.scale()[:, 2], np.float32([0.0, 0.25, 1.0, 0.0]))


def test_many_observations_at_once():
    """Leading axes of all parts become those of the vectors."""
    spec, rng = points(2), np.random.default_rng(0)
    parts = {
        "goal": rng.normal(size=(5, 4, 2)),
        "points": rng.normal(size=(5, 4, 2, 2)),
        "mask": rng.normal(size=(5, 4, 2)),
    }
    vectors = spec.vector(parts)
    assert vectors.shape == (5, 4, 8)
    one = spec.vector({name: part[3, 1] for name, part in parts.items()})
    np.testing.assert_array_equal(vectors[3, 1], one)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"goal": None}, "expected parts"),
        ({"extra": [1.0]}, "expected parts"),
        ({"points": np.zeros((2, 3))}, r"points: expected shape \(..., 3, 2\), got \(2, 3\)"),
        ({"mask": np.zeros(4)}, "mask: expected shape"),
    ],
)
def test_parts_that_do_not_fit_are_named(change, message):
    """A missing, unknown or misshapen part is refused by its name."""
    parts = {"goal": [0.0, 0.0], "points": np.zeros((3, 2)), "mask": np.ones(3)} | change
    with pytest.raises(ValueError, match=message):
        points().vector({name: part for name, part in parts.items() if part is not None})


def test_names_of_terms_are_unique():
    """A spec with two terms of one name, or none at all, is refused."""
    term = SPEC.term("ranges")
    with pytest.raises(ValidationError, match="expected names of their own"):
        ObservationSpec(terms=(term, term))
    with pytest.raises(ValidationError):
        ObservationSpec(terms=())


def test_an_unknown_term_is_named():
    """Asking for a term that is not there names those that are."""
    for ask in (SPEC.term, SPEC.slice_of):
        with pytest.raises(KeyError, match=r"ranges.*got 'speed'"):
            ask("speed")


def test_shares_become_si_units():
    """-1 is the lower bound, 1 the upper, 0 the middle, each action by its own."""
    spec = ActionSpec(
        names=("linear", "angular"), low=(0.1, -0.5), high=(0.5, 0.5), units=("m/s", "rad/s")
    )
    assert spec.size == 2
    shares = np.array([[-1.0, -1.0], [1.0, 1.0], [0.0, 0.0], [0.5, -0.5]])
    expected = [[0.1, -0.5], [0.5, 0.5], [0.3, 0.0], [0.4, -0.25]]
    np.testing.assert_allclose(spec.scaled(shares), expected)
    np.testing.assert_allclose(spec.scaled(shares[3]), expected[3])


def test_the_papers_action():
    """One yaw rate within its limit."""
    spec = steering_actions(0.5)
    assert (spec.names, spec.low, spec.high, spec.units) == (
        ("angular",),
        (-0.5,),
        (0.5,),
        ("rad/s",),
    )


@pytest.mark.parametrize(
    ("low", "high", "message"),
    [((0.0,), (1.0, 2.0), "as many bounds"), ((0.0, 2.0), (1.0, 2.0), "expected low < high")],
)
def test_impossible_actions_are_refused(low, high, message):
    """Bounds have to be as many as names, the lower below the upper."""
    with pytest.raises(ValidationError, match=message):
        ActionSpec(names=("linear", "angular"), low=low, high=high, units=("m/s", "rad/s"))


def test_a_term_without_scaling_is_taken_as_it_is():
    """Reciprocals are bounded at contact, far from what is usual: they go in as they are."""
    term = ObservationTerm(
        name="points", shape=(2,), low=-50.0, high=50.0, unit="1/m", scaling="none"
    )
    a, b, c, d = ObservationSpec(terms=(term,)).scale()
    values = np.float32([0.2, -3.0])
    np.testing.assert_array_equal((a + b * values) / (c + d * values), values)


def test_points_of_ranges_point_where_their_sectors_do():
    """A sector's point is (sin a / d, cos a / d); one that saw nothing is masked and at the origin.

    Sector 0 of four is centred on -135 degrees, and they go on counter-clockwise.
    """
    points, mask = points_of(np.float32([[2.0, 4.0, np.nan, 0.0]]))
    half = np.sqrt(0.5)
    expected = [[-half / 2, -half / 2], [-half / 4, half / 4], [0.0, 0.0], [50 * half, -50 * half]]
    np.testing.assert_allclose(points[0], expected, rtol=1e-6)
    np.testing.assert_array_equal(mask, [[1.0, 1.0, 0.0, 1.0]])


def test_the_state_with_points_ends_like_the_papers():
    """Points and their mask come first; what follows is the paper's state."""
    spec = steering_points(64, 10.0, 0.5)
    assert [term.name for term in spec.terms[:2]] == ["points", "mask"]
    assert spec.terms[2:] == steering_observations(64, 10.0, 0.5).terms
    assert spec.size == 64 * 3 + 64 + 3


def test_some_parts_keep_their_order():
    """Parts are picked in the order of the layout, with their columns in the whole vector."""
    names = ("heading_error", "ranges")
    few = SPEC.only(names)
    assert [term.name for term in few.terms] == ["ranges", "heading_error"]
    assert few.size == 33
    np.testing.assert_array_equal(SPEC.columns(names), [*range(32), 34])
    state = observation(np.arange(32.0) / 4, (0.3, -0.2), 1.5)
    np.testing.assert_array_equal(
        state[SPEC.columns(names)],
        few.vector({"ranges": np.arange(32.0) / 4, "heading_error": [1.5]}),
    )
    with pytest.raises(KeyError, match="'goal'"):
        SPEC.only(("ranges", "goal"))
