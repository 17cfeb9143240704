"""The bench of the filter counts right, and runs on real drives."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.localization import Tracked, summarise_tracks


def honest(rng, steps=1000):
    """A filter whose errors are as large as it says: NEES of three numbers."""
    errors = rng.normal(0, [0.3, 0.3, 0.02], (steps, 3))
    nees = ((errors / [0.3, 0.3, 0.02]) ** 2).sum(axis=1)
    return Tracked(errors, nees, np.array([1.0, 1.0]), np.array([0.1]), ("goal", "collision"))


def test_figures_of_known_errors():
    rng = np.random.default_rng(0)
    figures = summarise_tracks([honest(rng) for _ in range(100)])
    assert figures["position_rms_m"] == pytest.approx(0.3 * np.sqrt(2), rel=0.02)
    assert figures["position_95_m"] == pytest.approx(0.3 * np.sqrt(-2 * np.log(0.05)), rel=0.02)
    assert figures["heading_rms_deg"] == pytest.approx(np.rad2deg(0.02), rel=0.02)
    assert figures["gnss_alone_rms_m"] == 1.0
    assert figures["goals"] == 100
    low, high = figures["nees_band"]
    assert low < 3.0 < high
    assert figures["nees_inside"] >= 0.8


def test_a_boastful_filter_falls_out_of_the_band():
    rng = np.random.default_rng(0)
    drives = [honest(rng) for _ in range(50)]
    boastful = [Tracked(d.errors, 3 * d.nees, d.fixes, d.headings, d.attempts) for d in drives]
    assert summarise_tracks(boastful)["nees_inside"] == 0.0


def test_the_filter_is_better_than_its_senses_on_a_real_drive(capsys):
    words = ["bench", "localization", "--world", "maze", "--drives", "2", "--rides", "0"]
    assert main([*words, "--workers", "1", "--set", "plant=kinematic", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)["localization"]
    assert figures["position_rms_m"] < figures["gnss_alone_rms_m"]
    assert figures["heading_rms_deg"] < min(1.0, figures["compass_alone_rms_deg"])
