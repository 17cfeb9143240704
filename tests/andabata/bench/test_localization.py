"""Statistics of the filter: known errors give known numbers, and drives run."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.localization import (
    Tracked,
    localization_rows,
    localization_table,
    summarise_tracks,
)


def consistent(rng, steps=1000):
    """Return a drive whose errors have the covariance of the filter: NEES of three numbers."""
    errors = rng.normal(0, [0.3, 0.3, 0.02], (steps, 3))
    nees = ((errors / [0.3, 0.3, 0.02]) ** 2).sum(axis=1)
    return Tracked(errors, nees, np.array([1.0, 1.0]), np.array([0.1]), ("goal", "collision"))


def test_statistics_of_known_errors():
    """RMS, quantile and band of errors drawn from a known distribution."""
    rng = np.random.default_rng(0)
    figures = summarise_tracks([consistent(rng) for _ in range(100)])
    assert figures["position_rms_m"] == pytest.approx(0.3 * np.sqrt(2), rel=0.02)
    assert figures["position_95_m"] == pytest.approx(0.3 * np.sqrt(-2 * np.log(0.05)), rel=0.02)
    assert figures["heading_rms_deg"] == pytest.approx(np.rad2deg(0.02), rel=0.02)
    assert figures["gnss_alone_rms_m"] == 1.0
    assert figures["goals"] == 100
    low, high = figures["nees_band"]
    assert low < 3.0 < high
    assert figures["nees_inside"] >= 0.8


def test_an_overconfident_filter_is_outside_the_band():
    """Errors three times too large for the covariance are never inside."""
    rng = np.random.default_rng(0)
    drives = [consistent(rng) for _ in range(50)]
    overconfident = [Tracked(d.errors, 3 * d.nees, d.fixes, d.headings, d.attempts) for d in drives]
    assert summarise_tracks(overconfident)["nees_inside"] == 0.0


def test_the_filter_is_better_than_single_sensors_on_a_drive(capsys):
    """The verb's JSON, from two drives in mazes."""
    words = ["bench", "localization", "--world", "maze", "--drives", "2", "--rides", "0"]
    assert main([*words, "--workers", "1", "--set", "plant=kinematic", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out)["localization"]
    assert figures["position_rms_m"] < figures["gnss_alone_rms_m"]
    # The start is off by 3 degrees, and the filter admits a compass that is off by as much.
    assert figures["heading_rms_deg"] < 0.6 * figures["compass_alone_rms_deg"]


def test_a_level_of_reality_bends_the_compass(capsys):
    """``--reality`` is that of the drives, and ``--set`` changes one of its numbers."""
    words = ["bench", "localization", "--world", "maze", "--drives", "1", "--rides", "0", "--json"]
    words += ["--workers", "1", "--set", "plant=kinematic"]
    found = []
    for more in (["--reality", "ideal"], ["--reality", "harsh", "--set", "reality.latency=0"]):
        assert main([*words, *more]) == 0
        found.append(json.loads(capsys.readouterr().out))
    ideal, harsh = found
    assert (ideal["reality"], harsh["reality"]) == ("ideal", "custom")
    errors = [one["localization"]["compass_alone_rms_deg"] for one in found]
    assert errors[1] != pytest.approx(errors[0], rel=0.2)  # One bends the other back, by chance.


def test_rows_have_the_unit_that_ends_their_name():
    """Single sensors are subjects of their own."""
    rows = localization_rows(summarise_tracks([consistent(np.random.default_rng(0))]))
    found = {row["name"]: row for row in rows}
    assert found["position_rms_m"]["unit"] == "m"
    assert found["heading_rms_deg"]["unit"] == "deg"
    assert found["nees_mean"]["unit"] == "1"
    assert found["gnss_alone_rms_m"]["subject"] == "gnss"
    assert found["position_rms_m"]["subject"] == "andabata"
    assert "goals" not in found


def test_the_table_has_no_nees_of_drives_that_are_too_short():
    """Ten seconds are needed for one instant."""
    rng = np.random.default_rng(0)
    long, short = (summarise_tracks([consistent(rng, steps)]) for steps in (100, 99))
    assert [row["quantity"] for row in localization_table(long)][-1] == "NEES, mean"
    assert [row["quantity"] for row in localization_table(short)] == ["position", "heading"]
