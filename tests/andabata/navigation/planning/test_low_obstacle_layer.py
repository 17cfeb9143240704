"""Low obstacle layer: rocks stand out of the points of clouds, and nothing else does."""

import numpy as np
import pytest

from andabata.navigation.planning.low_obstacle_layer import (
    LowObstacleLayer,
    LowObstacleLayerConfig,
    _median,
)
from tests.support.situations import ORIGIN
from traversability.cartesian.elevation_grid import ElevationGrid

CELL = 0.1
ROCK = np.array([1.83, 0.41])


def ground(rng, slope=0.0, noise=0.005, spacing=0.04, half=4.0):
    """Return points of even ground around the origin, float32, shape (n, 3)."""
    n = round((2 * half / spacing) ** 2)
    x, y = rng.uniform(-half, half, (2, n))
    return np.stack([x, y, np.tan(slope) * x + rng.normal(0, noise, n)], axis=1).astype(np.float32)


def with_rock(points, place=ROCK, width=0.15, height=0.07):
    """Return the points with those over a square block raised by its height."""
    on = (np.abs(points[:, :2] - place) < width / 2).all(axis=1)
    return points + np.outer(on, [0, 0, height]).astype(np.float32)


def layer_of(**settings):
    """Return an empty layer."""
    return LowObstacleLayer(CELL, LowObstacleLayerConfig(**settings))


def update(layer, points, position=ORIGIN):
    """Give a cloud to a layer."""
    elevation = ElevationGrid(CELL)
    elevation.describe(points, position)
    layer.update(elevation, position)


