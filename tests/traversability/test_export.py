"""The exported forest gives the same probabilities."""

import numpy as np
import pytest

from andabata.models import shipped_forest
from traversability.export import forest_to_onnx
from traversability.features import ALL_FEATURES, cell_features
from traversability.forest import Forest, Thresholds
from traversability.grid import PolarGrid
from traversability.trees.flat import Trees

pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed (extra `onnx`)")


def run(data, features):
    """Return the probabilities of an ONNX model."""
    session = runtime.InferenceSession(data, providers=["CPUExecutionProvider"])
    return session.run(["probability"], {"features": features})[0][:, 0]


def real_features():
    """Return features of cells of made ground."""
    rng = np.random.default_rng(0)
    xy = rng.uniform(-10, 10, (30_000, 2))
    z = 0.3 * np.sin(xy[:, 0]) + rng.normal(0, 0.02, len(xy)) + (xy[:, 1] > 4) * rng.random(len(xy))
    cells = cell_features(np.column_stack([xy, z]).astype(np.float32), PolarGrid())
    return cells.values[cells.counts >= 5]


def test_the_shipped_forest_is_the_same_in_onnx():
    """Screen and exits included."""
    features, forest = real_features(), shipped_forest()
    expected = forest.predict_proba(features)
    assert (expected > 0.5).any()
    assert (expected < 0.1).any()
    found = run(forest_to_onnx(forest), features)
    near = np.abs(found - expected) < 1e-5
    # A sum within a rounding of the screen's limit may fall on its other side.
    assert near.mean() > 0.999


def test_a_mean_of_leaves_is_the_same_in_onnx():
    """A value on a cut goes left there, too."""
    trees = Trees(
        features=("tilt", "roughness"),
        vote="mean",
        base=0.0,
        roots=np.array([0, 3], dtype=np.int32),
        feature=np.array([0, -1, -1, 1, -1, -1], dtype=np.int16),
        cut=np.array([0.3, 0, 0, 0.1, 0, 0]),
        left=np.array([1, 0, 0, 4, 0, 0], dtype=np.int32),
        leaf=np.array([0, 0.1, 0.9, 0, 0.2, 0.8], dtype=np.float32),
    )
    forest = Forest(trees, Thresholds(), PolarGrid())
    features = np.random.default_rng(1).random((500, len(ALL_FEATURES))).astype(np.float32)
    features[0, ALL_FEATURES.index("tilt")] = 0.3
    found = run(forest_to_onnx(forest), features)
    np.testing.assert_allclose(found, forest.predict_proba(features), atol=1e-6)
