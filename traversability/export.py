"""Export of the forest to ONNX, for runtimes without Python; needs the extra ``onnx``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.features import ALL_FEATURES
from traversability.forest import Forest
from traversability.trees.flat import Trees


class ForestExportError(ValueError):
    """An export that is not possible in this installation."""


def forest_to_onnx(forest: Forest) -> bytes:
    """Return an ONNX model with the input ``features`` and the output ``probability``.

    ``features`` is float32 of shape (n, f) in the order of ``ALL_FEATURES``; ``probability``
    (to be blocked) is float32 of shape (n, 1). The screen, if there is one, is part of the model.
    Features and thresholds are in the model's metadata.

    Args:
        forest: Forest to export.

    Raises:
        ForestExportError: If onnx is not installed.
    """
    try:
        from onnx import TensorProto, checker, helper
    except ImportError as error:
        message = "expected the package onnx, got none; install the extra `onnx`"
        raise ForestExportError(message) from error
    constants: list[Any] = []
    nodes, result = _trees(helper, forest, constants)
    if forest.screen is not None:
        nodes += _probability(helper, forest.screen.trees, "screen")
        limit = float(np.float32(forest.screen.limit))
        constants.append(_number(helper, "limit", limit))
        nodes.append(helper.make_node("Less", ["screen_sum", "limit"], ["screened"]))
        nodes.append(
            helper.make_node("Where", ["screened", "screen_probability", result], ["chosen"])
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


def _trees(helper: Any, forest: Forest, constants: list[Any]) -> tuple[list[Any], str]:  # noqa: ANN401 - onnx has few types.
    """Return the nodes from ``features`` to the probability after the exits, and its name.

    Args:
        helper: Module ``onnx.helper``.
        forest: Forest to export.
        constants: Constants of the graph, to which those of the exits are added.
    """
    if not forest.exits:
        return _probability(helper, forest.trees, "trees"), "trees_probability"
    # The sums so far after each stage of trees.
    nodes: list[Any] = []
    first, total = 0, ""
    stops = [exit_.trees for exit_ in forest.exits] + [len(forest.trees.roots)]
    for stage, stop in enumerate(stops):
        nodes += _ensemble(helper, forest.trees.between(first, stop), f"part{stage}")
        so_far = f"so_far{stage}"
        adds = helper.make_node("Add", [total, f"part{stage}_sum"], [so_far])
        nodes.append(adds if total else helper.make_node("Identity", ["part0_sum"], [so_far]))
        first, total = stop, so_far
    # From the last exit to the first: a clear sum so far replaces all that comes after.
    for stage, exit_ in reversed(list(enumerate(forest.exits))):
        low, high = f"low{stage}", f"high{stage}"
        constants += [_number(helper, low, exit_.low), _number(helper, high, exit_.high)]
        nodes += [
            helper.make_node("Less", [f"so_far{stage}", low], [f"under{stage}"]),
            helper.make_node("Greater", [f"so_far{stage}", high], [f"over{stage}"]),
            helper.make_node("Or", [f"under{stage}", f"over{stage}"], [f"leaves{stage}"]),
            helper.make_node(
                "Where", [f"leaves{stage}", f"so_far{stage}", total], [f"after{stage}"]
            ),
        ]
        total = f"after{stage}"
    nodes.append(helper.make_node("Sigmoid", [total], ["trees_probability"]))
    return nodes, "trees_probability"


def _number(helper: Any, name: str, value: float) -> Any:  # noqa: ANN401 - onnx has few types.
    """Return a float32 constant of shape (1,)."""
    from onnx import TensorProto

    return helper.make_tensor(name, TensorProto.FLOAT, [1], [float(np.float32(value))])


def _probability(helper: Any, trees: Trees, name: str) -> list[Any]:  # noqa: ANN401 - onnx has few types.
    """Return the nodes from ``features`` to ``name_sum`` and ``name_probability``."""
    link = "Identity" if trees.vote == "mean" else "Sigmoid"
    after = helper.make_node(link, [f"{name}_sum"], [f"{name}_probability"])
    return [*_ensemble(helper, trees, name), after]


def _ensemble(helper: Any, trees: Trees, name: str) -> list[Any]:  # noqa: ANN401 - onnx has few types.
    """Return the node from ``features`` to ``name_sum``."""
    columns = np.array([ALL_FEATURES.index(feature) for feature in trees.features])
    tree, number = _numbers(trees)
    inner = trees.feature >= 0
    leaf = np.flatnonzero(~inner)
    mean = trees.vote == "mean"
    # A float32 cut that is not above the exact one, as in ``Trees.laid_out``.
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
    return [ensemble]


def _numbers(trees: Trees) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the tree of each node, and its number within the tree."""
    nodes = np.arange(len(trees.feature))
    tree = np.searchsorted(trees.roots, nodes, side="right") - 1
    return tree, nodes - trees.roots[tree]
