"""Texts of options to values: known answers, and errors that name the option."""

import pytest

from andabata.configuration.usage import (
    UsageError,
    numbers,
    pairs,
    span,
    time_offsets,
    units,
    words,
)


def test_words_are_split_and_known():
    """Words keep their order; blanks and empty words are dropped."""
    assert words(" b, a,,b ", ("a", "b"), "--x") == ("b", "a", "b")
    with pytest.raises(UsageError, match="--x: expected some of a, b, got 'c'"):
        words("a,c", ("a", "b"), "--x")
    with pytest.raises(UsageError, match="--x: expected some of a, b, got nothing"):
        words(" , ", ("a", "b"), "--x")


def test_numbers_are_finite_and_counted():
    """Exactly as many finite numbers as expected pass."""
    assert numbers("1, -2.5e1", 2, "--x") == (1.0, -25.0)
    for text in ("1", "1,2,3", "1,x", "1,nan", "inf,1", ""):
        with pytest.raises(UsageError, match="--x: expected 2 numbers"):
            numbers(text, 2, "--x")


def test_pairs_split_at_the_first_sign():
    """The value may hold further equals signs; both sides are needed."""
    assert pairs([" a = b=c ", "d=e"], "--x") == {"a": "b=c", "d": "e"}
    for text in ("a", "=b", "a="):
        with pytest.raises(UsageError, match="--x: expected a=b"):
            pairs([text], "--x")


def test_units_are_known_or_factors():
    """A unit of its quantity or a factor passes."""
    assert units(["wheels=rpm", "acceleration=9.81"]) == {"wheels": "rpm", "acceleration": "9.81"}
    for text in ("wheels=T", "speed=m/s"):
        with pytest.raises(UsageError):
            units([text])


@pytest.mark.parametrize(
    ("text", "found"),
    [("1", range(0, 1)), ("3", range(2, 3)), ("1-3", range(0, 3)), ("2-2", range(1, 2))],
)
def test_a_span_counts_from_one(text, found):
    """``1-3`` are the indices 0, 1 and 2."""
    assert span(text, 3, "--x") == found


@pytest.mark.parametrize("text", ["0", "4", "2-1", "1-4", "-1", "a", "", "1-2-3", "01"])
def test_a_text_that_is_not_a_span_is_refused(text):
    """Numbers outside the bounds and spans in the wrong order are errors."""
    with pytest.raises(UsageError, match="--x: expected 1, 2, 3 or a span as 1-3"):
        span(text, 3, "--x")


def test_times_are_seconds_of_known_topics():
    """A topic of no reading, a time that is none, and one beyond a second are refused."""
    assert time_offsets(["/imu=-0.09", "/fix= 1"]) == {"/imu": -0.09, "/fix": 1.0}
    with pytest.raises(UsageError, match=r"--time-offset: expected one of /imu, .*got '/scan'"):
        time_offsets(["/scan=0.1"])
    with pytest.raises(UsageError, match="--time-offset /imu: expected 1 numbers"):
        time_offsets(["/imu=late"])
    for text in ("1.01", "-89"):
        with pytest.raises(UsageError, match="--time-offset /imu: expected at most 1 s before or"):
            time_offsets([f"/imu={text}"])
