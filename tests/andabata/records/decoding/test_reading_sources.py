"""Two sources of the readings of one topic."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.decoding.reading_sources import ReadingSources
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.remarks import Remarks

LEVEL = [0.0, 0.0, 0.1, 0.0, 0.0, 9.8]
PLACE = [36.7, -4.4, 60.0, 1.0]


def judged(topic, one, other, count=30):
    """Return the remarks on two sources, and how many readings of the second were refused."""
    remarks, refused = Remarks(), 0
    sources = ReadingSources(remarks)
    for k in range(count):
        sources.add(topic, "a", [k / 100, *one])
        try:
            sources.add(topic, "b", [k / 100 + 0.001, *other])
        except UnusableMessageError:
            refused += 1
    return remarks, refused


@pytest.mark.parametrize(
    ("topic", "one", "other"),
    [
        (topics.IMU, LEVEL, [0.05, 0, 0.1, 0.5, 0, 9.8]),
        (topics.MAG, [30.0, 0, -40], [31.0, 2, -40]),
        (topics.FIX, PLACE, [36.70002, *PLACE[1:]]),
        (topics.FIX, PLACE, [np.nan] * 4),
        (topics.ENCODERS, [1.0, 1.0], [5.0, 5.0]),
    ],
)
def test_sources_that_agree_are_used(topic, one, other):
    """They are reported in one remark at most."""
    remarks, refused = judged(topic, one, other)
    assert refused == 0
    assert not remarks.has_failures
    assert len(remarks.texts) == (topic is not topics.ENCODERS)


@pytest.mark.parametrize(
    ("topic", "one", "other", "words"),
    [
        (topics.IMU, LEVEL, [0.0, 0, 0.5, 0, 0, 9.8], "0.40 rad/s"),
        (topics.IMU, LEVEL, [0.0, 0, 0.1, 0, 0, -9.8], "180 degrees"),
        (topics.MAG, [30.0, 0, -40], [0.0, 30.0, -40], "degrees"),
        (topics.FIX, PLACE, [36.7002, *PLACE[1:]], "22.2 m"),
        (topics.FIX, PLACE, [36.7, -4.3998, *PLACE[2:]], "17.8 m"),
    ],
)
def test_a_second_source_that_contradicts_the_first_is_refused(topic, one, other, words):
    """The remark names both and their difference, and is a failed check."""
    remarks, refused = judged(topic, one, other)
    assert refused == (28 if topic is topics.FIX else 11)
    assert remarks.has_failures
    assert any(words in text and "a is used" in text for text in remarks.texts)


def test_readings_at_other_times_are_not_compared():
    """One source after the other is no contradiction."""
    remarks = Remarks()
    sources = ReadingSources(remarks)
    for k in range(50):
        sources.add(topics.IMU, "a", [k / 100, *LEVEL])
    for k in range(50):
        sources.add(topics.IMU, "b", [9 + k / 100, *LEVEL[:-1], -9.8])
    assert not remarks.has_failures
