"""Boosted trees, grown by scikit-learn, and its fitted models as flat arrays."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from traversability.trees import COLUMNS, Trees, Vote

Tree = tuple[NDArray[Any], ...]


class Growth(Protocol):
    """How boosted trees are grown; see ``ForestConfig``."""

    @property
    def max_depth(self) -> int:
        """Deepest split."""

    @property
    def min_leaf(self) -> int:
        """Fewest samples of a leaf."""

    @property
    def rate(self) -> float:
        """Learning rate."""

    @property
    def shrink(self) -> float:
        """L2 penalty of leaves."""


def fit_boosted(
    features: NDArray[np.float32],
    red: NDArray[np.bool_],
    names: tuple[str, ...],
    trees: int,
    growth: Growth,
    seed: int,
    weights: NDArray[np.float64] | None = None,
) -> Trees:
    """Return boosted trees that tell red samples from green ones.

    Args:
        features: Shape (n, f).
        red: Shape (n,).
        names: Of the features.
        trees: How many.
        growth: How.
        seed: Of the splits.
        weights: What each counts, shape (n,); None for one each.
    """
    from sklearn.ensemble import HistGradientBoostingClassifier

    model = HistGradientBoostingClassifier(
        max_iter=trees,
        max_depth=growth.max_depth,
        max_leaf_nodes=None,
        min_samples_leaf=min(growth.min_leaf, max(1, len(red) // 100)),
        learning_rate=growth.rate,
        l2_regularization=growth.shrink,
        early_stopping=False,
        random_state=seed,
    )
    return flatten_boosted(model.fit(features, red, sample_weight=weights), names)


def flatten_random(model: Any, names: tuple[str, ...]) -> Trees:  # noqa: ANN401 - scikit-learn has no types.
    """Return a fitted scikit-learn random forest as flat arrays."""
    trees = []
    for estimator in model.estimators_:
        tree = estimator.tree_
        share = tree.value[:, 0, :]
        leaf = share[:, 1] / share.sum(axis=1)
        sides = tree.children_left, tree.children_right
        trees.append(_siblings_together(*sides, tree.feature, tree.threshold, leaf))
    return _in_a_row(trees, names, "mean", 0.0)


def flatten_boosted(model: Any, names: tuple[str, ...]) -> Trees:  # noqa: ANN401 - scikit-learn has no types.
    """Return fitted scikit-learn boosted trees as flat arrays."""
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


def _siblings_together(
    left: NDArray[Any],
    right: NDArray[Any],
    feature: NDArray[Any],
    cut: NDArray[Any],
    leaf: NDArray[Any],
) -> Tree:
    """Return feature, cut, left child and leaf of a tree, its nodes renumbered."""
    order = [0]
    child = np.zeros(len(left), dtype=np.int64)
    for place in range(len(left)):
        node = order[place]
        if left[node] >= 0:
            child[place] = len(order)
            order += [int(left[node]), int(right[node])]
    inner = left[order] >= 0
    return (
        np.where(inner, feature[order], -1),
        np.where(inner, cut[order], 0.0),
        child,
        np.where(inner, 0.0, leaf[order]),
    )


def _in_a_row(trees: list[Tree], names: tuple[str, ...], vote: Vote, base: float) -> Trees:
    """Return trees one after the other."""
    sizes = [len(tree[0]) for tree in trees]
    roots = np.concatenate([[0], np.cumsum(sizes[:-1])])
    moved = [(a, b, left + root, c) for (a, b, left, c), root in zip(trees, roots, strict=True)]
    columns = [np.concatenate(parts) for parts in zip(*moved, strict=True)]
    named = dict(zip(COLUMNS, (roots, *columns), strict=True))
    typed = {name: named[name].astype(dtype) for name, dtype in COLUMNS.items()}
    return Trees(names, vote, base, **typed)
