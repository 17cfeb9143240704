"""The forest as ONNX, for runtimes without Python; needs the extra ``onnx``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.features import ALL_FEATURES
from traversability.forest import Forest
from traversability.trees import Trees


class ExportError(ValueError):
    """A forest that cannot be exported here."""


def forest_to_onnx(forest: Forest) -> bytes:
    """Return an ONNX model with the input ``features`` and the output ``probability``.

    ``features`` is float32 of shape (n, f) in the order of ``ALL_FEATURES``; ``probability`` of red
    is float32 of shape (n, 1). The screen, if there is one, is part of the model. Features and
    thresholds are in the model's metadata.

    Args:
        forest: What to export.

    Raises:
        ExportError: If onnx is not installed.
    """
    try:
        from onnx import TensorProto, checker, helper
    except ImportError as error:
        message = "expected the package onnx, got none; install the extra `onnx`"
        raise ExportError(message) from error
    nodes = _probability(helper, forest.trees, "trees")
    result = "trees_probability"
    constants = []
    if forest.screen is not None:
        nodes += _probability(helper, forest.screen.trees, "screen")
        limit = float(np.float32(forest.screen.limit))
        constants.append(helper.make_tensor("limit", TensorProto.FLOAT, [1], [limit]))
        nodes.append(helper.make_node("Less", ["screen_sum", "limit"], ["spared"]))
        nodes.append(
            helper.make_node("Where", ["spared", "screen_probability", result], ["chosen"])
        )
        result = "chosen"
    nodes.append(helper.make_node("Identity", [result], ["probability"]))
    shape: dict[str, list[str | int | None]] = {
        "features": ["n", len(ALL_FEATURES)],
        "probability": ["n", 1],
    }
    values = {
        name: helper.make_tensor_value_info(name, TensorProto.FLOAT, dimensions)
        for name, dimensions in shape.items()
    }
    graph = helper.make_graph(
        nodes, "forest", [values["features"]], [values["probability"]], constants
    )
    opsets = [helper.make_opsetid("", 17), helper.make_opsetid("ai.onnx.ml", 3)]
    model = helper.make_model(graph, opset_imports=opsets, ir_version=8)
    helper.set_model_props(
        model,
        {"features": ",".join(ALL_FEATURES), "thresholds": forest.thresholds.model_dump_json()},
    )
    checker.check_model(model)
    return bytes(model.SerializeToString())


def _probability(helper: Any, trees: Trees, name: str) -> list[Any]:  # noqa: ANN401 - onnx has few types.
    """Return nodes from ``features`` to ``name_sum`` and ``name_probability``."""
    columns = np.array([ALL_FEATURES.index(feature) for feature in trees.features])
    tree, number = _numbers(trees)
    inner = trees.feature >= 0
    leaf = np.flatnonzero(~inner)
    mean = trees.vote == "mean"
    cut = trees.cut.astype(np.float32)
    too_high = cut.astype(np.float64) > trees.cut
    cut[too_high] = np.nextafter(cut[too_high], np.float32(-np.inf))
    ensemble = helper.make_node(
        "TreeEnsembleRegressor",
        ["features"],
        [f"{name}_sum"],
        domain="ai.onnx.ml",
        n_targets=1,
        aggregate_function="AVERAGE" if mean else "SUM",
        base_values=[trees.base],
        nodes_treeids=tree.tolist(),
        nodes_nodeids=number.tolist(),
        nodes_featureids=np.where(inner, columns[trees.feature], 0).tolist(),
        nodes_modes=[("BRANCH_LEQ" if split else "LEAF") for split in inner],
        nodes_values=np.where(inner, cut, 0).tolist(),
        nodes_truenodeids=np.where(inner, number[trees.left], 0).tolist(),
        nodes_falsenodeids=np.where(inner, number[np.where(inner, trees.left + 1, 0)], 0).tolist(),
        target_treeids=tree[leaf].tolist(),
        target_nodeids=number[leaf].tolist(),
        target_ids=[0] * len(leaf),
        target_weights=trees.leaf[leaf].tolist(),
    )
    link = "Identity" if mean else "Sigmoid"
    return [ensemble, helper.make_node(link, [f"{name}_sum"], [f"{name}_probability"])]


def _numbers(trees: Trees) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the tree of each node, and its number within the tree."""
    nodes = np.arange(len(trees.feature))
    tree = np.searchsorted(trees.roots, nodes, side="right") - 1
    return tree, nodes - trees.roots[tree]
