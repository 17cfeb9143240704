"""Generators of terrain: known shapes, stated relief and slope."""

import numpy as np
import pytest

from terrain.generators import (
    _is_gentle,
    bank,
    distance_to_line,
    ditch,
    hills,
    smooth_noise,
    terrace,
    winding_line,
)


def test_noise_has_mean_zero_and_deviation_one():
    """Noise is normalised, and the same seed gives the same bytes."""
    field = smooth_noise((200, 150), 0.25, 10.0, np.random.default_rng(0))
    assert field.shape == (200, 150)
    assert field.mean() == pytest.approx(0.0, abs=1e-12)
    assert field.std() == pytest.approx(1.0)
    again = smooth_noise((200, 150), 0.25, 10.0, np.random.default_rng(0))
    np.testing.assert_array_equal(field, again)


def test_longer_waves_are_smoother():
    """The slope of noise is inversely proportional to its wavelength."""
    slopes = [
        np.abs(np.diff(smooth_noise((400, 400), 0.25, length, np.random.default_rng(1)), axis=0))
        for length in (8.0, 16.0)
    ]
    assert slopes[0].mean() / slopes[1].mean() == pytest.approx(2.0, rel=0.15)


def test_hills_have_the_stated_relief_and_slope():
    """Highest minus lowest point is the relief; 0.1 % of the ground exceeds the slope."""
    heights = hills((401, 401), 0.25, 10.0, np.deg2rad(25.0), np.random.default_rng(2))
    assert np.ptp(heights) == pytest.approx(10.0)
    assert heights.min() == pytest.approx(0.0)
    rise = np.hypot(*np.gradient(heights[::2, ::2], 0.5))
    assert np.rad2deg(np.arctan(np.quantile(rise, 0.999))) == pytest.approx(25.0, abs=2.0)


LINES = np.linspace(-5.0, 5.0, 41)


@pytest.mark.parametrize("shape", [(12, 34), (33, 64)])
def test_slopes_are_compared_with_their_quantile(shape):
    """Just below and above it, and far away, on grounds where it is a slope and where it is not."""
    heights = np.random.default_rng(1).standard_normal(shape)
    steep = np.quantile(np.hypot(*np.gradient(heights, 0.5)), 0.999)
    for factor in (0.1, 0.9, 1 - 1e-12, 1.0, 1 + 1e-12, 1.1):
        assert _is_gentle(heights, 0.5, factor * steep) == (factor > 1)


def test_the_distance_to_a_line_is_that_of_its_nearest_point():
    """Beside a segment it is the perpendicular, beyond its ends the distance to the end."""
    line = np.array([[-2.0, 1.0], [2.0, 1.0]])
    found = distance_to_line(LINES, LINES, line)
    x, y = np.meshgrid(LINES, LINES, indexing="ij")
    expected = np.hypot(np.maximum(np.abs(x) - 2.0, 0.0), y - 1.0)
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_distances_beyond_the_reach_are_infinite_and_the_others_unchanged():
    """A reach saves work and changes no distance below it."""
    line = np.array([[-2.0, 1.0], [0.0, -1.0], [2.0, 1.5]])
    near, all_ = (distance_to_line(LINES, LINES, line, reach) for reach in (1.5, np.inf))
    np.testing.assert_array_equal(near[all_ < 1.5], all_[all_ < 1.5])
    assert np.isinf(near[0, 0])


def test_a_point_is_a_line_of_no_length():
    """A polyline of one repeated corner gives the distance to the corner."""
    found = distance_to_line(LINES, LINES, np.array([[1.0, 2.0], [1.0, 2.0]]))
    assert found[0, 0] == pytest.approx(np.hypot(6.0, 7.0))


@pytest.mark.parametrize(
    ("shape", "at", "heights"),
    [
        (lambda d: ditch(d, 2.0, 0.4), [0.0, 0.5, 0.75, 1.0, 3.0], [-0.4, -0.4, -0.2, 0.0, 0.0]),
        (lambda d: terrace(d, 3.0, 0.5, 1.0), [0.0, 2.0, 2.5, 3.0, 9.0], [0.5, 0.5, 0.25, 0, 0]),
        (lambda d: terrace(d, 3.0, -0.5, 1.0), [0.0, 2.5, 3.0], [-0.5, -0.25, 0.0]),
        (lambda d: bank(d, 2.0, 1.5, np.deg2rad(45)), [0.0, 2.0, 3.0, 9.0], [0.0, 0.0, 1.0, 1.5]),
    ],
    ids=["ditch", "plateau", "basin", "bank"],
)
def test_shapes_have_known_heights(shape, at, heights):
    """Each profile is as documented, at its floor, its edges and far away."""
    np.testing.assert_allclose(shape(np.array(at)), heights, atol=1e-12)


def test_a_line_without_turns_is_straight():
    """Corners are 1.5 m apart along the heading; turns change directions, not distances."""
    rng = np.random.default_rng(3)
    straight = winding_line(np.array([1.0, 2.0]), np.pi / 2, 15.0, 0.0, rng)
    np.testing.assert_allclose(straight, [[1.0, 2.0 + 1.5 * k] for k in range(11)], atol=1e-9)
    winding = winding_line(np.array([1.0, 2.0]), np.pi / 2, 15.0, 0.5, rng)
    np.testing.assert_allclose(np.hypot(*np.diff(winding, axis=0).T), 1.5)
    assert np.ptp(winding[:, 0]) > 0.5
