"""Squares: planes with known answers, labels, and the classifier's file."""

import numpy as np
import pytest

from andabata.models import shipped_ground_classifier
from traversability.cartesian.classifier import (
    GroundClassifier,
    GroundClassifierConfig,
    GroundSamples,
    ground_samples,
    train_ground_classifier,
    train_stage,
)
from traversability.cartesian.context import (
    CONTEXT_FEATURES,
    MAX_LOG_ODDS,
    NO_NEIGHBOUR,
    add_context,
)
from traversability.cartesian.elevation_grid import HIGHEST, LOWEST, MEAN, POINTS, ElevationGrid
from traversability.cartesian.features import (
    GROUND_FEATURES,
    MAX_RANGE,
    MIN_RANGE,
    GroundFeatures,
    label_ground_cells,
)
from traversability.cloud import PointCloud
from traversability.forest import ForestFileError
from traversability.grid import PolarGrid

HERE = np.zeros(2)


def column(name):
    """Return the place of a feature."""
    return GROUND_FEATURES.index(name)


def flat(x, y):
    """Return level ground."""
    return 0.0 * x


def sheet(height, half=11.0, spacing=0.025):
    """Return points of a surface around the origin, float32, shape (n, 3)."""
    axis = np.arange(-half + spacing / 2, half, spacing)
    x, y = (part.ravel() for part in np.meshgrid(axis, axis, indexing="ij"))
    return np.stack([x, y, height(x, y)], axis=1).astype(np.float32)


def trunk(x, y, radius=0.1, height=2.0):
    """Return points of an upright trunk, float32, shape (n, 3)."""
    turn, z = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.arange(0.0, height, 0.05))
    ring = [x + radius * np.cos(turn), y + radius * np.sin(turn), z]
    return np.stack([part.ravel() for part in ring], axis=1).astype(np.float32)


def described(points, here=HERE):
    """Return places and features of a cloud's squares."""
    tiles, features = ElevationGrid(), GroundFeatures()
    tiles.describe(points, here)
    features.describe(tiles, here)
    return features.cells.copy(), features.values.copy()


def test_a_tile_knows_its_ground_and_what_stands_on_it_and_no_crown():
    points = np.array(
        [[0.05, 0.05, 1.0], [0.02, 0.08, 1.2], [0.07, 0.01, 1.9], [0.05, 0.05, 4.0]], np.float32
    )
    tiles = ElevationGrid()
    tiles.describe(points, HERE)
    own = tiles.table[0, 0]
    assert own[LOWEST] == np.float32(1.0)
    assert own[POINTS] == 2
    assert own[MEAN] == pytest.approx(1.1)
    assert own[HIGHEST] == np.float32(1.9)


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.36])
@pytest.mark.parametrize("heading", [0.0, 0.6, 2.2])
def test_a_plane_has_its_slope_and_nothing_beside_it(slope, heading):
    c, s = np.cos(heading), np.sin(heading)
    _, values = described(sheet(lambda x, y: slope * (c * x + s * y)))
    for window in ("near", "around", "wide"):
        assert values[:, column(f"filled_{window}")] == pytest.approx(1.0)
        assert values[:, column(f"slope_{window}")] == pytest.approx(slope, abs=2e-3)
        for name in ("roughness", "step", "rise", "drop"):
            assert values[:, column(f"{name}_{window}")] == pytest.approx(0.0, abs=2e-3)
        # Points lie half their spacing short of the edges of tiles.
        short = 0.0125 * slope * (abs(c) + abs(s))
        assert values[:, column(f"peak_{window}")] == pytest.approx(-short, abs=2e-3)


def test_a_step_is_as_high_as_it_is_where_the_windows_cross_it():
    places, values = described(sheet(lambda x, y: np.where(x > 2.0, 0.2, 0.0)))
    middle = 0.2 * places[:, 0] + 0.1
    beside = np.abs(middle - 2.0) < 0.15
    # The plane tilts with the step: in six rows of tiles, half of them up, half of it is left.
    step = values[:, column("step_near")]
    assert (step[beside] > 0.08).all()
    assert (step[np.abs(middle - 2.0) > 0.4] < 2e-3).all()
    assert (values[np.abs(middle - 2.0) > 1.0, column("step_wide")] < 2e-3).all()


def test_a_trunk_stands_out_of_its_own_squares_alone():
    places, values = described(np.concatenate([sheet(flat), trunk(2.1, 1.1)]))
    away = np.hypot(*(0.2 * places + 0.1 - [2.1, 1.1]).T)
    spread, slope = values[:, column("spread")], values[:, column("slope_near")]
    assert spread[away < 0.05].min() > 1.0
    assert (spread[away > 0.3] == 0).all()
    assert (np.abs(slope[away > 0.3]) < 2e-3).all()  # Tall tiles tilt no plane.


