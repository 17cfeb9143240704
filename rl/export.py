"""A policy as ONNX, for runtimes without Python; needs the extra ``onnx``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.mlp import MlpPolicy
from rl.policy import Policy


class ExportError(ValueError):
    """A policy that cannot be exported here."""


def policy_to_onnx(policy: Policy) -> bytes:
    """Return an ONNX model with the input ``observation`` and the output ``action``.

    ``observation`` is float32 of shape (n, n_observations) in SI units, ``action`` float32 of shape
    (n, n_actions) in SI units, before limits and dead zone of the robot. The model's metadata holds
    both spaces.

    Args:
        policy: A multilayer perceptron.

    Raises:
        ExportError: If onnx is not installed, or the policy is of another architecture.
    """
    if not isinstance(policy, MlpPolicy):
        raise ExportError(f"expected a multilayer perceptron, got a policy {policy.architecture!r}")
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

    observations, actions = policy.observations, policy.actions
    a, b, c, d = (
        constant(f"scale_{name}", row)
        for name, row in zip("abcd", observations.scale(), strict=True)
    )
    above = node("Add", [a, node("Mul", [b, "observation"], "bent")], "above")
    below = node("Add", [c, node("Mul", [d, "observation"], "spread")], "below")
    x = node("Div", [above, below], "scaled")
    last = len(policy.weights) // 2 - 1
    for number in range(last + 1):
        # Of the last layer only the means: the spread is for exploration.
        rows = slice(None) if number < last else slice(actions.size)
        weight = constant(f"weights{number}", policy.weights[f"layer{number}.weight"][rows])
        bias = constant(f"biases{number}", policy.weights[f"layer{number}.bias"][rows])
        x = node("Gemm", [x, weight, bias], f"sum{number}", transB=1)
        if number < last:
            x = node("Relu", [x], f"hidden{number}")
    low, high = np.array(actions.low), np.array(actions.high)
    half, middle = constant("half", (high - low) / 2), constant("middle", (low + high) / 2)
    node("Add", [middle, node("Mul", [node("Tanh", [x], "share"), half], "moved")], "action")
    values = {
        name: helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", width])
        for name, width in (("observation", observations.size), ("action", actions.size))
    }
    graph = helper.make_graph(
        nodes, "policy", [values["observation"]], [values["action"]], constants
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    about = {
        "observations": observations.model_dump_json(),
        "actions": actions.model_dump_json(),
    }
    helper.set_model_props(model, about)
    checker.check_model(model)
    return bytes(model.SerializeToString())
