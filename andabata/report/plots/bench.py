"""Figures of benchmarks, drawn without a screen."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter


def vehicle_figure(found: Mapping[str, Any]) -> Figure:
    """Return a picture of a body's turning and of its speeds on slopes.

    Args:
        found: Result of ``andabata.bench.vehicle.bench_vehicle``, and the ``robot``'s name.
    """
    figure = Figure(figsize=(12, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    for ground in dict.fromkeys(row["ground"] for row in found["turning"]):
        rows = [row for row in found["turning"] if row["ground"] == ground]
        left.plot([r["rate"] for r in rows], [r["ratio"] for r in rows], "o-", label=ground)
    left.axhspan(0.95, 1.05, color="#58a55c", alpha=0.15)
    left.set_xlabel("commanded yaw rate [rad/s]")
    left.set_ylabel("achieved over commanded")
    left.set_title(f"{found['robot']}: turning")
    left.legend()
    angles = [row["slope_deg"] for row in found["slopes"]]
    for key, name in (
        ("climb_m_s", "climbing"),
        ("slip_m_s", "slipping aside, straight"),
        ("slip_turning_m_s", "slipping aside, turning"),
    ):
        right.plot(angles, [row[key] for row in found["slopes"]], "o-", label=name)
    right.set_xlabel("slope [degrees]")
    right.set_ylabel("speed [m/s]")
    right.set_title("slopes")
    right.legend()
    return figure


def speed_figure(rows: Sequence[Mapping[str, Any]]) -> Figure:
    """Return a picture of speeds: a bar for each subject, on logarithmic scales.

    Args:
        rows: Rows of ``andabata.bench.speed.bench_speed``.
    """
    names = list(dict.fromkeys(row["name"] for row in rows))
    counts = [sum(row["name"] == name for row in rows) for name in names]
    figure = Figure(figsize=(9, 0.42 * len(rows) + 0.75 * len(names)), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(names), 1, height_ratios=[c + 0.6 for c in counts]))
    for panel, name in zip(axes, names, strict=True):
        group = [row for row in rows if row["name"] == name][::-1]
        values = [row["value"] for row in group]
        colours = ["tab:green" if "andabata" in row["subject"] else "tab:grey" for row in group]
        spread = [[v - row["low"] for v, row in zip(values, group, strict=True)]]
        spread.append([row["high"] - v for v, row in zip(values, group, strict=True)])
        panel.barh([row["subject"] for row in group], values, color=colours, xerr=spread)
        panel.set_xscale("log")
        panel.xaxis.set_minor_formatter(NullFormatter())
        panel.set_xlim(min(values) / 3, max(values) * 8)
        for k, row in enumerate(group):
            panel.text(row["high"] * 1.1, k, f"{row['value']:.3g}", va="center", fontsize=8)
        panel.set_title(f"{name} [{group[0]['unit']}]", fontsize=9, loc="left")
        panel.tick_params(labelsize=8)
    return figure