def test_the_highest_point_stands_out_further_than_the_tile_that_it_is_in():
    """A rock of a few centimetres is a few points, which the mean of a tile hides."""
    pebble = np.array([[2.05, 1.05, 0.06]], dtype=np.float32)
    places, values = described(np.concatenate([sheet(flat), pebble]))
    row = values[(places == [10, 5]).all(axis=1)][0]
    for window in ("near", "around", "wide"):
        assert row[column(f"peak_{window}")] == pytest.approx(0.06, abs=5e-3)
        assert row[column(f"rise_{window}")] < 0.01


def test_squares_know_no_place_and_no_height():
    """Whole squares of shift change nothing, wherever odom begins."""
    rng = np.random.default_rng(0)
    points = rng.uniform([-5, -5, 0], [5, 5, 0.3], (20_000, 3)).astype(np.float32)
    places, values = described(points)
    shift = np.array([12.8, -3.2])
    shift_in_squares = np.round(shift / 0.2).astype(int)
    moved = points + np.array([*shift, 7.0], dtype=np.float32)
    others, same = described(moved, shift)
    lookup = {
        tuple(place): row for place, row in zip(places + shift_in_squares, values, strict=True)
    }
    shared = [k for k, place in enumerate(others) if tuple(place) in lookup]
    assert len(shared) > 0.99 * len(places)
    theirs = np.array([lookup[tuple(others[k])] for k in shared])
    # Rounding moves a few points across the edges of tiles.
    assert np.mean(np.abs(same[shared] - theirs) < 1e-3) > 0.98


def test_squares_are_judged_as_far_as_the_polar_grid_goes():
    places, _ = described(sheet(flat))
    ranges = np.hypot(*(0.2 * places + 0.1).T)
    assert PolarGrid().outer_radius == MAX_RANGE
    assert ranges.max() == pytest.approx(MAX_RANGE, abs=0.2)
    assert len(places) == pytest.approx(np.pi * (MAX_RANGE**2 - MIN_RANGE**2) / 0.04, rel=0.01)


def test_unseen_ground_has_no_squares_and_no_plane():
    assert len(described(np.empty((0, 3), dtype=np.float32))[0]) == 0
    places, values = described(np.array([[2.05, 0.05, 0.0]], dtype=np.float32))
    assert places.tolist() == [[10, 0]]
    assert values[0, column("slope_near")] == -1
    assert described(np.array([[10.5, 0.0, 0.0]], dtype=np.float32))[0].size == 0


def test_points_that_are_no_numbers_tell_nothing():
    good = sheet(flat)
    bad = np.concatenate([good, np.full((7, 3), np.nan, np.float32), [[np.inf, 0, 0]]])
    places, values = described(bad.astype(np.float32))
    expected = described(good)
    assert np.array_equal(places, expected[0])
    assert np.array_equal(values, expected[1])


def test_a_square_is_red_when_a_tile_of_it_is_and_crowns_make_none():
    ground = sheet(flat, spacing=0.05)
    thing, crown = trunk(2.05, 1.05, radius=0.03), ground[::3] + np.float32([0, 0, 2.5])
    points = np.concatenate([ground, thing, crown])
    bad = np.repeat([False, True, True], [len(ground), len(thing), len(crown)])
    places, _ = described(points)
    tiles = ElevationGrid()
    tiles.describe(points, HERE)
    red = label_ground_cells(PointCloud(points), bad, 0.15, tiles, places)
    assert places[red].tolist() == [[10, 5]]
    none = np.zeros(len(points), dtype=bool)
    assert not label_ground_cells(PointCloud(points), none, 0.15, tiles, places).any()


@pytest.mark.parametrize(
    ("bad", "share", "red"), [(4, 0.5, 0), (5, 0.5, 1), (1, 0.15, 0), (2, 0.15, 1)]
)
def test_a_tile_is_red_from_its_share_of_bad_points_on(bad, share, red):
    points = np.tile(np.array([[2.05, 1.05, 0.0]], np.float32), (10, 1))
    tiles = ElevationGrid()
    tiles.describe(points, HERE)
    found = label_ground_cells(
        PointCloud(points), np.arange(10) < bad, share, tiles, np.array([[10, 5]])
    )
    assert found.tolist() == [bool(red)]


