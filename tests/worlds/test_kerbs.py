"""Kerbs: raised strips, their stones, and what the true map makes of them."""

from itertools import pairwise

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.kerbs import Strip, draw_strips, kerbstones, raised
from worlds.trails import Trail
from worlds.traversability_map import Reason
from worlds.truth import TruthConfig, build_truth

GROUND = Heightfield(np.full((121, 121), 1.0, dtype=np.float32), 0.25)
FINE = GROUND.refined(3)
LINE = np.array([[0.0, y] for y in np.arange(-9.0, 9.1, 1.5)])


def at(heights, x, y):
    """Return the value at the node nearest to a place."""
    return heights[round((x + 15.0) / FINE.cell), round((y + 15.0) / FINE.cell)]


def test_strips_have_their_stated_sizes_and_streams_of_their_own():
    """Lengths of 9 to 24 m, widths of 1.6 to 4 m, heights of 6 to 12 cm."""
    strips = draw_strips(GROUND, 20, np.random.default_rng(0))
    lengths = [np.hypot(*np.diff(strip.line, axis=0).T).sum() for strip in strips]
    assert 7.4 < min(lengths) < 12.0 < 20.0 < max(lengths) <= 24.0
    halves, heights = np.array([(strip.half, strip.height) for strip in strips]).T
    assert 0.8 <= halves.min() < 1.0 < 1.8 < halves.max() <= 2.0
    assert 0.06 <= heights.min() < 0.07 < 0.11 < heights.max() <= 0.12
    fewer = draw_strips(GROUND, 2, np.random.default_rng(0))
    np.testing.assert_array_equal(fewer[1].line, strips[1].line)


def test_a_strip_is_level_between_ramps_at_its_ends():
    """Beside it nothing rises; ramps are 1.5 m long."""
    rises = raised(FINE, [Strip(LINE, 1.0, 0.1)], [])
    assert at(rises, 0.0, 0.0) == pytest.approx(0.1)
    assert at(rises, 0.9, 3.0) == pytest.approx(0.1)
    assert at(rises, 1.1, 0.0) == at(rises, -1.1, 3.0) == 0.0
    assert at(rises, 0.0, 9.0 - 0.75) == pytest.approx(0.05, abs=0.004)
    assert at(rises, 0.0, 9.5) == pytest.approx(0.0, abs=1e-9)


def test_a_trail_lowers_the_kerb():
    """Where it crosses the strip is down, a ramp beside it up again."""
    trail = Trail(np.array([[-9.0, 0.0], [9.0, 0.0]]), 1.0)
    strip = Strip(LINE, 1.0, 0.1)
    rises = raised(FINE, [strip], [trail])
    assert at(rises, 0.5, 0.3) == 0.0
    assert at(rises, 0.5, 0.5 + 0.75) == pytest.approx(0.05, abs=0.003)
    assert at(rises, 0.5, 4.0) == pytest.approx(0.1)
    stones = kerbstones(GROUND, [strip], [trail], FINE.cell)
    middles = np.array([stone.vertices[:, 1].mean() for stone in stones])
    assert np.abs(middles).min() > 0.5 + 0.75


def test_stones_are_flush_with_the_strip_and_upright_outside():
    """Both edges have them where they are higher than a wheel climbs, without a gap."""
    stones = kerbstones(GROUND, [Strip(LINE, 1.0, 0.1)], [], FINE.cell)
    assert {stone.semantic for stone in stones} == {SemanticClass.KERB}
    vertices = np.concatenate([stone.vertices for stone in stones]).astype(float)
    assert vertices[:, 2].max() == pytest.approx(1.1)
    outer = np.abs(vertices[:, 0]).max()
    assert outer == pytest.approx(1.0 + FINE.cell, abs=1e-5)
    assert np.abs(vertices[:, 0]).min() == pytest.approx(1.0 - 1.2 * FINE.cell, abs=1e-5)
    for side in (-1, 1):
        row = [stone for stone in stones if stone.vertices[0, 0] * side > 0]
        ends = sorted((s.vertices[:, 1].min(), s.vertices[:, 1].max()) for s in row)
        assert all(a[1] == pytest.approx(b[0]) for a, b in pairwise(ends))
        assert ends[0][0] == pytest.approx(-8.0)
        assert ends[-1][1] == pytest.approx(8.0)
    low = Strip(LINE, 1.0, 0.045)
    assert not kerbstones(GROUND, [low], [], FINE.cell)


@pytest.mark.parametrize("angle", [0.0, 0.4])
@pytest.mark.parametrize(("height", "forbids"), [(0.03, False), (0.06, True), (0.1, True)])
def test_the_true_map_forbids_what_a_wheel_may_not_climb(height, forbids, angle):
    """A kerb of 3 cm is free, one of 6 or 10 cm forbidden all along.

    The rule of the step measures 0.7 to 1.3 times the height, by the direction of the edge: below
    7 cm it takes the stones to be sure.
    """
    c, s = np.cos(angle), np.sin(angle)
    strip = Strip(LINE @ np.array([[c, s], [-s, c]]), 1.0, height)
    heights = (FINE.heights + raised(FINE, [strip], [])).astype(np.float32)
    ground = Heightfield(heights, FINE.cell)
    stones = tuple(kerbstones(GROUND, [strip], [], FINE.cell))
    y = np.linspace(-6.0, 6.0, 60)
    for objects in (stones,) if height == 0.06 else ((), stones):
        truth = build_truth(ground, objects, TruthConfig())
        for side in (-1.0, 1.0):
            # Across the edge, from half a metre inside to half a metre outside.
            x = side * (1.0 + np.linspace(-0.5, 0.5, 21))
            across = truth.reason_at(c * x[:, None] - s * y, s * x[:, None] + c * y)
            assert ((across != Reason.FREE).any(axis=0)).mean() == forbids
        middle = truth.reason_at(-s * y, c * y)
        assert (middle == Reason.FREE).all()


def test_a_kerb_of_ten_centimetres_is_solid_and_one_of_six_low():
    """A body of 9 cm clearance passes over the one and not over the other."""
    for height, kind in ((0.06, Reason.LOW), (0.1, Reason.SOLID)):
        strip = Strip(LINE, 1.0, height)
        ground = Heightfield(
            (FINE.heights + raised(FINE, [strip], [])).astype(np.float32), FINE.cell
        )
        stones = tuple(kerbstones(GROUND, [strip], [], FINE.cell))
        truth = build_truth(ground, stones, TruthConfig())
        assert truth.reason_at(1.0, 0.0) == kind
