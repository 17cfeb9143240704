"""The verb compares the chosen cases and shows them with their spread."""

import json

import pytest

from andabata.app.cli import main
from andabata.bench.speed import speed_table


@pytest.mark.parametrize("only", ["filter of 18 numbers", "maze in 2D"])
def test_the_verb_prints_rows_and_draws_them(capsys, tmp_path, only):
    """Only the chosen case runs; ours has the ratio one."""
    picture = tmp_path / "speed.png"
    words = ["--only", only, "--runs", "1", "--seconds", "0", "--out", str(picture)]
    assert main(["bench", *words, "--json", "--quiet"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["name"] for row in rows} == {rows[0]["name"]}
    assert all(only in row["name"] for row in rows)
    assert rows[0]["subject"].startswith("andabata")
    assert rows[0]["ratio_to_ours"] == 1.0
    assert all(row["value"] > 0 for row in rows)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_an_unknown_case_is_an_error_that_lists_the_known_ones(capsys):
    """Nothing is timed."""
    assert main(["bench", "--only", "flying", "--runs", "1", "--quiet"]) == 1
    assert "only: expected part of one of laser, maze in 2D" in capsys.readouterr().err


def test_the_table_shows_speeds_with_their_unit():
    """Each row has its spread."""
    row = {"name": "work", "subject": "ours", "value": 20.0, "unit": "units/s", "runs": 3}
    (shown,) = speed_table([row | {"ratio_to_ours": 0.25, "low": 19.0, "high": 21.0}])
    assert shown == {
        "work": "work",
        "subject": "ours",
        "speed": "20 units/s",
        "ratio to ours": "0.25",
        "least to most": "19 to 21",
    }
