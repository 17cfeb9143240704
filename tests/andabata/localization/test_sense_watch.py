"""Memory of the plausibility: one array, whose views lie where they are looked for."""

import numpy as np

from andabata.localization.sense_watch import (
    DOUBTS,
    SINCE,
    TURN_TIME,
    WAY,
    WHEEL_REPEAT_TIME,
    PlausibilityConfig,
    Watch,
    Wheel,
    fresh_memory,
    watch_of,
)

LIMITS, WHEEL = PlausibilityConfig(), Wheel(0.1, 0.17)


def test_the_views_cover_the_memory_once_and_in_order():
    """Numbers 0, 1, 2, ... of the memory are those of the views, one after the other."""
    memory = fresh_memory(LIMITS, WHEEL, 3.0)
    memory[:] = np.arange(len(memory))
    views = watch_of.py_func(memory)
    np.testing.assert_array_equal(np.concatenate(views), memory)
    np.testing.assert_array_equal(memory[WAY], views.way)
    np.testing.assert_array_equal(memory[DOUBTS], views.doubts)
    np.testing.assert_array_equal(memory[SINCE], views.since)


def test_a_fresh_memory_has_seen_nothing():
    """Limits and time are kept; every sense is believed, and each view has its own size."""
    views = watch_of.py_func(fresh_memory(LIMITS, WHEEL, 3.0))
    assert views.limits.tolist() == [*LIMITS, *WHEEL]
    assert views.limits[WHEEL_REPEAT_TIME] == LIMITS.wheel_repeat_time
    assert views.limits[TURN_TIME] == LIMITS.turn_time
    assert views.now.tolist() == [3.0]
    assert not views.doubts.any()
    assert [len(view) for view in (views.imu, views.wheels, views.mag)] == [7, 3, 4]
    assert np.isnan(np.concatenate([views.imu, views.wheels, views.mag])).all()
    assert set(Watch._fields) == set(views._fields)