def test_a_crown_without_ground_under_it_is_nothing():
    """A tile that only a crown fills, beside seen ground, is as if nobody had looked."""
    ground = sheet(flat)
    hole = (np.abs(ground[:, :2] - [2.0, 1.0]) < 0.3).all(axis=1)
    crown = ground[hole] + np.float32([0, 0, 2.5])
    beside, expected = described(np.concatenate([ground[~hole], crown])), described(ground[~hole])
    assert np.array_equal(beside[0], expected[0])
    assert np.array_equal(beside[1], expected[1])


def test_the_shipped_one_finds_a_trunk_and_leaves_the_ground_beside_it():
    forest = shipped_ground_classifier()
    rng = np.random.default_rng(1)
    points = np.concatenate([sheet(flat, spacing=0.04), trunk(2.1, 0.1), trunk(2.1, -1.3)])
    noisy = points + rng.normal(0, 0.008, points.shape).astype(np.float32)
    places, values = described(noisy)
    middles, odds = 0.2 * places + 0.1, forest.log_odds(values, places)
    for y in (0.1, -1.3):
        assert odds[np.argmin(np.hypot(*(middles - [2.1, y]).T))] > 1
    between = np.hypot(*(middles - [2.1, -0.6]).T) < 0.3
    assert (odds[between] < -1).all()


def few_samples(names=GROUND_FEATURES):
    """Return samples that a single split tells apart."""
    rng = np.random.default_rng(2)
    features = rng.uniform(0, 1, (2_000, len(names))).astype(np.float32)
    return GroundSamples(features, features[:, names.index("spread")] > 0.5, np.zeros(2_000, bool))


def rocky(seed):
    """Return a labelled cloud of level ground with a block on it, and the block's middle."""
    rng = np.random.default_rng(seed)
    ground, middle = sheet(flat, spacing=0.05), rng.uniform([2.0, -3.0], [4.0, 3.0])
    low, high = [*(middle - 0.3), 0.0], [*(middle + 0.3), 0.4]
    points = np.concatenate([ground, rng.uniform(low, high, (400, 3))]).astype(np.float32)
    bad = (np.abs(points[:, :2] - middle) < 0.3).all(axis=1)
    return PointCloud(points, nontraversable=bad, forbidden=bad), middle


def test_it_learns_and_comes_back_from_its_file_the_same():
    samples, config = few_samples(), GroundClassifierConfig(trees=20, share=1.0)
    look = train_stage(samples, GROUND_FEATURES, config, 0)
    assert np.mean((look.log_odds(samples.features) > 0) == samples.blocked) > 0.99
    clouds = [rocky(seed)[0] for seed in range(4)]
    forest, same = (
        train_ground_classifier((clouds[:2], clouds[2:]), config, 0, {"seed": 0}) for _ in "ab"
    )
    data = forest.to_bytes()
    again = GroundClassifier.from_bytes(data)
    assert again.to_bytes() == data == same.to_bytes()
    places, values = described(rocky(9)[0].points)
    assert np.array_equal(again.log_odds(values, places), forest.log_odds(values, places))
    assert [count > 10_000 for count in forest.summary["squares"]] == [True, True]
    assert len(data) < 1 << 20


def test_the_second_look_finds_a_block_that_nobody_showed_it():
    clouds = [rocky(seed)[0] for seed in range(6)]
    forest = train_ground_classifier(
        (clouds[:3], clouds[3:]), GroundClassifierConfig(trees=20, share=1.0), 0
    )
    cloud, middle = rocky(9)
    places, values = described(cloud.points)
    away, odds = np.abs(0.2 * places + 0.1 - middle).max(axis=1), forest.log_odds(values, places)
    assert (odds[away < 0.2] > 0).all()
    assert (odds[away > 0.6] < 0).all()


