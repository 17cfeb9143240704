"""Layout for Foxglove that shows our recordings: a 3D scene, plots, the robot's health and why.

The names of the topics are those of ``topics``, so that the layout opens what the recorder writes.
"""

from collections.abc import Mapping
from typing import Any

from andabata.records import topics
from andabata.records.messages import NAME
from andabata.records.topics import Ros, Topic

SCENE, STEERING, HEADING, SPEED, HEALTH, ESTIMATE = (
    "3D!scene",
    "Plot!steering",
    "Plot!heading",
    "Plot!speed",
    "DiagnosticSummary!health",
    "DiagnosticStatusPanel!estimate",
)
"""Panels by Foxglove's type and our name."""

_IN_SCENE: Mapping[Topic, Mapping[str, Any]] = {
    topics.RELATIVE_CLOUD: {
        "colorField": "z",
        "colorMode": "colormap",
        "colorMap": "turbo",
        "minValue": -0.5,
        "maxValue": 1.5,
        "pointSize": 2,
    },
    topics.CLOUD: {"visible": False, "colorMode": "flat", "flatColor": "#8899aa", "pointSize": 2},
    topics.VIRTUAL_SCAN: {"colorMode": "flat", "flatColor": "#ff3b30", "pointSize": 8},
    topics.LOCAL_MAP: {"colorMode": "map", "frameLocked": True},
    topics.PLAN: {"type": "line", "lineWidth": 0.08, "gradient": ["#0a84ff", "#5ac8fa"]},
    topics.SUBGOAL: {"type": "arrow", "color": "#0a84ff"},
    topics.GOAL: {"type": "axis", "axisScale": 1.5},
    topics.ESTIMATED_POSE: {
        "type": "arrow",
        "color": "#0078ff",
        "showCovariance": True,
        "covarianceColor": "#0078ff55",
    },
    topics.INITIAL_POSE: {"type": "axis", "axisScale": 1.0},
}
"""Settings of the scene's topics; all but one are visible."""

_PLOTS: Mapping[str, tuple[str, tuple[tuple[Topic, str, str], ...]]] = {
    STEERING: (
        "Steering [rad/s]",
        (
            (topics.TWIST, "angular.z", "commanded"),
            (topics.GROUND_TRUTH, "twist.twist.angular.z", "true (simulation)"),
        ),
    ),
    HEADING: ("Heading error [rad]", ((topics.HEADING_ERROR, "data", "to the sub-goal"),)),
    SPEED: (
        "Speed [m/s]",
        (
            (topics.TWIST, "linear.x", "commanded"),
            (topics.GROUND_TRUTH, "twist.twist.linear.x", "true (simulation)"),
        ),
    ),
}
"""Title and curves of each plot: topic, field and label."""

_COLOURS = ("#4e79a7", "#f28e2c")


def foxglove_layout(ros: Ros = 2) -> dict[str, Any]:
    """Return the layout, ready for JSON.

    Args:
        ros: Version of ROS of the recordings: MCAP files are ROS 2's, ``.bag`` files ROS 1's.
    """
    plots = {name: _plot(ros, *about) for name, about in _PLOTS.items()}
    diagnostics = {"topicToRender": topics.DIAGNOSTICS.name(ros)}
    health = {**diagnostics, "minLevel": 0, "pinnedIds": []}
    estimate = {**diagnostics, "selectedHardwareId": "", "selectedName": NAME}
    return {
        "configById": {SCENE: _scene(ros), **plots, HEALTH: health, ESTIMATE: estimate},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {
            "direction": "row",
            "first": SCENE,
            "second": _stack([*plots, HEALTH, ESTIMATE]),
            "splitPercentage": 66,
        },
    }


def _scene(ros: Ros) -> dict[str, Any]:
    """Return the 3D panel: it follows the robot's position, and shows the frames."""
    return {
        "cameraState": {
            "distance": 18,
            "perspective": True,
            "phi": 55,
            "thetaOffset": 45,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.5,
            "far": 5000,
        },
        "followMode": "follow-position",
        "followTf": "base_footprint",
        "scene": {"transforms": {"showLabel": True, "axisScale": 1}},
        "transforms": {
            f"frame:{name}": {"visible": True} for name in ("map", "odom", "base_footprint")
        },
        "topics": {
            topic.name(ros): {"visible": True, **settings} for topic, settings in _IN_SCENE.items()
        },
        "layers": {},
    }


def _plot(ros: Ros, title: str, curves: tuple[tuple[Topic, str, str], ...]) -> dict[str, Any]:
    """Return a plot over time."""
    paths = [
        {
            "value": f"{topic.name(ros)}.{field}",
            "label": label,
            "color": colour,
            "enabled": True,
            "timestampMethod": "receiveTime",
        }
        for (topic, field, label), colour in zip(curves, _COLOURS, strict=False)
    ]
    return {
        "title": title,
        "paths": paths,
        "xAxisVal": "timestamp",
        "isSynced": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showXAxisLabels": True,
        "showYAxisLabels": True,
    }


def _stack(panels: list[str]) -> str | dict[str, Any]:
    """Return panels of one height, one above the other."""
    if len(panels) == 1:
        return panels[0]
    share = 100 / len(panels)
    rest = _stack(panels[1:])
    return {"direction": "column", "first": panels[0], "second": rest, "splitPercentage": share}
