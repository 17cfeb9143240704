"""Controllers in pairs: counts, intervals over worlds, and times of what both have finished."""

import numpy as np
import pytest

from andabata.evaluation.offroad_pairs import controller_differences, has_all
from andabata.evaluation.statistics import mcnemar, paired_bootstrap, paired_difference
from tests.support.offroad_attempts import attempt, trial

REACHED = {"a": (3, 3, 0, 3, 1), "b": (3, 2, 2, 3, 3), "a@lag=0.2": (0, 0, 0, 0, 0)}
"""Goals reached in each of five trials, by what drives."""

DRIVEN = [
    each
    for number in range(5)
    for name, goals in REACHED.items()
    for each in trial(number, name, goals[number])
]


def test_only_the_last_goal_of_a_trial_makes_it_a_success():
    """A goal before it is none, nor is an attempt at it that failed."""
    assert has_all(attempt(0, 3, "goal"))
    assert not has_all(attempt(0, 2, "goal"))
    assert not has_all(attempt(0, 3, "stuck"))


def test_each_controller_is_compared_with_the_first_in_the_same_trials():
    """Counts, McNemar and intervals are those of the statistics on whole trials."""
    (row,) = controller_differences(DRIVEN, ("a", "b"))
    assert (row["controller"], row["against"], row["trials"]) == ("b", "a", 5)
    assert (row["successes_against"], row["successes"]) == (3, 3)
    first, second = (np.array([[goals == 3 for goals in REACHED[name]]]) for name in ("a", "b"))
    share = paired_difference(first, second)
    assert (row["difference"], row["difference_low"], row["difference_high"]) == share
    test = mcnemar(first, second)
    assert (row["mcnemar_gained"], row["mcnemar_lost"], row["mcnemar_p"]) == test


def test_spl_is_that_of_whole_trials_with_worlds_resampled():
    """Each reached goal of three has 0.5: goals that were not reached count as 0."""
    (row,) = controller_differences(DRIVEN, ("a", "b"))
    first, second = (np.array([[goals / 6 for goals in REACHED[name]]]) for name in ("a", "b"))
    expected = paired_bootstrap(first, second, np.random.default_rng(0))
    found = [row[f"spl_difference{end}"] for end in ("", "_low", "_high")]
    assert found == pytest.approx(expected)
    assert found[1] < found[0] < found[2]


def test_times_are_compared_where_both_have_finished():
    """Sums over the goals of trials 0 and 3; a drive that fails early is not fast."""
    slow = [
        attempt(number, goal, "goal", "b", time_s=15.0 + number)
        for number in (0, 3)
        for goal in (1, 2, 3)
    ]
    driven = [
        each for each in DRIVEN if (each.contender, each.repetition) not in {("b", 0), ("b", 3)}
    ]
    (row,) = controller_differences([*driven, *slow], ("a", "b"))
    assert row["both"] == 2
    # 30 s of the first; 45 s and 54 s of the second.
    assert row["time_difference_s"] == pytest.approx(19.5)
    assert (row["time_difference_s_low"], row["time_difference_s_high"]) == (15.0, 24.0)


def test_without_a_trial_that_both_finished_there_is_no_difference_in_time():
    """None, not zero."""
    (row,) = controller_differences([*trial(0, "a", 3), *trial(0, "b", 1)], ("a", "b"))
    assert (row["both"], row["time_difference_s"], row["time_difference_s_low"]) == (0, None, None)


def test_disturbed_arms_and_a_single_controller_make_no_pairs():
    """A disturbance has a table of its own."""
    assert controller_differences(DRIVEN, ("a",)) == []


def test_controllers_that_did_not_drive_the_same_are_refused():
    """A difference over other worlds would be that of the worlds."""
    with pytest.raises(ValueError, match="expected the same scenarios of both, got 1 of one"):
        controller_differences([*DRIVEN, *trial(5, "b", 3)], ("a", "b"))
