"""Units of a live session: inferred once per topic, and again after a while."""

import pytest

from andabata.records import topics
from andabata.records.decoding.live_unit_inference import LiveUnitInference
from andabata.records.decoding.units import UnitError, UnitFactors
from andabata.records.decoding.unusable_message import UnusableMessageError


def live(results=()):
    """Return an inference whose results are given, and the sizes of the histories it saw."""
    seen, left = [], list(results)

    def infer(history):
        seen.append(history.count(topics.IMU))
        found = left.pop(0) if left else UnitFactors()
        if isinstance(found, Exception):
            raise found
        return found

    return LiveUnitInference(infer, UnitFactors()), seen


def accepted(inference, count, rate=100.0, topic=topics.IMU, begin=0):
    """Return which rows at a rate [Hz] are accepted."""
    stamps = [k / rate for k in range(begin, begin + count)]
    return [inference.accept(topic, [stamp, 0.0], "kind") for stamp in stamps]


def test_the_first_rows_are_kept_back():
    """Rows are accepted from the one after the twenty-fifth, with the inferred units."""
    inference, seen = live([UnitFactors(acceleration=2.0)])
    assert accepted(inference, 27) == [False] * 25 + [True] * 2
    assert seen == [25]
    assert inference.units.acceleration == 2.0


def test_a_slow_sensor_needs_a_second():
    """Three rows suffice if they span a second."""
    inference, seen = live()
    assert accepted(inference, 4, rate=2.0) == [False] * 3 + [True]
    assert seen == [3]


def test_units_are_inferred_again_after_turns():
    """After ten seconds, and after twenty."""
    inference, seen = live()
    accepted(inference, 2002)
    assert seen == [25, 1002, 2002]


def test_a_refused_unit_refuses_the_rows_after():
    """The reason of the inference is that of each row, and another topic goes on."""
    inference, _ = live([UnitError(topics.IMU, "expected g")])
    accepted(inference, 25)
    with pytest.raises(UnusableMessageError, match="expected g"):
        accepted(inference, 1)
    assert accepted(inference, 1, topic=topics.FIX) == [True]


def test_a_restart_keeps_the_units():
    """Readings of another epoch are accepted at once."""
    inference, seen = live([UnitFactors(acceleration=2.0)])
    accepted(inference, 25)
    inference.restart()
    assert accepted(inference, 2) == [True, True]
    assert (seen, inference.units.acceleration) == ([25], 2.0)
