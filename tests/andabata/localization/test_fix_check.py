"""Validation of fixes: reasons, assumptions, and rows that are neither good nor rejected."""

import numpy as np

from andabata.localization.fix_check import (
    NO_ALTITUDE,
    NO_COVARIANCE,
    check_fixes,
    is_impossible,
    reports_no_fix,
)

GOOD = [1.0, 36.7, -4.5, 60.0, 0.5]


def rows(**columns):
    """Return one good row, with some columns replaced."""
    row = dict(zip(("stamp", "latitude", "longitude", "altitude", "variance"), GOOD, strict=True))
    return np.array([list((row | columns).values())])


def test_a_good_fix_is_good_without_assumption():
    """A complete fix is neither rejected nor completed."""
    check = check_fixes(rows())
    assert check.good.tolist() == [True]
    assert not check.rejected
    assert not check.assumed


def test_a_fix_counts_for_its_first_reason_alone():
    """A row with two faults is rejected once."""
    check = check_fixes(rows(latitude=140.0, variance=-1.0))
    assert check.good.tolist() == [False]
    assert check.rejected.total() == 1


def test_a_receiver_without_a_fix_is_neither_good_nor_rejected():
    """An infinite variance is the receiver's own report of no fix."""
    check = check_fixes(rows(latitude=np.nan, variance=np.inf))
    assert check.good.tolist() == [False]
    assert not check.rejected


def test_a_report_of_no_fix_is_told_from_noise():
    """It has an infinite variance, and a whole place or none; garbage has half of one."""
    bad = np.nan
    reports = [
        reports_no_fix(rows(**columns)).tolist()
        for columns in (
            {"variance": np.inf},
            {"variance": np.inf, "latitude": bad, "longitude": bad},
            {"variance": np.inf, "latitude": bad},
            {"variance": np.inf, "longitude": bad},
            {"variance": np.inf, "stamp": bad},
            {"variance": -np.inf},
            {},
        )
    ]
    assert reports == [[True], [True], [False], [False], [False], [False], [False]]


def test_what_is_missing_is_assumed_and_counted():
    """Rows without altitude or covariance are good, and counted by what is assumed."""
    check = check_fixes(np.concatenate([rows(altitude=np.nan), rows(variance=0.0), rows()]))
    assert check.good.all()
    assert check.assumed == {NO_ALTITUDE: 1, NO_COVARIANCE: 1}


def test_limits_are_inclusive():
    """A variance of (1000 m)^2 and a latitude of 89 degrees are the last that are good."""
    assert check_fixes(rows(variance=1e6)).good.all()
    assert not check_fixes(rows(variance=1.001e6)).good.any()
    assert check_fixes(rows(latitude=89.0)).good.all()
    assert not check_fixes(rows(latitude=89.01)).good.any()


def test_numbers_that_no_receiver_sends_are_impossible():
    """Half a place, a place that is none on Earth, a negative variance; no silence."""
    bad, inf = np.nan, np.inf
    impossible = (
        {"latitude": bad},
        {"longitude": bad},
        {"latitude": -inf, "longitude": inf},
        {"latitude": 90.1},
        {"longitude": -360.1},
        {"altitude": -1e30},
        {"altitude": inf},
        {"variance": -1.0},
    )
    possible = (
        {},
        {"latitude": bad, "longitude": bad, "altitude": bad, "variance": inf},
        {"latitude": 0.0, "longitude": 0.0},
        {"altitude": bad, "variance": bad},
        {"altitude": 60_000.0},
        {"variance": 1e12},
    )
    assert all(is_impossible(rows(**columns)).tolist() == [True] for columns in impossible)
    assert all(is_impossible(rows(**columns)).tolist() == [False] for columns in possible)
