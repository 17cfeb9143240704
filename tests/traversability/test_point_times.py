"""Times of points are seconds, from any unit and zero of a driver."""

import numpy as np
import pytest

from traversability.point_times import read_point_times, time_unit_of

EPOCH = 1_700_000_000.25
SCAN = np.linspace(0.0, 0.1, 50)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("t", (SCAN * 1e9).astype("u4")),  # Ouster.
        ("offset_time", (SCAN * 1e9).astype("u4")),  # Livox's custom message, converted.
        ("timestamp", (EPOCH + SCAN) * 1e9),  # livox_ros_driver2: float64.
        ("timestamp", EPOCH + SCAN),  # Hesai, RoboSense.
        ("time", SCAN.astype("f4")),  # Velodyne.
        ("time", (SCAN * 1e6).astype("f4")),  # Velodyne of other drivers.
        ("time", (SCAN * 1e3).astype("f4")),
        ("t", SCAN.astype("f4")),
        ("t", (SCAN * 1e6).astype("u4")),
        ("t", (SCAN * 1e9).astype("i4")),
        ("t", (SCAN * 1e3).astype("u2")),
        ("timeStamp", np.array([int((EPOCH + s) * 1e9) for s in SCAN], dtype="u8")),
        ("time_stamp", (EPOCH + SCAN) * 1e6),
        ("Timestamp", (EPOCH + SCAN) * 1e3),
        ("relative_time", SCAN),
        ("time_offset", (SCAN * 1e9).astype("f8")),
        ("time_us", (SCAN * 1e6).astype("i8")),
    ],
)
def test_every_unit_gives_the_same_seconds_after_the_header(name, values):
    """Nanoseconds to seconds, from the header or from 1970."""
    times = read_point_times({"intensity": values, name: values}, EPOCH)
    assert times.field == name
    np.testing.assert_allclose(times.seconds, SCAN, atol=1.1e-3 if values.dtype == "u2" else 2e-6)


def test_times_before_the_header_count_back_from_the_end_of_the_turn():
    """They are negative, without a remark."""
    times = read_point_times({"time": (SCAN - 0.1).astype("f4")}, EPOCH)
    np.testing.assert_allclose(times.seconds, SCAN - 0.1, atol=1e-6)
    assert times.remarks == ()


def test_an_unusual_unit_is_named():
    """Integers are nanoseconds by default."""
    times = read_point_times({"t": (SCAN * 1e6).astype("u4")}, EPOCH)
    assert times.remarks == ("field t: taken as microseconds (0 to 100000)",)


@pytest.mark.parametrize("begin", [37.0, 250.0, -18.0])
def test_another_clock_counts_from_the_first_point_with_a_remark(begin):
    """Its zero is not the header's."""
    for values in (EPOCH + begin + SCAN, 5000.0 + begin + SCAN):
        times = read_point_times({"timestamp": values}, EPOCH)
        np.testing.assert_allclose(times.seconds, SCAN, atol=1e-6)
        assert "taken from the first point on" in times.remarks[0]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (np.array([0.0, 1e6], dtype="f4"), "got 0 to 1000000 of float32; not used"),
        (np.array([0, 4_294_967_295], dtype="u4"), "got 0 to 4294967295 of uint32; not used"),
        (np.array([0.0, np.nan, 0.1]), "got 1 of 3 not finite; not used"),
        (np.array([EPOCH, EPOCH + 10.0]), "not used"),
        (np.full(5, EPOCH), "for all of float64; not used"),
        (np.arange(10, dtype="u1"), "got 0 to 9 of uint8; not used"),
    ],
)
def test_implausible_times_are_named_and_not_used(values, words):
    """The remark names what was expected and what came."""
    times = read_point_times({"time": values}, EPOCH)
    assert times.seconds is None
    assert len(times.remarks) == 1
    assert times.remarks[0].startswith("field time: expected")
    assert words in times.remarks[0]


def test_the_next_field_stands_in_for_an_implausible_one():
    """A remark names the first one."""
    columns = {"t": np.array([0, 2**32 - 1], dtype="u4"), "timestamp": EPOCH + np.array([0, 0.1])}
    times = read_point_times(columns, EPOCH)
    assert times.field == "timestamp"
    assert "field t" in times.remarks[0]


def test_files_keep_what_they_count_and_slow_scans():
    """Without a header, times stay as they are."""
    slow = np.linspace(0, 3.3, 20)
    np.testing.assert_allclose(read_point_times({"t": (slow * 1e9).astype("u4")}).seconds, slow)
    np.testing.assert_array_equal(read_point_times({"time": EPOCH + slow}).seconds, EPOCH + slow)
    survey = read_point_times({"gps_time": np.array([2e5, 2.1e5])})
    np.testing.assert_array_equal(survey.seconds, [2e5, 2.1e5])
    long = read_point_times({"time": np.array([0.0, 7.0])})
    np.testing.assert_array_equal(long.seconds, [0.0, 7.0])
    assert "kept as seconds" in long.remarks[0]


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("t", (True, None)),
        ("t_ns", (True, "nanoseconds")),
        ("timestamp_usec", (True, "microseconds")),
        ("offset time ms", (True, "milliseconds")),
        ("time_sec", (True, "seconds")),
        ("ts", (True, None)),
        ("rings", (False, None)),
        ("tms_of_day", (False, None)),
        ("intensity", (False, None)),
    ],
)
def test_names_of_times(name, expected):
    """A name shows a time and its unit, or none."""
    assert time_unit_of(name) == expected
