"""Buffer of past periods: which period a late fix belongs to, and what is dropped."""

import numpy as np

from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.filter_state import Belief
from andabata.localization.measurements import Measurements
from andabata.localization.replay_buffer import FilterPeriod, ReplayBuffer
from terrain.record import packed


def period(now, fixes=(), x=0.0):
    """Return a period that begins at a time, with fixes at some stamps."""
    gnss = np.array([[stamp, 0, 0, 0, 1, 1] for stamp in fixes], dtype=float).reshape(-1, 6)
    empty = Measurements(np.empty((0, 7)), np.empty((0, 3)), np.empty((0, 4)), gnss)
    belief = Belief(np.full(18, x), np.eye(18), np.zeros((6, 3), dtype=np.int64))
    return FilterPeriod(packed(belief), now, empty, NoiseModel())


def buffer(*times):
    """Return a buffer with a period at each time."""
    found = ReplayBuffer(2.0)
    for now in times:
        found.append(period(now))
    return found


def begins(periods):
    """Return when periods begin."""
    return [p.now for p in periods]


def test_a_late_fix_belongs_to_the_period_that_contains_its_stamp():
    """The period that began last, at the stamp or before, is returned with all later ones."""
    assert begins(buffer(1.0, 1.1, 1.2, 1.3).rewind(1.15)) == [1.1, 1.2, 1.3]
    assert begins(buffer(1.0, 1.1, 1.2, 1.3).rewind(1.2)) == [1.2, 1.3]
    assert begins(buffer(1.0, 1.1, 1.2, 1.3).rewind(5.0)) == [1.3]


def test_rewound_periods_leave_the_buffer():
    """What is returned is removed; what is before stays."""
    kept = buffer(1.0, 1.1, 1.2)
    kept.rewind(1.15)
    assert begins(kept.rewind(9.0)) == [1.0]


def test_a_stamp_older_than_the_buffer_rewinds_nothing():
    """Too late a fix returns no period and removes none."""
    kept = buffer(1.0, 1.1)
    assert kept.rewind(0.95) == []
    assert begins(kept.rewind(1.05)) == [1.0, 1.1]


def test_periods_older_than_the_delay_are_dropped():
    """A period that began exactly the largest delay ago stays."""
    kept = buffer(1.0, 2.0, 3.0)
    kept.drop_old(4.0)
    assert begins(kept.rewind(2.5)) == [2.0, 3.0]


def test_a_fix_is_inserted_in_the_order_of_stamps():
    """The fix stands between earlier and later ones; the period itself is unchanged."""
    old = period(1.0, (1.01, 1.05))
    fix = np.array([1.03, 5.0, 6.0, 7.0, 1.0, 1.0])
    gnss = old.with_fix(fix).gnss
    assert gnss[:, 0].tolist() == [1.01, 1.03, 1.05]
    np.testing.assert_array_equal(gnss[1], fix)
    assert len(old.measurements.gnss) == 2


def test_the_latest_finite_state_is_found():
    """States with numbers that are not finite are passed over."""
    kept = ReplayBuffer(2.0)
    assert kept.latest_finite_state() is None
    for now, x in ((1.0, 1.0), (1.1, 2.0), (1.2, np.nan)):
        kept.append(period(now, x=x))
    np.testing.assert_array_equal(kept.latest_finite_state(), np.full(18, 2.0))
    kept.clear()
    assert kept.latest_finite_state() is None


def test_a_buffer_reaches_back_to_its_first_period():
    """From its begin on, and not before; an empty one reaches nothing."""
    kept = buffer(1.0, 1.1)
    assert [kept.reaches(stamp) for stamp in (0.99, 1.0, 1.05, 9.0)] == [False, True, True, True]
    assert not buffer().reaches(1.0)