def found(layer):
    """Return the middles of the cells that stand out [m], shape (k, 2)."""
    n = len(layer.heights)
    places = np.argwhere(layer.heights)
    wrapped = (places - layer.centre + n // 2) % n - n // 2
    return (wrapped + layer.centre + 0.5) * CELL


def grid_points(heights, count=6):
    """Return some points in the middle of each cell from (0, 0), by their heights [m]."""
    rows = []
    for i in range(-8, 45):
        for j in range(-20, 21):
            rows += [[(i + 0.5) * CELL, (j + 0.5) * CELL, heights.get((i, j), 0.0)]] * count
    return np.array(rows, dtype=np.float32)


@pytest.mark.parametrize("values", [[3.0], [4.0, 1.0], [5.0, 1.0, 2.0], [8.0, 1.0, 4.0, 2.0]])
def test_the_median_of_a_few_values_is_numpys(values):
    """Of an even number it is the mean of the two in the middle."""
    assert _median(np.array(values)) == np.median(values)


@pytest.mark.parametrize("slope", [0.0, 8.0, 15.0])
def test_even_ground_has_none(slope):
    """Noise of a centimetre on slopes makes no obstacle."""
    layer, rng = layer_of(), np.random.default_rng(0)
    for _ in range(5):
        update(layer, ground(rng, np.deg2rad(slope), noise=0.01))
        assert not layer.heights.any()


@pytest.mark.parametrize("slope", [0.0, 12.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (-300.0, 57.3)])
def test_a_rock_of_seven_centimetres_is_one_wherever_odom_begins(slope, shift):
    """Its cells, and no others, stand out by some centimetres."""
    layer, rng = layer_of(), np.random.default_rng(1)
    for _ in range(3):
        cloud = with_rock(ground(rng, np.deg2rad(slope))).astype(np.float64)
        cloud[:, :2] += shift
        update(layer, cloud.astype(np.float32), np.array(shift))
    places = found(layer) - shift
    assert len(places) >= 2
    assert (np.abs(places - ROCK) < 0.15).all()
    assert 0.02 < layer.heights.max() < 0.075


def test_a_stone_of_fifteen_millimetres_is_none():
    """What is lower than the least height does not stand out."""
    layer, rng = layer_of(), np.random.default_rng(2)
    for _ in range(3):
        update(layer, with_rock(ground(rng), height=0.015))
    assert not layer.heights.any()


def test_few_points_of_many_clouds_add_up():
    """A rock of too few points in one cloud is found in some."""
    layer, rng = layer_of(), np.random.default_rng(3)
    after = []
    for _ in range(8):
        update(layer, with_rock(ground(rng, spacing=0.07)))
        after.append(len(found(layer)))
    assert after[0] == 0
    assert after[-1] >= 1


def test_an_obstacle_that_one_cloud_does_not_show_fades():
    """Drift smears rocks over their neighbours: what is not seen again is forgotten in the end."""
    layer, rng, left = layer_of(max_points=20.0), np.random.default_rng(8), []
    update(layer, with_rock(ground(rng)))
    first = layer.heights.max()
    assert first > layer.config.min_height
    for _ in range(8):
        update(layer, ground(rng))
        left.append(layer.heights.max())
    assert 0.6 * first < left[0] < first
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0.0


def test_rough_ground_is_no_rock():
    """In grass of its height a rock cannot be distinguished from the ground."""
    layer, rng = layer_of(), np.random.default_rng(4)
    for _ in range(5):
        update(layer, ground(rng, noise=0.08))
    assert len(found(layer)) < 0.01 * 80**2


def test_a_crown_is_no_obstacle_and_the_ground_under_it_is_seen():
    """Branches above the robot change nothing about the rock below."""
    layer, rng = layer_of(), np.random.default_rng(5)
    for _ in range(3):
        cloud = with_rock(ground(rng))
        crown = ground(rng)[::4] + np.float32([0, 0, 1.5])
        update(layer, np.concatenate([cloud, crown]))
    places = found(layer)
    assert len(places) >= 2
    assert (np.abs(places - ROCK) < 0.15).all()


def test_the_layer_forgets_what_the_robot_leaves_behind():
    """Beyond the square, and after a reset, there are no obstacles."""
    layer, rng = layer_of(), np.random.default_rng(6)
    for _ in range(3):
        update(layer, with_rock(ground(rng)))
    assert len(found(layer))
    update(layer, ground(rng)[:0], np.array([20.0, 0.0]))
    assert not layer.heights.any()
    update(layer, with_rock(ground(rng)))
    layer.reset()
    assert not layer.heights.any()
    np.testing.assert_array_equal(layer.centre, [0, 0])


def height_of(heights, cell=(20, 0), times=1, **settings):
    """Return the height of a cell in a cloud of known cells."""
    layer = layer_of(**settings)
    for _ in range(times):
        update(layer, grid_points(heights))
    return float(layer.heights[cell])


def test_the_height_is_that_over_the_mean_of_the_ground_on_either_side():
    """On a slope the ground between two opposite cells is their mean: the height is exact."""
    slope = {(i, j): 0.02 * i + 0.01 * j for i in range(-8, 45) for j in range(-20, 21)}
    slope[(20, 0)] += 0.05
    assert height_of(slope) == pytest.approx(0.05, abs=1e-5)
    assert height_of({(20, 0): 0.05}) == pytest.approx(0.05, abs=1e-5)


@pytest.mark.parametrize("beside", [(23, 0), (17, 0), (20, 3), (22, 2), (22, -2)])
@pytest.mark.parametrize("level", [0.2, -0.2])
def test_one_uneven_pair_beside_a_rock_does_no_harm(beside, level):
    """The median of four pairs counts: a boulder or a hole in one of them changes nothing."""
    heights = {(20, 0): 0.05, beside: level}
    assert height_of(heights, roughness_factor=0.0) == pytest.approx(0.05, abs=1e-5)


@pytest.mark.parametrize(
    ("pairs", "height"),
    [
        ([((23, 0), (17, 0))], 0.05),
        ([((23, 0), (17, 0)), ((20, 3), (20, -3))], 0.05 - 0.01),
        ([((23, 0), (17, 0)), ((20, 3), (20, -3)), ((22, 2), (18, -2))], 0.05 - 0.02),
    ],
)
def test_the_ground_level_is_the_median_of_the_pairs(pairs, height):
    """With one, two and three of four pairs 2 cm higher the level is their median."""
    heights = {(20, 0): 0.05} | {cell: 0.02 for pair in pairs for cell in pair}
    found = height_of(heights, roughness_factor=0.0)
    assert found == pytest.approx(height, abs=1e-5)


def test_a_pair_counts_only_when_both_of_its_cells_were_seen():
    """With one pair left its level alone counts; with none there is no height."""
    points = grid_points({(20, 0): 0.05, (23, 0): 0.02, (17, 0): 0.02})
    cells = np.floor(points[:, :2] / CELL).astype(int)
    for unseen, height in (
        ([(20, 3), (22, 2), (22, -2)], 0.03),
        ([(20, 3), (22, 2), (22, -2), (17, 0)], 0.0),
    ):
        hidden = (cells[:, None] == np.array(unseen)[None]).all(axis=2).any(axis=1)
        layer = layer_of(roughness_factor=0.0)
        update(layer, points[~hidden])
        assert layer.heights[20, 0] == pytest.approx(height, abs=1e-5)


@pytest.mark.parametrize(("x", "is_seen"), [(5, False), (6, True), (39, True), (40, False)])
def test_only_a_ring_around_the_robot_counts(x, is_seen):
    """Nearer than the least range and farther than the largest nothing stands out."""
    assert (height_of({(x, 0): 0.05}, (x, 0), min_range=0.65, max_range=4.0) > 0) == is_seen


@pytest.mark.parametrize(("x", "is_seen"), [(12, True), (13, False)])
def test_cells_whose_neighbours_would_wrap_around_do_not_count(x, is_seen):
    """In a small square the ring ends three cells and one before its edge."""
    elevation, layer = ElevationGrid(CELL, 32), layer_of(cells=32)
    elevation.describe(grid_points({(x, 0): 0.05}), ORIGIN)
    layer.update(elevation, ORIGIN)
    assert (layer.heights[x, 0] > 0) == is_seen


@pytest.mark.parametrize(("height", "is_low"), [(0.24, True), (0.26, False)])
def test_what_is_too_high_is_no_low_obstacle(height, is_low):
    """Objects above the largest height are the virtual scan's."""
    assert (height_of({(20, 0): height}, max_height=0.25) > 0) == is_low


@pytest.mark.parametrize(("count", "is_enough"), [(5, False), (6, True)])
def test_an_obstacle_needs_points(count, is_enough):
    """Fewer points than the least make no obstacle."""
    layer = layer_of(min_points=6.0)
    update(layer, grid_points({(20, 0): 0.05}, count))
    assert (layer.heights[20, 0] > 0) == is_enough


@pytest.mark.parametrize(("height", "is_one"), [(0.019, True), (0.017, False)])
def test_an_obstacle_has_a_least_height(height, is_one):
    """The mean height counts from the least height on."""
    assert (height_of({(20, 0): height}) > 0) == is_one


@pytest.mark.parametrize(("corner", "is_one"), [(0.35, True), (0.37, False)])
def test_an_obstacle_stands_out_of_what_is_around(corner, is_one):
    """It is as many times higher as the roughness factor says than the mean of 144 cells around.

    Four of them have a height here, in the corners, and the rock's neighbours do not count.
    """
    heights = {(20 + i, j): corner for i in (-6, 6) for j in (-6, 6)}
    heights[(20, 0)] = 0.05
    height = height_of(heights, roughness_factor=5.0, max_height=1.0)
    assert (height > 0) == is_one


def test_the_mean_of_all_clouds_counts_with_a_bounded_weight():
    """Two clouds make the mean of their heights; old ones weigh at most the largest number."""
    layer = layer_of(decay=0.0)
    update(layer, grid_points({(20, 0): 0.06}))
    update(layer, grid_points({(20, 0): 0.03}))
    assert layer.heights[20, 0] == pytest.approx(0.045, abs=1e-5)
    bounded = layer_of(decay=0.0, max_points=6.0)
    for _ in range(5):
        update(bounded, grid_points({(20, 0): 0.06}))
    update(bounded, grid_points({(20, 0): 0.03}))
    assert bounded.heights[20, 0] == pytest.approx(0.045, abs=1e-5)


def test_a_faded_height_is_kept_down_to_half_the_least():
    """Each cloud without it leaves its share of the height, until that is less than half."""
    layer = layer_of(decay=0.5, max_points=6.0, min_height=0.02)
    update(layer, grid_points({(20, 0): 0.06}))
    heights = []
    for _ in range(4):
        update(layer, grid_points({}))
        heights.append(float(layer.heights[20, 0]))
    np.testing.assert_allclose(heights, [0.03, 0.015, 0.0, 0.0], atol=1e-5)


def test_only_cells_of_the_asked_ages_change():
    """A cell that is not due keeps its height and takes in nothing."""
    elevation, layer = ElevationGrid(CELL), layer_of()
    points = grid_points({(20, 0): 0.05, (20, 10): 0.05})
    stamps = np.where(points[:, 1] < 0.5, -1.5, -0.5)
    elevation.describe(points, ORIGIN, stamps)
    layer.update(elevation, ORIGIN, (1.0, 1.5))
    assert not layer.heights.any()
    layer.update(elevation, ORIGIN, (1.5, 2.0))
    assert layer.heights[20, 0] == pytest.approx(0.05, abs=1e-5)
    assert layer.heights[20, 10] == 0.0
    layer.update(elevation, ORIGIN, (0.5, 1.5))
    assert layer.heights[20, 10] == pytest.approx(0.05, abs=1e-5)


def test_its_cells_are_a_power_of_two():
    """Indices are wrapped around by their lowest bits."""
    with pytest.raises(ValueError, match="expected a power of 2, got 100"):
        LowObstacleLayerConfig(cells=100)
