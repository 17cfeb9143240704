"""A policy as ONNX, for runtimes without Python; needs the extra ``onnx``."""

from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rl.driving import driving_noise, driving_repeat
from rl.policies.mlp import PerceptronPolicy
from rl.policies.point_features import MASK, POINTS, SLOPE
from rl.policies.point_set import PointSetPolicy, goal_terms
from rl.policy import Policy
from rl.spaces import ActionSpec, ObservationSpec


class PolicyExportError(ValueError):
    """A policy that cannot be exported here."""


def policy_to_onnx(policy: Policy) -> bytes:
    """Return an ONNX model of a policy; its metadata holds both spaces.

    Noise that the policy drives with is not in the model: ``driving_noise`` in the metadata says
    how much of it a runtime has to add, and ``driving_repeat`` for how many control steps it has to
    hold an action, see ``rl.driving``.

    The output ``action`` is float32, shape (n, n_actions), in SI units, before limits and dead zone
    of the robot.

    A perceptron has the input ``observation``, float32, shape (n, n_observations), in SI units. A
    policy on points takes any number m of them, and has the inputs ``points`` [1/m], shape
    (n, m, 2), ``mask``, shape (n, m), 1 for each point that counts, and ``goal``, shape (n, G), the
    terms of goal and velocities side by side in SI units.

    Args:
        policy: A multilayer perceptron, or a policy on a set of points.

    Raises:
        PolicyExportError: If onnx is not installed, or the policy is of another architecture.
    """
    if not isinstance(policy, (PerceptronPolicy, PointSetPolicy)):
        raise PolicyExportError(
            "expected a multilayer perceptron or a policy on points, got a policy "
            f"{policy.architecture!r}"
        )
    try:
        import onnx
    except ImportError as error:
        message = "expected the package onnx, got none; install the extra `onnx`"
        raise PolicyExportError(message) from error
    graph = _Graph(onnx)
    if isinstance(policy, PointSetPolicy):
        return _point_set_model(graph, policy)
    return _perceptron_model(graph, policy)


class _Graph:
    """An ONNX graph as it grows."""

    def __init__(self, onnx: ModuleType) -> None:
        """Begin empty."""
        self._onnx = onnx
        self._constants: list[Any] = []
        self._nodes: list[Any] = []

    def constant(self, name: str, value: ArrayLike, kind: Any = np.float32) -> str:  # noqa: ANN401 - a dtype.
        """Add a constant and return its name."""
        array = np.asarray(value, dtype=kind)
        self._constants.append(self._onnx.numpy_helper.from_array(array, name))
        return name

    def node(self, kind: str, inputs: list[str], output: str, **attributes: Any) -> str:  # noqa: ANN401 - as in onnx.
        """Add an operation and return the name of its output."""
        self._nodes.append(self._onnx.helper.make_node(kind, inputs, [output], **attributes))
        return output

    def scaled(self, x: str, observations: ObservationSpec) -> str:
        """Add the scaling of observations; see ``ObservationSpec.scale``."""
        a, b, c, d = (
            self.constant(f"scale_{name}", row)
            for name, row in zip("abcd", observations.scale(), strict=True)
        )
        above = self.node("Add", [a, self.node("Mul", [b, x], "bent")], "above")
        below = self.node("Add", [c, self.node("Mul", [d, x], "spread")], "below")
        return self.node("Div", [above, below], "scaled")

    def actions(self, x: str, weights: dict[str, NDArray[np.float32]], actions: ActionSpec) -> None:
        """Add the layers ``layer<k>`` and the actions in SI units, the output ``action``."""
        last = sum(name.startswith("layer") for name in weights) // 2 - 1
        for number in range(last + 1):
            # Of the last layer only the means: the spread is for exploration.
            rows = slice(None) if number < last else slice(actions.size)
            weight = self.constant(f"weights{number}", weights[f"layer{number}.weight"][rows])
            bias = self.constant(f"biases{number}", weights[f"layer{number}.bias"][rows])
            x = self.node("Gemm", [x, weight, bias], f"sum{number}", transB=1)
            if number < last:
                x = self.node("Relu", [x], f"hidden{number}")
        low, high = np.array(actions.low), np.array(actions.high)
        half = self.constant("half", (high - low) / 2)
        middle = self.constant("middle", (low + high) / 2)
        share = self.node("Tanh", [x], "share")
        self.node("Add", [middle, self.node("Mul", [share, half], "moved")], "action")

    def model(self, policy: Policy, inputs: dict[str, list[str | int]], opset: int) -> bytes:
        """Return the model with these inputs, their shapes, and the output ``action``."""
        helper, kind = self._onnx.helper, self._onnx.TensorProto.FLOAT
        values = [
            helper.make_tensor_value_info(name, kind, shape) for name, shape in inputs.items()
        ]
        action = helper.make_tensor_value_info("action", kind, ["n", policy.actions.size])
        graph = helper.make_graph(self._nodes, "policy", values, [action], self._constants)
        sets = [helper.make_opsetid("", opset)]
        model = helper.make_model(graph, opset_imports=sets, ir_version=8)
        about = {
            "observations": policy.observations.model_dump_json(),
            "actions": policy.actions.model_dump_json(),
        }
        if noise := driving_noise(policy):
            about["driving_noise"] = str(noise)
        if (repeat := driving_repeat(policy)) > 1:
            about["driving_repeat"] = str(repeat)
        helper.set_model_props(model, about)
        self._onnx.checker.check_model(model)
        return bytes(model.SerializeToString())


