"""Table of an evaluation off-road: goals in a row, and causes of failures."""

import pytest

from andabata.evaluation.offroad_table import failure_causes, success_text, summarise
from tests.support.offroad_attempts import attempt

CONTROLLERS = ("straight",)
ROWS = [
    attempt(0, 1, "goal"),
    attempt(0, 2, "goal"),
    attempt(0, 3, "goal"),
    attempt(1, 1, "goal"),
    attempt(1, 2, "collision", spl=0.0),
    attempt(2, 1, "tipover", spl=0.0),
    attempt(3, 1, "goal"),
    attempt(3, 2, "goal"),
    attempt(3, 3, "timeout", spl=0.0),
]


def test_energy_is_the_mean_of_the_attempts_with_motors():
    """The energy is the mean over attempts with motors, and None without any."""
    rows = [attempt(0, 1, "goal", energy_j=30.0), attempt(1, 1, "goal", energy_j=50.0)]
    assert summarise(rows, CONTROLLERS)[0]["energy_j"] == 40.0
    rows = [attempt(0, 1, "goal", energy_j=None)]
    assert summarise(rows, CONTROLLERS)[0]["energy_j"] is None


def test_collisions_with_walkers_are_told_apart():
    """They are collisions all the same; rows of earlier versions know no contacts."""
    labels = ("obstacle", "mover", "mover", "mover", "hit", "hit_at_rest", "hit_at_rest")
    rows = [attempt(k, 1, "collision", spl=0.0, contact=label) for k, label in enumerate(labels)]
    row = summarise([*rows, attempt(7, 1, "collision", spl=0.0)], CONTROLLERS)[0]
    assert row["collisions"] == 8
    assert (row["hit_mover"], row["hit_by_mover"], row["hit_at_rest"]) == (3, 1, 2)


def test_goals_in_a_row_count_every_trial():
    """A goal counts as tried in every trial, also where an earlier goal failed."""
    table = {row["goal"]: row for row in summarise(ROWS, CONTROLLERS)}
    assert [table[goal]["successes"] for goal in (1, 2, 3, "all")] == [3, 2, 1, 1]
    assert [table[goal]["success_rate"] for goal in (1, 2, 3, "all")] == [0.75, 0.5, 0.25, 0.25]
    assert (table[2]["collisions"], table[1]["tipovers"], table[3]["timeouts"]) == (1, 1, 1)
    assert table["all"]["collisions"] == table["all"]["tipovers"] == table["all"]["timeouts"] == 1
    assert table[1]["spl"] == pytest.approx(0.5 * 3 / 4)
    assert table["all"]["spl"] == pytest.approx(0.5 * 6 / 12)


def test_wilson_interval_holds_the_rate():
    """The interval contains the rate, within 0 and 1."""
    for row in summarise(ROWS, CONTROLLERS):
        assert 0 <= row["wilson_low"] < row["success_rate"] < row["wilson_high"] <= 1


def test_each_kind_of_world_has_rows_of_its_own():
    """The table has rows for each world, each with its own rate."""
    rows = [
        attempt(0, 1, "goal", goals=1),
        attempt(1, 1, "goal", world="hollow", goals=1),
        attempt(2, 1, "stuck", goals=1),
    ]
    table = {
        (row["world"], row["goal"]): row["success_rate"] for row in summarise(rows, CONTROLLERS)
    }
    assert table == {("maze", 1): 0.5, ("maze", "all"): 0.5, ("hollow", 1): 1, ("hollow", "all"): 1}


def test_failures_are_counted_by_cause():
    """Failures are counted by world, outcome and cause, the most frequent first; goals are not."""
    rows = [attempt(k, 1, "collision", cause="low rock") for k in range(3)]
    rows += [attempt(3, 1, "tipover", cause="slope"), attempt(4, 1, "goal")]
    found = [(row["cause"], row["outcome"], row["count"]) for row in failure_causes(rows)]
    assert found == [("low rock", "collision", 3), ("slope", "tipover", 1)]


def test_the_table_adds_up_what_was_driven():
    """Times, distances and forbidden distances are means of attempts, the share of sums."""
    rows = [
        attempt(0, 1, "goal", time_s=10.0, distance_m=4.0, trespass_m=1.0),
        attempt(1, 1, "stuck", time_s=20.0, distance_m=1.0, trespass_m=0.5),
    ]
    one = {row["goal"]: row for row in summarise(rows, CONTROLLERS)}[1]
    assert (one["mean_time_s"], one["distance_m"], one["trespass_m"]) == (15.0, 2.5, 0.75)
    assert one["trespass_share"] == pytest.approx(1.5 / 5.0)
    assert (one["stuck"], one["successes"], one["trials"]) == (1, 1, 2)


def strictly(number, goal, outcome="goal", forbidden=0.0, distance=None):
    """Return an attempt with a strict verdict."""
    return attempt(number, goal, outcome, outline_forbidden_s=forbidden, solid_distance_m=distance)


def test_strict_successes_are_goals_in_a_row_with_a_clean_outline():
    """An outline that was not clean counts for this goal and those after it."""
    rows = [
        *(strictly(0, 1), strictly(0, 2), strictly(0, 3)),
        *(strictly(1, 1), strictly(1, 2, forbidden=0.6), strictly(1, 3)),
        *(strictly(2, 1, distance=0.04), strictly(2, 2), strictly(2, 3)),
        strictly(3, 1, "timeout"),
    ]
    found = {row["goal"]: row for row in summarise(rows, CONTROLLERS)}
    assert [found[goal]["successes"] for goal in (1, 2, 3, "all")] == [3, 3, 3, 3]
    assert [found[goal]["strict_successes"] for goal in (1, 2, 3, "all")] == [2, 1, 1, 1]
    # One attempt of an earlier version: nothing is known of the strict verdict.
    old = summarise([*rows, attempt(4, 1, "goal")], CONTROLLERS)
    assert {row["strict_successes"] for row in old} == {None}


def test_false_arrivals_and_robots_that_left_have_columns():
    """They are counted by outcome; errors are means over the attempts that have them."""
    rows = [
        attempt(0, 1, "false arrival", arrival_error_m=3.0, position_error_m=2.5),
        attempt(1, 1, "left world", position_error_m=0.5, overridden_share=0.1),
        attempt(2, 1, "goal", arrival_error_m=1.0, position_error_m=0.3),
    ]
    row = summarise(rows, CONTROLLERS)[0]
    assert (row["false_arrivals"], row["left_world"], row["successes"]) == (1, 1, 1)
    assert row["arrival_error_m"] == pytest.approx(2.0)
    assert row["position_error_m"] == pytest.approx(1.1)
    assert row["overridden_share"] == pytest.approx(0.1)


def test_what_counts_as_success_is_said_in_words():
    """Radius and tolerance, both with their units."""
    text = success_text({"radius_m": 1.0, "tolerance_m": 0.354})
    assert "within 1.0 m + 0.35 m" in text
