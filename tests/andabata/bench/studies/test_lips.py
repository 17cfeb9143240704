"""Hazard cells: what looks flat, and the recall of those that do."""

import numpy as np
import pytest

from andabata.bench.studies.lips import looks_flat, recall_row


def plane(slope_deg, noise=0.0):
    rng = np.random.default_rng(0)
    xy = rng.uniform([4.5, -3.5], [5.5, -2.5], (200, 2))
    z = np.tan(np.deg2rad(slope_deg)) * xy @ [0.6, 0.8] + noise * rng.standard_normal(200)
    return np.column_stack([xy, z]).astype(np.float32)


@pytest.mark.parametrize(
    ("slope_deg", "noise", "flat"),
    [(0, 0.0, True), (19, 0.0, True), (21, 0.0, False), (5, 0.02, True), (5, 0.05, False)],
)
def test_flat_is_smooth_and_gently_sloped(slope_deg, noise, flat):
    """Limits are 20 degrees and 3 cm rms from the plane, wherever the cell lies."""
    assert looks_flat(plane(slope_deg, noise)) == flat


def test_recall_is_by_look():
    """Flat cells and others each have a recall of their own."""
    flags = np.array([[True, True], [True, False], [True, False], [False, True]])
    assert recall_row("down_step", flags) == {
        "hazard": "down step",
        "blocked cells": 4,
        "look flat": 3,
        "recall of these": pytest.approx(1 / 3),
        "of the others": 1.0,
    }


def test_no_cells_have_no_recall():
    """Without cells of a kind its recall is unknown."""
    row = recall_row("ditch", np.array([[True, True]]))
    assert row["recall of these"] == 1.0
    assert row["of the others"] is None