def _perceptron_model(graph: _Graph, policy: PerceptronPolicy) -> bytes:
    """Return the model of a multilayer perceptron."""
    x, read = "observation", policy.observations
    if policy.terms is not None:
        columns = graph.constant("columns", read.columns(policy.terms), np.int64)
        x = graph.node("Gather", [x, columns], "read", axis=1)
        read = read.only(policy.terms)
    graph.actions(graph.scaled(x, read), policy.weights, policy.actions)
    return graph.model(policy, {"observation": ["n", policy.observations.size]}, 17)


def _point_set_model(graph: _Graph, policy: PointSetPolicy) -> bytes:
    """Return the model of a policy on a set of points (Eq. 1 of SPN, and the layers on top)."""
    read = policy.observations.only(goal_terms(policy.terms))
    goal = graph.scaled("goal", read)
    features = _features(graph, policy.weights, goal)
    top = graph.node("Concat", [features, goal], "top", axis=1)
    graph.actions(top, policy.weights, policy.actions)
    shapes: dict[str, list[str | int]] = {
        POINTS: ["n", "m", 2],
        MASK: ["n", "m"],
        "goal": ["n", read.size],
    }
    return graph.model(policy, shapes, 18)


def _features(graph: _Graph, weights: dict[str, NDArray[np.float32]], goal: str) -> str:
    """Add the maximum of each feature over all points, shape (n, K)."""
    constant, node = graph.constant, graph.node

    def matrix(name: str) -> str:
        return constant(f"{name}_weight", weights[f"{name}.weight"].T)

    def bias(name: str) -> str:
        return constant(f"{name}_bias", weights[f"{name}.bias"])

    points_axis, features_axis = (constant(f"axis{k}", [k], np.int64) for k in (1, 2))
    before = node("Add", [node("MatMul", [goal, matrix("gate")], "gate_sum"), bias("gate")], "g")
    gate = node("Unsqueeze", [node("Sigmoid", [before], "gate"), points_axis], "gates")
    # Where no point counts the features are those of a point infinitely far away, (0, 0). It is
    # one more among the others, and its mask is the opposite of their greatest.
    seen = node("ReduceMax", [MASK, points_axis], "seen")
    none = node("Sub", [constant("one", 1.0), seen], "none")
    mask = node("Concat", [MASK, none], "whole_mask", axis=1)
    border = constant("border", [0, 0, 0, 0, 1, 0], np.int64)
    points = node("Pad", [POINTS, border], "whole_points")
    hidden = node("Add", [node("MatMul", [points, matrix("point")], "h"), bias("point")], "hidden")
    hidden = node("Mul", [node("LeakyRelu", [hidden], "rectified", alpha=SLOPE), gate], "gated")
    all_ = node("Add", [node("MatMul", [hidden, matrix("feature")], "f"), bias("feature")], "all")
    counts = node("Greater", [mask, constant("half_mask", 0.5)], "counts")
    counts = node("Unsqueeze", [counts, features_axis], "counts_once")
    counted = node("Where", [counts, all_, constant("least", -np.inf)], "counted")
    return node("ReduceMax", [counted, points_axis], "features", keepdims=0)
