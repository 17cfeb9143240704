"""Sweeps and head angles of equal stamps."""

from types import SimpleNamespace

import numpy as np

from andabata.records.decoding.sweep_matcher import SweepMatcher, valid_ranges
from andabata.records.messages import NS


def at(stamp_ns):
    """Return a message with a header."""
    stamp = SimpleNamespace(sec=stamp_ns // NS, nanosec=stamp_ns % NS)
    return SimpleNamespace(header=SimpleNamespace(stamp=stamp), stamp_ns=stamp_ns)


def matched(scans, heads):
    """Return the stamps of the pairs of a matcher that got scans, then heads [ns]."""
    matcher = SweepMatcher()
    for stamp in scans:
        matcher.add_scan(at(stamp))
    for stamp in heads:
        matcher.add_head(at(stamp))
    pairs = matcher.take()
    assert all(scan.stamp_ns == head.stamp_ns for scan, head in pairs)
    return [scan.stamp_ns for scan, _ in pairs], matcher


def test_pairs_are_in_the_order_of_the_sweeps():
    """Angles may come in any order."""
    assert matched([1, 2, 3], [3, 1, 2])[0] == [1, 2, 3]


def test_a_sweep_without_its_angle_holds_up_those_after_it():
    """The pairs before it are returned, those after it once its angle has come."""
    found, matcher = matched([1, 2, 3], [1, 3])
    assert found == [1]
    matcher.add_head(at(2))
    assert [scan.stamp_ns for scan, _ in matcher.take()] == [2, 3]
    assert matcher.take() == []


def test_a_sweep_waits_for_less_than_half_a_second():
    """At half a second it is dropped, just before it is not."""
    begin, half = 10 * NS, NS // 2
    assert matched([begin, begin + half], [begin + half])[0] == [begin + half]
    assert matched([begin, begin + half - 1], [begin + half - 1])[0] == []


def test_an_angle_without_its_sweep_is_dropped():
    """A sweep that comes over half a second late finds no angle."""
    begin, half = 10 * NS, NS // 2
    _, matcher = matched([begin + NS], [begin + NS, begin, begin + half])
    matcher.add_scan(at(begin + half))
    matcher.add_scan(at(begin))
    assert [scan.stamp_ns for scan, _ in matcher.take()] == [begin + half]


def test_ranges_outside_of_their_bounds_are_infinite():
    """The bounds themselves are valid; NaN is not."""
    scan = SimpleNamespace(ranges=[0.09, 0.1, 5.0, 5.1, np.nan], range_min=0.1, range_max=5.0)
    scan.range_min = np.float32(0.1)
    inf = np.inf
    np.testing.assert_allclose(valid_ranges(scan), [inf, 0.1, 5.0, inf, inf], rtol=1e-6)
