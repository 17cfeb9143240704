"""The first rows of a session by topic."""

import numpy as np

from andabata.records import topics
from andabata.records.decoding import row_history
from andabata.records.decoding.row_history import RowHistory


def test_rows_are_counted_and_returned_in_order_of_time():
    """Late rows are sorted in, and the span is that of arrival."""
    history = RowHistory()
    for stamp in (1.0, 3.0, 2.0, 4.0):
        history.add(topics.IMU, [stamp, 10 * stamp], "sensor_msgs/msg/Imu")
    assert (history.count(topics.IMU), history.seconds(topics.IMU)) == (4, 3.0)
    expected = [[1, 10], [2, 20], [3, 30], [4, 40]]
    np.testing.assert_array_equal(history.array(topics.IMU), expected)
    assert (history.count(topics.FIX), history.seconds(topics.FIX)) == (0, 0.0)
    assert history.array(topics.FIX) is None


def test_one_topic_can_be_taken_alone():
    """The rest of the history is left out."""
    history = RowHistory()
    history.add(topics.IMU, [0.0], "a")
    history.add(topics.MAG, [1.0], "b")
    alone = history.only(topics.MAG)
    assert alone.kinds == {topics.MAG: "b"}
    assert (alone.count(topics.IMU), alone.count(topics.MAG)) == (0, 1)


def test_memory_is_bounded(monkeypatch):
    """Beyond the most rows the first ones are kept."""
    monkeypatch.setattr(row_history, "_MOST_ROWS", 2)
    history = RowHistory()
    for stamp in range(5):
        history.add(topics.IMU, [float(stamp)], "a")
    assert history.array(topics.IMU).tolist() == [[0.0], [1.0]]
