"""Two sources of the readings of one topic."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.decoding.reading_sources import ReadingSources, SourceError
from andabata.records.decoding.source_choice import ReadingSource
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.remarks import Remarks

LEVEL = [0.0, 0.0, 0.1, 0.0, 0.0, 9.8]
A, B, C = (ReadingSource(name) for name in "abc")
PLACE = [36.7, -4.4, 60.0, 1.0]


def judged(topic, one, other, count=30):
    """Return the remarks on two sources, and how many readings of the second were refused."""
    remarks, refused = Remarks(), 0
    sources = ReadingSources(remarks)
    for k in range(count):
        sources.add(topic, A, [k / 100, *one])
        try:
            sources.add(topic, B, [k / 100 + 0.001, *other])
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
        (topics.ENCODERS, [1.0, 3.0], [1.9, 2.1]),
        (topics.ENCODERS, [5.0, 5.0], [0.0, 0.0]),
    ],
)
def test_sources_that_agree_are_used(topic, one, other):
    """They are reported in one remark; so are zeros of wheels, which others judge."""
    remarks, refused = judged(topic, one, other)
    assert refused == 0
    assert not remarks.has_failures
    assert remarks.texts == (f"{topic.ros1}: readings come from two sources, frame a and frame b",)


@pytest.mark.parametrize(
    ("topic", "one", "other", "words"),
    [
        (topics.IMU, LEVEL, [0.0, 0, 0.5, 0, 0, 9.8], "0.40 rad/s"),
        (topics.IMU, LEVEL, [0.0, 0, 0.1, 0, 0, -9.8], "180 degrees"),
        (topics.MAG, [30.0, 0, -40], [0.0, 30.0, -40], "degrees"),
        (topics.FIX, PLACE, [36.7002, *PLACE[1:]], "22.2 m"),
        (topics.FIX, PLACE, [36.7, -4.3998, *PLACE[2:]], "17.8 m"),
        (topics.ENCODERS, [1.0, 3.0], [1.0, 4.2], "1.20 rad/s"),
    ],
)
def test_a_second_source_that_contradicts_the_first_is_refused(topic, one, other, words):
    """The remark names both and their difference, and is a failed check."""
    remarks, refused = judged(topic, one, other)
    assert refused == (28 if topic is topics.FIX else 11)
    assert remarks.has_failures
    assert any(words in text and "frame a is used" in text for text in remarks.texts)


def test_readings_at_other_times_are_not_compared():
    """One source after the other is no contradiction."""
    remarks = Remarks()
    sources = ReadingSources(remarks)
    for k in range(50):
        sources.add(topics.IMU, A, [k / 100, *LEVEL])
    for k in range(50):
        sources.add(topics.IMU, B, [9 + k / 100, *LEVEL[:-1], -9.8])
    assert not remarks.has_failures


def test_each_source_is_compared_on_its_own():
    """A third source that contradicts the first is refused although the second agrees."""
    remarks, refused = Remarks(), {A: 0, B: 0, C: 0}
    sources = ReadingSources(remarks)
    for k in range(60):
        for source, up in ((A, 9.8), (B, 9.7), (C, -9.8)):
            try:
                sources.add(topics.IMU, source, [k / 100, *LEVEL[:-1], up])
            except UnusableMessageError:
                refused[source] += 1
    assert refused == {A: 0, B: 0, C: 41}


def test_a_contradiction_is_an_error_that_names_both_choices():
    """Without one there is no error."""
    sources = ReadingSources(Remarks())
    sources.verify()
    for k in range(30):
        sources.add(topics.IMU, A, [k / 10, *LEVEL])
        if k < 19:
            sources.add(topics.IMU, B, [k / 10 + 0.1, *LEVEL[:-1], -9.8])
    sources.verify()
    with pytest.raises(UnusableMessageError):
        sources.add(topics.IMU, B, [2.9, *LEVEL[:-1], -9.8])
    with pytest.raises(SourceError, match=r"--source /imu=a or --source /imu=b chooses one"):
        sources.verify()
