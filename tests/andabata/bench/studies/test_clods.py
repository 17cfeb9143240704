"""Low rocks among clods: plots of known heights, and what the layer makes of them."""

import numpy as np
import pytest

from andabata.bench.studies import clods
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayerConfig

CONFIG = LowObstacleLayerConfig()


def test_a_cloud_shows_clods_and_rocks():
    """Over even ground points are as high as the ellipsoid of their rock, but for noise."""
    rng = np.random.default_rng(0)
    plot = clods.Plot(np.zeros((163, 163)), np.array([[1.5, -0.5, 0.1, 0.12, 0.08]]))
    points = clods.draw_cloud(plot, rng).astype(np.float64)
    inside = 1 - ((points[:, 0] - 1.5) / 0.12) ** 2 - ((points[:, 1] + 0.5) / 0.08) ** 2
    error = points[:, 2] - 0.1 * np.sqrt(np.maximum(inside, 0))
    assert error.std() == pytest.approx(0.012, rel=0.05)
    assert np.abs(error[inside > 0].mean()) < 0.006


def test_a_cloud_has_the_clods_where_they_are():
    """A slope along x rises along x."""
    plot = clods.Plot(np.repeat(np.arange(163.0)[:, None], 163, 1) * 0.05, np.zeros((0, 5)))
    points = clods.draw_cloud(plot, np.random.default_rng(0)).astype(np.float64)
    np.testing.assert_allclose(points[:, 2], points[:, 0] + 4.05, atol=0.07)


def test_rocks_lie_apart_within_the_layers_reach():
    """None lies in the surroundings of another, nor out of sight."""
    rocks = clods.draw_plot(0.02, np.random.default_rng(1)).rocks
    apart = np.hypot(*(rocks[:, None, :2] - rocks[None, :, :2]).transpose(2, 0, 1))
    assert apart[~np.eye(len(rocks), dtype=bool)].min() > 0.9
    far = np.hypot(*rocks[:, :2].T)
    assert far.min() > CONFIG.min_range
    assert far.max() < CONFIG.max_range


def test_high_rocks_are_found_on_even_ground_and_no_clods_are():
    """On even ground a rock of 12 cm is found; with a factor beyond reach nothing is."""
    found = clods.tally(CONFIG, 0.0, np.random.default_rng(2))
    assert found.is_found[found.heights == 0.12].all()
    assert found.false_share < 1e-4
    none = clods.tally(CONFIG.model_copy(update={"min_height": 1.0}), 0.0, np.random.default_rng(2))
    assert not none.is_found.any()


def test_clods_alone_are_false_alarms():
    """What lies beside no rock counts as false: without a threshold half of all cells."""
    loose = CONFIG.model_copy(update={"min_height": 1e-6, "roughness_factor": 0.0})
    found = clods.tally(loose, 0.02, np.random.default_rng(3))
    assert 0.3 < found.false_share < 0.5


def test_the_table_has_a_row_a_relief(capsys):
    """Heights stand beside the reliefs; settings of the layer are taken."""
    clods.main(["--plots", "1", "--set", "min_height=1.0"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + len(clods.RELIEFS)
    assert "0.12 m" in lines[0]
    assert all(" 0 of " in line for line in lines[2:])
