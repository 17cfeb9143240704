"""Ledges: the height of a step along a line, whatever the slope, and not of a bump beside it."""

import numpy as np
import pytest

from traversability.cartesian.ledges import LEDGE_FEATURES, describe_ledge

CELL, SIZE = 0.1, 24
MIDDLE = SIZE // 2


def described(height):
    """Return the features of the ground cell in the middle of heights z(x, y) [m]."""
    x = (np.arange(SIZE) + 0.5 - MIDDLE) * CELL
    row = np.empty(len(LEDGE_FEATURES), dtype=np.float32)
    # The middle is the corner between its own four cells.
    describe_ledge(height(x[:, None], x[None, :]) + 0.0 * x[:, None], MIDDLE - 1, MIDDLE - 1, row)
    return dict(zip(LEDGE_FEATURES, row.tolist(), strict=True))


def step(angle, height=0.08):
    """Return ground that rises by a step across a line in a direction [rad]."""
    return lambda x, y: height * (x * np.cos(angle) + y * np.sin(angle) > 0)


@pytest.mark.parametrize("angle", np.arange(8) * np.pi / 4)
def test_a_step_has_its_height_in_every_direction(angle):
    """Up or down, and on a slope of 20 degrees in any direction too."""
    found = described(step(angle))
    assert found["ledge"] == pytest.approx(0.08, abs=1e-6)
    assert found["ledge_both"] == pytest.approx(0.08, abs=1e-6)
    rise = np.tan(np.deg2rad(20.0))
    leaning = described(lambda x, y: step(angle)(x, y) + rise * (0.8 * x - 0.6 * y))
    assert leaning["ledge_both"] == pytest.approx(0.08, abs=0.005)


def test_a_slope_has_no_step():
    """A plane is no ledge, however steep."""
    found = described(lambda x, y: 0.5 * x + 0.3 * y)
    assert max(found.values()) == pytest.approx(0.0, abs=1e-6)


def test_a_clod_is_a_lower_step_than_a_kerb():
    """What rises by as much on a part of one side counts for less than half."""
    found = described(lambda x, y: 0.08 * ((x > 0.1) & (x < 0.4) & (y > 0.0) & (y < 0.3)))
    assert 0.0 < found["ledge_both"] < 0.04


def test_the_lower_side_may_be_half_hidden():
    """Where the near strip of the lower ground has no points, the step is found all the same."""
    found = described(lambda x, y: np.where((x < 0) & (x > -0.25), np.nan, step(0.0)(x, y)))
    assert found["ledge_both"] == pytest.approx(0.08, abs=1e-6)


def test_too_few_cells_are_unknown():
    """Without ground on one side nothing is known."""
    found = described(lambda x, y: np.where(np.hypot(x, y) < 0.2, 0.0, np.nan))
    assert set(found.values()) == {-1.0}
