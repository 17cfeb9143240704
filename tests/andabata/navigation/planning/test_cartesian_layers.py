"""Cartesian layers: each place of the clouds is taken in once, by both layers of the ground."""

import numpy as np
import pytest

from andabata.models import shipped_ground_classifier
from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayerConfig
from tests.support.situations import ORIGIN, StubAssembler, constant_classifier, layers_of
from traversability.cloud import PointCloud

CELL = 0.1


def cloud(stamp, rock=True, side=None):
    """Return level ground of known cells with a rock of 5 cm at (2.05, 0.05), or one side of it."""
    i, j = np.mgrid[-30:45, -30:31].reshape(2, -1)
    heights = np.where((i == 20) & (j == 0) & rock, 0.05, 0.0)
    points = np.repeat(np.stack([(i + 0.5) * CELL, (j + 0.5) * CELL, heights], axis=1), 6, axis=0)
    if side is not None:
        points = points[side * points[:, 1] > 0]
    return PointCloud(points.astype(np.float32), "odom", np.full(len(points), float(stamp)))


def show(assembler, *clouds, settled=None):
    """Make some clouds the window, settled up to a stamp."""
    last = float(clouds[-1].stamps.max())
    assembler.show_parts(clouds, last if settled is None else settled)


@pytest.fixture
def assembler():
    return StubAssembler()


def test_both_layers_take_in_what_was_measured(assembler):
    """A rock stands out of the low obstacles; ground cells get the classifier's log odds."""
    config = GroundLayerConfig(miss_cost=1.0, max_log_odds=50.0)
    layers = layers_of(assembler, constant_classifier(-0.5), config)
    show(assembler, cloud(1.0))
    layers.update(ORIGIN)
    assert layers.low_obstacles.heights[20, 0] == pytest.approx(0.05, abs=1e-5)
    assert layers.ground.log_odds[10, 5] == pytest.approx(-0.5)


def test_a_cloud_counts_once(assembler):
    """Without anything newly settled an update changes nothing; with it, once more."""
    config = GroundLayerConfig(miss_cost=1.0, max_log_odds=50.0)
    layers = layers_of(assembler, constant_classifier(-0.5), config)
    show(assembler, cloud(1.0))
    for _ in range(5):
        layers.update(ORIGIN)
    assert layers.ground.log_odds[10, 5] == pytest.approx(-0.5)
    show(assembler, cloud(2.0))
    layers.update(ORIGIN)
    assert layers.ground.log_odds[10, 5] == pytest.approx(-0.75)


def test_what_has_not_settled_waits(assembler):
    """Places count when they have settled, and then once, though they were in the window before."""
    config = GroundLayerConfig(miss_cost=1.0, max_log_odds=50.0)
    layers = layers_of(assembler, constant_classifier(-0.5), config)
    first, second = cloud(1.0, side=-1), cloud(2.0, side=1)
    show(assembler, first, second, settled=1.0)
    layers.update(ORIGIN)
    # The cell at the border is that of the newest points, which have not settled.
    assert layers.ground.log_odds[10, -5] == pytest.approx(-0.5)
    assert layers.ground.log_odds[10, 5] == 0.0
    show(assembler, first, second, cloud(3.0, side=1), settled=2.0)
    layers.update(ORIGIN)
    assert layers.ground.log_odds[10, -5] == pytest.approx(-0.5)


def test_layers_are_measured_after_the_first_window_until_a_reset(assembler):
    """An empty window is no measurement; a reset forgets everything, and the same cloud counts."""
    layers = layers_of(assembler, constant_classifier(-0.5))
    layers.update(ORIGIN)
    assert not layers.is_measured
    show(assembler, cloud(1.0))
    layers.update(ORIGIN)
    assert layers.is_measured
    layers.reset()
    assert not layers.is_measured
    assert not layers.low_obstacles.heights.any()
    assert not layers.ground.log_odds.any()
    layers.update(ORIGIN)
    assert layers.low_obstacles.heights[20, 0] > 0


def test_without_a_classifier_there_is_no_ground_layer(assembler):
    """Low obstacles are found all the same."""
    layers = layers_of(assembler)
    show(assembler, cloud(1.0))
    layers.update(ORIGIN)
    assert layers.ground is None
    assert layers.low_obstacles.heights[20, 0] > 0
    layers.reset()


def test_low_obstacles_have_half_the_cell(assembler):
    """Cells of 0.4 m have low obstacles of 0.2 m: the same place has half the index."""
    layers = CartesianLayers(
        assembler, 256, 0.4, GroundLayerConfig(), LowObstacleLayerConfig(), None
    )
    i, j = np.mgrid[-15:20, -15:16].reshape(2, -1)
    heights = np.where((i == 10) & (j == 0), 0.05, 0.0)
    points = np.repeat(np.stack([0.2 * i + 0.1, 0.2 * j + 0.1, heights], axis=1), 6, axis=0)
    show(assembler, PointCloud(points.astype(np.float32), "odom", np.zeros(len(points))))
    layers.update(ORIGIN)
    np.testing.assert_array_equal(np.argwhere(layers.low_obstacles.heights), [[10, 0]])


def test_layers_follow_the_robot(assembler):
    """Both layers lie around the position of the update."""
    layers = layers_of(assembler, constant_classifier(-0.5))
    show(assembler, cloud(1.0))
    layers.update(np.array([1.0, -2.0]))
    np.testing.assert_array_equal(layers.low_obstacles.centre, [10, -20])
    np.testing.assert_array_equal(layers.ground.centre, [5, -10])


def test_ground_cells_of_another_size_are_refused(assembler):
    """The classifier knows cells of one size, which the occupancy grid has to have."""
    with pytest.raises(
        ValueError, match=r"local_planner.occupancy.cell: expected 0.2 m.* got 0.25 m"
    ):
        CartesianLayers(
            assembler,
            256,
            0.25,
            GroundLayerConfig(),
            LowObstacleLayerConfig(),
            shipped_ground_classifier(),
        )
