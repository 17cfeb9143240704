"""The exported policy steers as ours does."""

import numpy as np
import pytest

from andabata.models import shipped_policy
from rl.export import policy_to_onnx

pytest.importorskip("onnx", reason="onnx is not installed (extra `onnx`)")
runtime = pytest.importorskip("onnxruntime", reason="onnxruntime is not installed (extra `onnx`)")


def test_the_shipped_policy_is_the_same_in_onnx():
    policy, rng = shipped_policy(), np.random.default_rng(0)
    low, high = policy.layout.bounds(policy.max_range, policy.limit)
    states = rng.uniform(low, high, (5_000, policy.layout.size)).astype(np.float32)
    states[:, :32] *= rng.uniform(0.05, 1, (5_000, 1))  # Crowded and open places.
    expected = np.array([policy.act(state) for state in states])
    assert (expected == 0).any()
    assert np.abs(expected).max() > 0.4
    session = runtime.InferenceSession(policy_to_onnx(policy), providers=["CPUExecutionProvider"])
    found = session.run(["steering"], {"state": states})[0][:, 0]
    # A rate within a rounding of the dead zone's edge may fall on its other side.
    near = np.abs(found - expected) < 1e-5
    assert near.mean() > 0.999
