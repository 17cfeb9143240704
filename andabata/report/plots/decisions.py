"""Pictures of decisions: what a policy saw of the map, and its own and its teacher's prices."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from andabata.navigation.map_crops import (
    FAR_BEHIND,
    FAR_CELL,
    FAR_CHANNELS,
    NEAR_BEHIND,
    NEAR_CELL,
    NEAR_CHANNELS,
)
from andabata.navigation.map_observation import place_of
from andabata.report.class_colours import BLOCKED_COLOUR, FREE_COLOUR, UNKNOWN_COLOUR
from rl.spaces import ObservationSpec

_ARC_TIME = 2.0
"""Time for which the arc of an action is drawn, longer than it is held [s]."""

_COLOURS = "viridis_r"


class Decision(NamedTuple):
    """A decision with the prices of all actions beyond the best one.

    Attributes:
        observation: Observation of the policy, float32, shape (n_observations,).
        given: Prices of the policy [s], shape (a,).
        wanted: Prices of the teacher [s], shape (a,).
    """

    observation: NDArray[np.float32]
    given: NDArray[np.float32]
    wanted: NDArray[np.float32]


def decisions_figure(
    decisions: Sequence[Decision],
    spec: ObservationSpec,
    table: NDArray[np.float64],
    most: float,
) -> Figure:
    """Return a row for each decision: far crop, and near crop with each one's prices of actions.

    Args:
        decisions: Decisions, one or more.
        spec: Layout of their observations, as ``map_observations`` gives it.
        table: Speed [m/s] and yaw rate [rad/s] of each action, shape (a, 2).
        most: Price of the darkest colour [s].
    """
    figure = Figure(figsize=(12, 4.0 * len(decisions) + 0.8), layout="constrained")
    rows = figure.subplots(len(decisions), 3, squeeze=False)
    scale = ScalarMappable(Normalize(0.0, most), _COLOURS)
    for decision, (far, given, wanted) in zip(decisions, rows, strict=True):
        shown = decision.observation
        _draw_crop(far, _crop(shown, spec, "map_far"), FAR_CHANNELS, FAR_CELL, FAR_BEHIND)
        _draw_places(far, shown, spec)
        far.set_title("far crop, goal (cross) and sub-goal (ring)")
        near = _crop(shown, spec, "map_near")
        chosen = int(np.argmin(decision.given))
        cost = float(decision.wanted[chosen] - decision.wanted.min())
        for axes, prices, whose in (
            (given, decision.given, f"policy; costs {cost:.1f} s by the teacher"),
            (wanted, decision.wanted, "teacher"),
        ):
            _draw_crop(axes, near, NEAR_CHANNELS, NEAR_CELL, NEAR_BEHIND)
            _draw_actions(axes, prices - prices.min(), table, scale)
            axes.set_title(whose)
    label = "price beyond the best action's [s]"
    bar: dict[str, Any] = {"location": "bottom", "aspect": 50, "shrink": 0.7}
    figure.colorbar(scale, ax=rows.ravel().tolist(), label=label, **bar)
    return figure


def _crop(
    observation: NDArray[np.float32], spec: ObservationSpec, name: str
) -> NDArray[np.float32]:
    """Return a crop of an observation, shape (channels, rows, columns)."""
    return observation[spec.slice_of(name)].reshape(spec.term(name).shape)


def _draw_crop(
    axes: Axes, crop: NDArray[np.float32], channels: Sequence[str], cell: float, behind: float
) -> None:
    """Draw what is blocked, free and unknown; ahead is up, left is left."""
    blocked, free, unknown = (crop[channels.index(c)] for c in ("blocked", "free", "unknown"))
    shares = np.stack([blocked, free * (1.0 - blocked), unknown], axis=-1)
    rest = np.clip(1.0 - shares.sum(axis=-1, keepdims=True), 0.0, 1.0)
    colours = np.array([_rgb(c) for c in (BLOCKED_COLOUR, FREE_COLOUR, UNKNOWN_COLOUR)])
    image = shares @ colours + rest
    half, size = len(crop[0]) * cell / 2.0, len(crop[0]) * cell
    # Rows go ahead and columns to the left, where the axis of y has its larger numbers.
    axes.imshow(
        np.clip(image[:, ::-1], 0.0, 1.0),
        origin="lower",
        extent=(half, -half, -behind, size - behind),
        alpha=0.8,
    )
    axes.set_xlim(half, -half)
    axes.set_xlabel("left [m]")
    axes.set_ylabel("ahead [m]")


def _rgb(colour: str) -> NDArray[np.float64]:
    """Return red, green and blue from 0 to 1 of ``#rrggbb``."""
    return np.array([int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)])


def _draw_places(axes: Axes, observation: NDArray[np.float32], spec: ObservationSpec) -> None:
    """Draw goal and sub-goal, at the edge where they are beyond it."""
    low, high = sorted(axes.get_xlim())
    names = [term.name for term in spec.terms]
    for name, marker in (("goal", "x"), ("subgoal", "o")):
        if name not in names:
            continue
        ahead, left = place_of(observation[spec.slice_of(name)])
        bottom, top = axes.get_ylim()
        place = np.clip(left, low + 0.3, high - 0.3), np.clip(ahead, bottom + 0.3, top - 0.3)
        axes.plot(*place, marker, color="black", markerfacecolor="none", markersize=9)


def _draw_actions(
    axes: Axes, prices: NDArray[np.float32], table: NDArray[np.float64], scale: ScalarMappable
) -> None:
    """Draw the arc of each action in the colour of its price, the cheapest one thick."""
    best, colours = int(np.argmin(prices)), scale.to_rgba(prices)
    times = np.linspace(0.0, _ARC_TIME, 20)
    # The dear ones first: the cheap ones are to be seen.
    for number in np.argsort(-prices):
        speed, rate = table[number].tolist()
        colour = colours[number]
        if speed == 0.0:
            axes.plot(np.sign(rate) * 0.6, 0.0, "s", color=colour, markersize=5)
            if number == best:
                side: dict[str, Any] = {"color": "black", "markersize": 9, "fillstyle": "none"}
                axes.plot(np.sign(rate) * 0.6, 0.0, "s", **side)
            continue
        headings = rate * times
        step = speed * np.diff(times, prepend=0.0)
        ahead, left = np.cumsum(step * np.cos(headings)), np.cumsum(step * np.sin(headings))
        axes.plot(left, ahead, color=colour, linewidth=4.0 if number == best else 1.5)
    axes.plot(0.0, 0.0, "^", color="black", markersize=6)
