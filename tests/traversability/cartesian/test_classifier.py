"""The ground classifier: samples, both stages, and its file."""

import numpy as np
import pytest

from andabata.models import shipped_ground_classifier
from tests.support.ground_cell_clouds import (
    column,
    described,
    flat,
    rocky,
    sheet,
    trunk,
)
from traversability.arrays import pack, unpack
from traversability.cartesian.classifier import (
    GroundClassifier,
    GroundClassifierConfig,
    GroundSamples,
    ground_samples,
    train_ground_classifier,
    train_stage,
)
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.features import GROUND_FEATURES
from traversability.cloud import PointCloud
from traversability.forest import ForestFileError


def test_the_shipped_classifier_finds_trunks_and_the_free_ground_between():
    """Cells with trunks are blocked, those between them are free."""
    forest = shipped_ground_classifier()
    rng = np.random.default_rng(1)
    points = np.concatenate([sheet(flat, spacing=0.04), trunk(2.1, 0.1), trunk(2.1, -1.3)])
    noisy = points + rng.normal(0, 0.008, points.shape).astype(np.float32)
    cells, values = described(noisy)
    middles, log_odds = 0.2 * cells + 0.1, forest.log_odds(values, cells)
    for y in (0.1, -1.3):
        assert log_odds[np.argmin(np.hypot(*(middles - [2.1, y]).T))] > 1
    between = np.hypot(*(middles - [2.1, -0.6]).T) < 0.3
    assert (log_odds[between] < -1).all()


def few_samples(names=GROUND_FEATURES):
    """Return samples that a single split tells apart."""
    rng = np.random.default_rng(2)
    features = rng.uniform(0, 1, (2_000, len(names))).astype(np.float32)
    return GroundSamples(features, features[:, names.index("spread")] > 0.5, np.zeros(2_000, bool))


def test_a_trained_classifier_is_the_same_after_its_file():
    """The same seed gives the same bytes, and these the same log odds."""
    samples, config = few_samples(), GroundClassifierConfig(trees=20, sample_share=1.0)
    stage = train_stage(samples, GROUND_FEATURES, config, 0)
    assert np.mean((stage.log_odds(samples.features) > 0) == samples.blocked) > 0.99
    clouds = [rocky(seed)[0] for seed in range(4)]
    forest, same = (
        train_ground_classifier((clouds[:2], clouds[2:]), config, 0, {"seed": 0}) for _ in "ab"
    )
    data = forest.to_bytes()
    again = GroundClassifier.from_bytes(data)
    assert again.to_bytes() == data == same.to_bytes()
    cells, values = described(rocky(9)[0].points)
    assert np.array_equal(again.log_odds(values, cells), forest.log_odds(values, cells))
    assert [count > 10_000 for count in forest.summary["squares"]] == [True, True]
    assert len(data) < 1 << 20


def test_the_second_stage_finds_a_block_in_a_cloud_of_its_own():
    """A block that was not trained on is blocked, the ground around it is free."""
    clouds = [rocky(seed)[0] for seed in range(6)]
    forest = train_ground_classifier(
        (clouds[:3], clouds[3:]), GroundClassifierConfig(trees=20, sample_share=1.0), 0
    )
    cloud, middle = rocky(9)
    cells, values = described(cloud.points)
    away, log_odds = np.abs(0.2 * cells + 0.1 - middle).max(axis=1), forest.log_odds(values, cells)
    assert (log_odds[away < 0.2] > 0).all()
    assert (log_odds[away > 0.6] < 0).all()


def test_low_objects_have_a_greater_weight():
    """With equal features, the log odds grow by the log of the weight."""
    rng = np.random.default_rng(3)
    features = np.zeros((4_000, len(GROUND_FEATURES)), dtype=np.float32)
    blocked = rng.uniform(size=4_000) < 0.4
    samples = GroundSamples(features, blocked, blocked)
    even, thrice = (
        train_stage(
            samples, GROUND_FEATURES, GroundClassifierConfig(trees=30, low_object_weight=low), 0
        ).log_odds(features[:1])[0]
        for low in (1.0, 3.0)
    )
    assert even == pytest.approx(np.log(blocked.mean() / (1 - blocked.mean())), abs=0.01)
    assert thrice - even == pytest.approx(np.log(3), abs=0.01)


def test_low_objects_are_neither_slopes_nor_trunks():
    """A low rock alone is marked low, among a rock, a trunk and a steep patch."""
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


def test_ground_that_the_true_map_forbids_is_blocked():
    """The map decides, whatever the points belong to."""
    ground = sheet(flat, spacing=0.05)
    around = (np.abs(ground[:, :2] - [2.1, 1.1]) < 0.1).all(axis=1)
    cloud = PointCloud(ground, nontraversable=np.zeros(len(ground), bool), forbidden=around)
    samples = ground_samples([cloud], 1.0, np.random.default_rng(5))
    assert 1 <= samples.blocked.sum() <= 9  # Clouds are turned: 0.2 m of it touch so many squares.
    assert not samples.low.any()


def test_bad_input_is_refused():
    """Errors name what was expected and what came."""
    samples = few_samples()
    free = np.zeros(10, bool)
    few = GroundSamples(samples.features[:10], free, free)
    with pytest.raises(ValueError, match="of both kinds, got 0 blocked of 10; add"):
        train_stage(few, GROUND_FEATURES, GroundClassifierConfig(), 0)
    with pytest.raises(ValueError, match="expected some with ground cells, got none"):
        ground_samples([], 1.0, np.random.default_rng(0))
    unknown = PointCloud(sheet(flat), nontraversable=np.zeros(len(sheet(flat)), bool))
    with pytest.raises(ValueError, match="expected clouds with the places that the true map"):
        ground_samples([unknown], 1.0, np.random.default_rng(0))
    config = GroundClassifierConfig(trees=3)
    first = train_stage(samples, GROUND_FEATURES, config, 0)
    second = train_stage(few_samples(CONTEXT_FEATURES), CONTEXT_FEATURES, config, 0)
    forest = GroundClassifier(first, second, 0.1)
    n, more = len(GROUND_FEATURES), len(CONTEXT_FEATURES)
    with pytest.raises(
        ValueError, match=rf"features: expected shape \(n, {n}\), got \(5, {n - 1}\)"
    ):
        forest.log_odds(samples.features[:5, :-1], np.zeros((5, 2), int))
    with pytest.raises(
        ValueError, match=f"expected those of {n} and {more} features, got {more} and {n}"
    ):
        GroundClassifier(second, first, 0.1)
    with pytest.raises(ValueError, match="cell: expected an edge above 0 m, got inf"):
        GroundClassifier(first, second, np.inf)
    data = forest.to_bytes()
    arrays, header = unpack(data, 1 << 30)
    hostile = pack(arrays, {**header, "cell": 10**400})
    with pytest.raises(ForestFileError, match="mine: expected a ground classifier"):
        GroundClassifier.from_bytes(hostile, "mine")
    for damaged in (b"", data[:100], data[:-40]):
        with pytest.raises(ForestFileError, match="expected a ground classifier"):
            GroundClassifier.from_bytes(damaged)
