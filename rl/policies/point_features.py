"""Compiled global features of a set of points, and their exact gradient (Zhang et al., SPN).

A feature is a maximum over all points, so that a single point of a set decides it, and its gradient
goes through that point alone: the maxima are found over all points without a graph, and the
gradient is computed for the K selected ones.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl.spaces import ObservationSpec
from terrain.kernel import kernel

POINTS, MASK = "points", "mask"
"""Names of the terms: points [1/m], shape (n, 2), and 1 for each that counts, shape (n,)."""

SLOPE = 0.01
"""Slope of the leaky rectifier below zero (assumption)."""

UNROLLED = 8
"""Number that the width is a multiple of, so that sums need no remainder."""

NO_POINT = -1
"""Index of the point that is selected where none counts."""

_BLOCK = 64
"""Number of points that go through the layers together: as many hidden units of 64 fit the cache.
"""


class PointLayout(NamedTuple):
    """Places of the points in an observation vector.

    Attributes:
        points: Column of the first point.
        mask: Column of the first point's mask, -1 where all points count.
        size: Number of points.
    """

    points: int
    mask: int
    size: int


class PointLayers(NamedTuple):
    """Weights of the layers that each point goes through (Eq. 1).

    Attributes:
        point_weight: W1, float32, shape (H, 2).
        point_bias: b1, float32, shape (H,).
        feature_weight: Weights of the K features, float32, shape (K, H).
        feature_bias: Biases of the features, float32, shape (K,).
    """

    point_weight: NDArray[np.float32]
    point_bias: NDArray[np.float32]
    feature_weight: NDArray[np.float32]
    feature_bias: NDArray[np.float32]


class PointGradients(NamedTuple):
    """Gradients of a loss, each of the shape of its array.

    Attributes:
        gates: Gradient of the gates, float32, shape (b, H).
        point_weight: Gradient of W1.
        point_bias: Gradient of b1.
        feature_weight: Gradient of the features' weights.
        feature_bias: Gradient of the features' biases.
    """

    gates: NDArray[np.float32]
    point_weight: NDArray[np.float32]
    point_bias: NDArray[np.float32]
    feature_weight: NDArray[np.float32]
    feature_bias: NDArray[np.float32]


def point_layout(observations: ObservationSpec) -> PointLayout:
    """Return where a space has its points.

    Raises:
        ValueError: If there are no points, or the mask is not one value a point.
    """
    names = [term.name for term in observations.terms]
    if POINTS not in names:
        raise ValueError(f"observations: expected a term {POINTS!r}, got {names}")
    shape = observations.term(POINTS).shape
    if len(shape) != 2 or shape[1] != 2:
        raise ValueError(f"{POINTS}: expected shape (n, 2), got {shape}")
    mask = -1
    if MASK in names:
        if observations.term(MASK).shape != shape[:1]:
            raise ValueError(
                f"{MASK}: expected shape ({shape[0]},), got {observations.term(MASK).shape}"
            )
        mask = observations.slice_of(MASK).start
    return PointLayout(observations.slice_of(POINTS).start, mask, shape[0])


@kernel
def global_features(
    observations: NDArray[np.float32],
    layout: PointLayout,
    layers: PointLayers,
    gates: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the K features of each observation and the points that give them, shapes (b, K).

    Of equal points the first is selected. Where no point counts, the features are those of a point
    infinitely far away, (0, 0), and the indices are ``NO_POINT``.

    Args:
        observations: Observations, float32, shape (b, n_observations).
        layout: Places of the points.
        layers: Weights.
        gates: Gates of the hidden units from 0 to 1, float32, shape (b, H).
    """
    n_features, width = layers.feature_weight.shape
    rows = len(observations)
    features = np.empty((rows, n_features), dtype=np.float32)
    selected = np.empty((rows, n_features), dtype=np.int32)
    room = -(-max(layout.size, 1) // _BLOCK) * _BLOCK
    x, y = np.empty(room, dtype=np.float32), np.empty(room, dtype=np.float32)
    index = np.empty(room, dtype=np.int32)
    hidden = np.empty((width, _BLOCK), dtype=np.float32)
    # Features are computed in pairs: an odd one gets a partner of zeros.
    pairs = n_features + n_features % 2
    gated, bias = np.zeros((pairs, width), dtype=np.float32), np.zeros(pairs, dtype=np.float32)
    bias[:n_features] = layers.feature_bias
    best = np.empty((pairs, _BLOCK), dtype=np.float32)
    where = np.empty((pairs, _BLOCK), dtype=np.int32)
    for row in range(rows):
        count = _gather(observations[row], layout, x, y, index)
        # The gate is the same for all points: one product a feature instead of one a point.
        for k in range(n_features):
            for h in range(width):
                gated[k, h] = layers.feature_weight[k, h] * gates[row, h]
        best[:], where[:] = -np.inf, NO_POINT
        for start in range(0, count, _BLOCK):
            _hidden_units(layers, x[start : start + _BLOCK], y[start : start + _BLOCK], hidden)
            _raise_maxima(hidden, gated, bias, start, best, where)
        _reduce(best, where, index, features[row], selected[row])
    return features, selected


@kernel
def _gather(
    observation: NDArray[np.float32],
    layout: PointLayout,
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    index: NDArray[np.int32],
) -> int:
    """Copy the points that count, filled up to whole blocks with the first; return their number."""
    count = 0
    for i in range(layout.size):
        if layout.mask < 0 or observation[layout.mask + i] > 0.5:
            x[count] = observation[layout.points + 2 * i]
            y[count] = observation[layout.points + 2 * i + 1]
            index[count] = i
            count += 1
    if count == 0:
        x[0], y[0], index[0] = 0.0, 0.0, NO_POINT
        count = 1
    # A copy of a point changes no maximum.
    full = -(-count // _BLOCK) * _BLOCK
    for i in range(count, full):
        x[i], y[i], index[i] = x[0], y[0], index[0]
    return full


@kernel
def _hidden_units(
    layers: PointLayers,
    x: NDArray[np.float32],
    y: NDArray[np.float32],
    hidden: NDArray[np.float32],
) -> None:
    """Write the rectified first layer of a block of points, shape (H, block), without the gate."""
    slope = np.float32(SLOPE)
    for h in range(hidden.shape[0]):
        along_x, along_y = layers.point_weight[h, 0], layers.point_weight[h, 1]
        bias = layers.point_bias[h]
        for lane in range(_BLOCK):
            value = along_x * x[lane] + along_y * y[lane] + bias
            hidden[h, lane] = value if value > 0.0 else value * slope


@kernel
def _raise_maxima(
    hidden: NDArray[np.float32],
    gated: NDArray[np.float32],
    bias: NDArray[np.float32],
    start: int,
    best: NDArray[np.float32],
    where: NDArray[np.int32],
) -> None:
    """Compare the features of a block of points with the best so far, lane by lane.

    Lanes are points, so that the innermost loops run over memory in its order and vectorise, and a
    point's sum is made in one order wherever it stands in the set. Two features by four hidden
    units at once: each value that is loaded serves twice, and the running sums are touched less.
    """
    one, two = np.empty(_BLOCK, dtype=np.float32), np.empty(_BLOCK, dtype=np.float32)
    for k in range(0, gated.shape[0], 2):
        for lane in range(_BLOCK):
            one[lane], two[lane] = bias[k], bias[k + 1]
        for h in range(0, gated.shape[1], 4):
            a, b, c, d = gated[k, h], gated[k, h + 1], gated[k, h + 2], gated[k, h + 3]
            e, f, g, i = (
                gated[k + 1, h],
                gated[k + 1, h + 1],
                gated[k + 1, h + 2],
                gated[k + 1, h + 3],
            )
            for lane in range(_BLOCK):
                p, q, r, s = (
                    hidden[h, lane],
                    hidden[h + 1, lane],
                    hidden[h + 2, lane],
                    hidden[h + 3, lane],
                )
                one[lane] = (((one[lane] + a * p) + b * q) + c * r) + d * s
                two[lane] = (((two[lane] + e * p) + f * q) + g * r) + i * s
        for lane in range(_BLOCK):
            if one[lane] > best[k, lane]:
                best[k, lane], where[k, lane] = one[lane], start + lane
            if two[lane] > best[k + 1, lane]:
                best[k + 1, lane], where[k + 1, lane] = two[lane], start + lane


@kernel
def _reduce(
    best: NDArray[np.float32],
    where: NDArray[np.int32],
    index: NDArray[np.int32],
    features: NDArray[np.float32],
    selected: NDArray[np.int32],
) -> None:
    """Write the greatest value over all lanes, and the first point that has it."""
    for k in range(len(features)):
        # Halves are folded onto each other: unlike a running maximum this vectorises.
        half = _BLOCK // 2
        while half > 0:
            for lane in range(half):
                other, place = best[k, lane + half], where[k, lane + half]
                is_first = other == best[k, lane] and place < where[k, lane]
                if other > best[k, lane] or is_first:
                    best[k, lane], where[k, lane] = other, place
            half //= 2
        features[k] = best[k, 0]
        selected[k] = index[where[k, 0]] if where[k, 0] >= 0 else NO_POINT


@kernel
def feature_gradients(
    observations: NDArray[np.float32],
    layout: PointLayout,
    layers: PointLayers,
    gates: NDArray[np.float32],
    selected: NDArray[np.int32],
    outer: NDArray[np.float32],
) -> PointGradients:
    """Return the gradients of a loss through the selected points.

    Args:
        observations: Observations, float32, shape (b, n_observations).
        layout: Places of the points.
        layers: Weights.
        gates: Gates of the hidden units, float32, shape (b, H).
        selected: Indices of the points, as ``global_features`` gave them.
        outer: Gradient of the loss by the features, float32, shape (b, K).
    """
    n_features, width = layers.feature_weight.shape
    slope = np.float32(SLOPE)
    # Rows of W1 side by side: the innermost loop runs over the hidden units.
    along_x, along_y = layers.point_weight[:, 0].copy(), layers.point_weight[:, 1].copy()
    by_x, by_y = np.zeros(width, dtype=np.float32), np.zeros(width, dtype=np.float32)
    by_bias = np.zeros(width, dtype=np.float32)
    by_gate = np.zeros((len(observations), width), dtype=np.float32)
    by_weight = np.zeros((n_features, width), dtype=np.float32)
    by_feature = np.zeros(n_features, dtype=np.float32)
    for row in range(len(observations)):
        gate = gates[row]
        for k in range(n_features):
            x, y, d = np.float32(0.0), np.float32(0.0), outer[row, k]
            if selected[row, k] != NO_POINT:
                x = observations[row, layout.points + 2 * selected[row, k]]
                y = observations[row, layout.points + 2 * selected[row, k] + 1]
            by_feature[k] += d
            for h in range(width):
                before = along_x[h] * x + along_y[h] * y + layers.point_bias[h]
                steep = np.float32(1.0) if before > 0.0 else slope
                rectified = before * steep
                weighted = d * layers.feature_weight[k, h]
                by_weight[k, h] += d * rectified * gate[h]
                by_gate[row, h] += weighted * rectified
                by_hidden = weighted * gate[h] * steep
                by_x[h] += by_hidden * x
                by_y[h] += by_hidden * y
                by_bias[h] += by_hidden
    by_point = np.empty((width, 2), dtype=np.float32)
    by_point[:, 0], by_point[:, 1] = by_x, by_y
    return PointGradients(by_gate, by_point, by_bias, by_weight, by_feature)
