"""Words and units of columns: known answers."""

import math

import pytest

from andabata.report.columns import (
    cell,
    counted,
    heading,
    interval,
    several,
    shown_keys,
    spoken,
    with_reached,
)

INTERVAL = {"success_rate": 5 / 6, "wilson_low": 0.702, "wilson_high": 0.918}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("restlessness", "restlessness of steering [rad²/s]"),
        ("trespass_share", "way on forbidden ground [%]"),
        ("timeouts", "out of time"),
        ("wilson_low", "success, lower bound"),
        ("some_new_key", "some new key"),
        ("length_m", "length [m]"),
        ("slip_m_s", "slip [m/s]"),
    ],
)
def test_headings_are_words_with_units(key, words):
    """A key without words of its own is spelled out, its unit told by its end."""
    assert heading(key) == words


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("trespass_share", 0.0154, "1.5"),
        ("energy_j", 12345.0, "12.3"),
        ("energy_j", 12345, "12.3"),
        ("trials", 24, "24"),
        ("outcome", "timeout", "out of time"),
        ("memory", "map", "sub-goal of a map"),
        ("policy", "map", "map"),
        ("validation", {"Maze2D": 0.25, "Maze3D": 1.0}, "Maze2D 0.25, Maze3D 1.00"),
        ("goals", [1, 2], "1, 2"),
        ("spl", None, "–"),
        ("spl", math.nan, "–"),
        ("readable", True, "yes"),
    ],
)
def test_values_are_told_in_their_unit(key, value, text):
    """Shares are per cent, names are words, what is missing is a dash."""
    assert cell(key, value) == text


def test_an_interval_stands_in_the_cell_of_its_figure():
    """Ends of other names are known; a difference is in points with its sign."""
    assert interval(INTERVAL, "success_rate") == "0.83 [0.70, 0.92]"
    score = {"score": 0.4, "score_low": 0.35, "score_high": 0.45}
    assert interval(score, "score") == "0.400 [0.350, 0.450]"
    gain = {"difference": 0.05, "difference_low": -0.01, "difference_high": 0.11}
    assert interval(gain, "difference") == "+5.0 [-1.0, +11.0]"
    none = {"score": 0.4, "score_low": None, "score_high": None}
    assert interval(none, "score") == "0.400"
    assert interval({"difference": None} | none, "difference") == "–"


def test_ends_of_intervals_are_no_columns():
    """They stand with their figure, unless it is not there."""
    assert shown_keys({"world": "hill"} | INTERVAL) == ["world", "success_rate"]
    assert shown_keys({"wilson_low": 0.5}) == ["wilson_low"]


def test_a_row_in_words_has_the_chosen_columns_that_it_holds():
    """Keys that the row lacks are left out."""
    row = {"world": "hill", "stuck": 2} | INTERVAL
    assert spoken(row) == {"world": "hill", "stuck": "2", "success": "0.83 [0.70, 0.92]"}
    assert spoken(row, ("success_rate", "spl")) == {"success": "0.83 [0.70, 0.92]"}


def test_counts_are_told_in_words():
    """Few are words, many are numbers; one is singular."""
    assert counted({"successes": 2, "trials": 3}) == "2 of 3"
    assert counted({"successes": 2, "runs": 3}, whole="runs") == "2 of 3"
    (row,) = with_reached([{"successes": 2, "runs": 3}], "runs")
    assert row == {"successes": 2, "runs": 3, "reached": "2 of 3"}
    assert with_reached([{"successes": 0, "trials": 4}])[0]["reached"] == "0 of 4"
    assert [several(n, "goal") for n in (1, 2, 12)] == ["One goal", "Two goals", "12 goals"]
