"""Fitting of boosted trees by scikit-learn, and its fitted models as flat arrays."""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from traversability.trees.flat import COLUMNS, Trees, Vote


class Boosting(Protocol):
    """Parameters of boosted trees; see ``ForestConfig``."""

    @property
    def max_depth(self) -> int:
        """Largest number of splits from the root of a tree to a leaf."""

    @property
    def min_leaf(self) -> int:
        """Smallest number of samples in a leaf."""

    @property
    def learning_rate(self) -> float:
        """Learning rate."""

    @property
    def l2_regularization(self) -> float:
        """L2 penalty of leaves."""


def fit_boosted(
    features: NDArray[np.float32],
    blocked: NDArray[np.bool_],
    names: tuple[str, ...],
    trees: int,
    config: Boosting,
    seed: int,
    weights: NDArray[np.float64] | None = None,
) -> Trees:
    """Fit boosted trees that separate blocked samples from free ones.

    Args:
        features: Features, float32, shape (n, f).
        blocked: True for non-traversable samples, shape (n,).
        names: Names of the features.
        trees: Number of trees.
        config: Parameters of the trees.
        seed: Seed of the splits.
        weights: Weight of each sample, shape (n,); None for one each.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier

    model = HistGradientBoostingClassifier(
        max_iter=trees,
        max_depth=config.max_depth,
        max_leaf_nodes=None,
        min_samples_leaf=min(config.min_leaf, max(1, len(blocked) // 100)),
        learning_rate=config.learning_rate,
        l2_regularization=config.l2_regularization,
        early_stopping=False,
        random_state=seed,
    )
    return flatten_boosted(model.fit(features, blocked, sample_weight=weights), names)


def fit_correction(
    features: NDArray[np.float32],
    blocked: NDArray[np.bool_],
    sums: NDArray[np.float64],
    weights: NDArray[np.float64],
    names: tuple[str, ...],
    trees: int,
    feature_share: float,
    config: Boosting,
    seed: int,
) -> Trees:
    """Fit boosted trees that go on from the log odds of other trees (Friedman 2001).

    Leaves are Newton steps of the logistic loss, shrunk by ``config.learning_rate``.

    Args:
        features: Features, float32, shape (n, f).
        blocked: True for non-traversable samples, shape (n,).
        sums: Log odds of each sample so far, shape (n,).
        weights: Weight of each sample, shape (n,).
        names: Names of the features.
        trees: Number of trees.
        feature_share: Share of the features that each split chooses from.
        config: Parameters of the trees.
        seed: Seed of the choice of features.

    Returns:
        Trees whose sum of leaves, with a base of 0, is added to the log odds.
    """
    from sklearn.tree import DecisionTreeRegressor

    stages, sums = [], sums.astype(np.float64)
    for k in range(trees):
        probability = 1 / (1 + np.exp(-sums))
        residual = blocked - probability
        model: Any = DecisionTreeRegressor(
            max_depth=config.max_depth,
            min_samples_leaf=config.min_leaf,
            max_features=feature_share,
            random_state=seed + k,
        )
        place = model.fit(features, residual, sample_weight=weights).apply(features)
        size = model.tree_.node_count
        gradient = np.bincount(place, weights * residual, size)
        curvature = np.bincount(place, weights * probability * (1 - probability), size)
        # Inner nodes hold no sample: nothing to divide by without a penalty.
        scale = np.maximum(curvature + config.l2_regularization, np.finfo(np.float64).tiny)
        leaf = config.learning_rate * gradient / scale
        sides = model.tree_.children_left, model.tree_.children_right
        stages.append(_siblings_together(*sides, model.tree_.feature, model.tree_.threshold, leaf))
        sums = sums + leaf.astype(np.float32)[place]
    return _in_a_row(stages, names, "logistic", 0.0)


def flatten_random(model: Any, names: tuple[str, ...]) -> Trees:  # noqa: ANN401 - scikit-learn has no types.
    """Return a fitted scikit-learn random forest as flat arrays.

    Args:
        model: Fitted ``RandomForestClassifier`` of two classes.
        names: Names of the features.
    """
    trees = []
    for estimator in model.estimators_:
        tree = estimator.tree_
        share = tree.value[:, 0, :]
        leaf = share[:, 1] / share.sum(axis=1)
        sides = tree.children_left, tree.children_right
        trees.append(_siblings_together(*sides, tree.feature, tree.threshold, leaf))
    return _in_a_row(trees, names, "mean", 0.0)


def flatten_boosted(model: Any, names: tuple[str, ...]) -> Trees:  # noqa: ANN401 - scikit-learn has no types.
    """Return fitted scikit-learn boosted trees as flat arrays.

    Args:
        model: Fitted ``HistGradientBoostingClassifier`` of two classes.
        names: Names of the features.
    """
    trees = []
    for (predictor,) in model._predictors:
        nodes = predictor.nodes
        is_leaf = nodes["is_leaf"].astype(bool)
        left, right = (
            np.where(is_leaf, -1, nodes[side].astype(np.int64)) for side in ("left", "right")
        )
        cut, leaf = nodes["num_threshold"], nodes["value"]
        trees.append(_siblings_together(left, right, nodes["feature_idx"], cut, leaf))
    return _in_a_row(trees, names, "logistic", float(model._baseline_prediction.ravel()[0]))


class _Tree(NamedTuple):
    """One tree whose siblings lie next to each other; see ``Trees`` for the columns.

    Attributes:
        feature: Index of the feature that each node splits by, -1 at a leaf.
        cut: Largest value that goes left at each node.
        left: Left child of each node.
        leaf: Value that each leaf adds.
    """

    feature: NDArray[Any]
    cut: NDArray[Any]
    left: NDArray[Any]
    leaf: NDArray[Any]


def _siblings_together(
    left: NDArray[Any],
    right: NDArray[Any],
    feature: NDArray[Any],
    cut: NDArray[Any],
    leaf: NDArray[Any],
) -> _Tree:
    """Return a tree with its nodes renumbered level by level, so that siblings are neighbours.

    Args:
        left: Left child of each node, -1 at a leaf, shape (n,).
        right: Right child of each node, shape (n,).
        feature: Index of the feature that each node splits by, shape (n,).
        cut: Largest value that goes left at each node, shape (n,).
        leaf: Value that each leaf adds, shape (n,).
    """
    order = [0]
    child = np.zeros(len(left), dtype=np.int64)
    for place in range(len(left)):
        node = order[place]
        if left[node] >= 0:
            child[place] = len(order)
            order += [int(left[node]), int(right[node])]
    inner = left[order] >= 0
    return _Tree(
        np.where(inner, feature[order], -1),
        np.where(inner, cut[order], 0.0),
        child,
        np.where(inner, 0.0, leaf[order]),
    )


def _in_a_row(trees: list[_Tree], names: tuple[str, ...], vote: Vote, base: float) -> Trees:
    """Return trees one after the other, their children counted from the first tree's root.

    Args:
        trees: Trees to put in a row.
        names: Names of the features.
        vote: Way from the sum of leaves to a probability.
        base: Start of the sum of leaves.
    """
    sizes = [len(tree.feature) for tree in trees]
    roots = np.concatenate([[0], np.cumsum(sizes[:-1])])
    moved = [tree._replace(left=tree.left + root) for tree, root in zip(trees, roots, strict=True)]
    named = {
        name: np.concatenate([getattr(tree, name) for tree in moved]) for name in _Tree._fields
    }
    named["roots"] = roots
    typed = {name: named[name].astype(dtype) for name, dtype in COLUMNS.items()}
    return Trees(names, vote, base, **typed)
