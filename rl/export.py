"""A policy as ONNX, for runtimes without Python; needs the extra ``onnx``."""

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.policy import Policy


class ExportError(ValueError):
    """A policy that cannot be exported here."""


def policy_to_onnx(policy: Policy) -> bytes:
    """Return an ONNX model with the input ``state`` and the output ``steering``.

    ``state`` is float32 of shape (n, m) in SI units, as ``rl.spaces`` makes it; ``steering``
    is float32 of shape (n, 1) [rad/s], dead zone included. The model's metadata tells ranges and
    limits.

    Args:
        policy: What to export.

    Raises:
        ExportError: If onnx is not installed.
    """
    try:
        from onnx import TensorProto, checker, helper, numpy_helper
    except ImportError as error:
        message = "expected the package onnx, got none; install the extra `onnx`"
        raise ExportError(message) from error
    constants: list[Any] = []
    nodes: list[Any] = []

    def constant(name: str, value: NDArray[np.float32] | float) -> str:
        constants.append(numpy_helper.from_array(np.asarray(value, dtype=np.float32), name))
        return name

    def node(kind: str, inputs: list[str], output: str, **attributes: Any) -> str:  # noqa: ANN401 - as in onnx.
        nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    a, b, c, d = (
        constant(f"scale_{name}", row)
        for name, row in zip("abcd", policy.layout.scale(policy.limit), strict=True)
    )
    above = node("Add", [a, node("Mul", [b, "state"], "bent")], "above")
    below = node("Add", [c, node("Mul", [d, "state"], "spread")], "below")
    x = node("Div", [above, below], "scaled")
    last = len(policy.layers) - 1
    for number, (weights, biases) in enumerate(policy.layers):
        # Of the last layer only the mean: exploring is for learners.
        rows = slice(None) if number < last else slice(1)
        inputs = [
            x,
            constant(f"weights{number}", weights[rows]),
            constant(f"biases{number}", biases[rows]),
        ]
        x = node("Gemm", inputs, f"sum{number}", transB=1)
        if number < last:
            x = node("Relu", [x], f"hidden{number}")
    rate = node("Mul", [node("Tanh", [x], "share"), constant("limit", policy.limit)], "rate")
    wide = [node("Abs", [rate], "size"), constant("dead_zone", policy.dead_zone)]
    node("Where", [node("Less", wide, "dead"), constant("zero", 0.0), rate], "steering")
    values = {
        name: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])
        for name, width in (("state", policy.layout.size), ("steering", 1))
    }
    graph = helper.make_graph(nodes, "policy", [values["state"]], [values["steering"]], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    about = {"max_range": policy.max_range, "limit": policy.limit, "dead_zone": policy.dead_zone}
    helper.set_model_props(model, {"policy": json.dumps(about)})
    checker.check_model(model)
    return bytes(model.SerializeToString())