def test_context_is_what_the_neighbours_were_taken_for():
    """Five squares in a cross and one alone, where the answer is counted by hand."""
    cross = [[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]
    places, odds = np.array([*cross, [7, 7]]), np.array([3.0, -1.0, 2.0, -20.0, 20.0, 1.0])
    features = np.arange(6 * len(GROUND_FEATURES), dtype=np.float32).reshape(6, -1)
    rows = add_context(features, odds, places)
    assert rows.shape == (6, len(CONTEXT_FEATURES))
    assert np.array_equal(rows[:, : len(GROUND_FEATURES)], features)
    found = rows[:, len(GROUND_FEATURES) :]
    assert found[0].tolist() == [
        3.0,
        (-1.0 + 2.0 - MAX_LOG_ODDS + MAX_LOG_ODDS) / 4,
        -MAX_LOG_ODDS,
        MAX_LOG_ODDS,
    ]
    assert found[1].tolist() == [
        -1.0,
        1.0,
        -MAX_LOG_ODDS,
        MAX_LOG_ODDS,
    ]  # Diagonal ones are beside it, too.
    assert found[5].tolist() == [1.0, NO_NEIGHBOUR, NO_NEIGHBOUR, NO_NEIGHBOUR]
    order = np.array([3, 1, 5, 0, 2, 4])
    assert np.array_equal(add_context(features[order], odds[order], places[order]), rows[order])
    assert np.array_equal(add_context(features, odds, places - 1000), rows)
    assert add_context(features[:0], odds[:0], places[:0]).shape == (0, len(CONTEXT_FEATURES))


def test_low_things_count_more():
    """Where red and green look the same, what counts more is believed."""
    rng = np.random.default_rng(3)
    features = np.zeros((4_000, len(GROUND_FEATURES)), dtype=np.float32)
    red = rng.uniform(size=4_000) < 0.4
    samples = GroundSamples(features, red, red)
    even, thrice = (
        train_stage(
            samples, GROUND_FEATURES, GroundClassifierConfig(trees=30, low=low), 0
        ).log_odds(features[:1])[0]
        for low in (1.0, 3.0)
    )
    assert even == pytest.approx(np.log(red.mean() / (1 - red.mean())), abs=0.01)
    assert thrice - even == pytest.approx(np.log(3), abs=0.01)


def test_low_things_are_told_from_slopes_and_trunks():
    ground, rng = sheet(flat, spacing=0.05), np.random.default_rng(4)
    rock = rng.uniform([2.0, 1.0, 0.0], [2.2, 1.2, 0.07], (60, 3)).astype(np.float32)
    wood = trunk(-2.1, 1.1, radius=0.03)
    points = np.concatenate([ground, rock, wood])
    bad = np.repeat([False, True, True], [len(ground), len(rock), len(wood)])
    steep = (np.abs(ground[:, :2] - [0.1, 3.1]) < 0.1).all(axis=1)
    severity = np.where(bad, np.inf, -2.0).astype(np.float32)
    bad[: len(ground)], severity[: len(ground)][steep] = steep, 1.5
    cloud = PointCloud(points, nontraversable=bad, severity=severity, forbidden=bad)
    samples = ground_samples([cloud], 1.0, rng)
    heights = samples.features[samples.low, column("height")]
    assert 1 <= samples.low.sum() < samples.blocked.sum()
    assert (heights < 0.13).all()
    assert (heights > 0).all()


def test_ground_that_the_true_map_forbids_is_red_whatever_its_points_belong_to():
    ground = sheet(flat, spacing=0.05)
    around = (np.abs(ground[:, :2] - [2.1, 1.1]) < 0.1).all(axis=1)
    cloud = PointCloud(ground, nontraversable=np.zeros(len(ground), bool), forbidden=around)
    samples = ground_samples([cloud], 1.0, np.random.default_rng(5))
    assert 1 <= samples.blocked.sum() <= 9  # Clouds are turned: 0.2 m of it touch so many squares.
    assert not samples.low.any()


def test_bad_input_is_refused():
    samples = few_samples()
    green = np.zeros(10, bool)
    few = GroundSamples(samples.features[:10], green, green)
    both = "expected ground cells of both kinds, got 0 blocked of 10"
    with pytest.raises(ValueError, match=both):
        train_stage(few, GROUND_FEATURES, GroundClassifierConfig(), 0)
    with pytest.raises(ValueError, match="expected some with ground cells, got none"):
        ground_samples([], 1.0, np.random.default_rng(0))
    unknown = PointCloud(sheet(flat), nontraversable=np.zeros(len(sheet(flat)), bool))
    with pytest.raises(ValueError, match="expected clouds that know which places the true map"):
        ground_samples([unknown], 1.0, np.random.default_rng(0))
    config = GroundClassifierConfig(trees=3)
    first = train_stage(samples, GROUND_FEATURES, config, 0)
    second = train_stage(few_samples(CONTEXT_FEATURES), CONTEXT_FEATURES, config, 0)
    forest = GroundClassifier(first, second, 0.1)
    with pytest.raises(ValueError, match=r"features: expected shape \(n, 26\), got \(5, 25\)"):
        forest.log_odds(samples.features[:5, :-1], np.zeros((5, 2), int))
    with pytest.raises(ValueError, match="expected those of 26 and 30 features, got 30 and 26"):
        GroundClassifier(second, first, 0.1)
    data = forest.to_bytes()
    for damaged in (b"", data[:100], data[:-40]):
        with pytest.raises(ForestFileError, match="expected a ground classifier"):
            GroundClassifier.from_bytes(damaged)
