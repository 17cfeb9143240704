"""Rate and age of usable readings: shortages, garbage, delays, pauses, clocks."""

import numpy as np
import pytest

from andabata.localization.arrival_rate import (
    COLUMNS,
    RATE,
    USUAL_RATE,
    ArrivalRate,
    arrival_warning,
    follow_arrivals,
)

BEGIN = 1.7e9
WIDTHS = {"imu": 7, "wheels": 3, "compass": 4, "gnss": 5}
EMPTY = {name: np.empty((0, width)) for name, width in WIDTHS.items()}


def rows(stamp, hz=100, age=0.0):
    """Return the rows of all senses in a period of 0.1 s; the receiver has one a second."""
    stamps = stamp - age - np.arange(hz // 10)[::-1] / hz
    given = {
        name: np.column_stack([stamps, np.full((len(stamps), width - 1), 0.5)])
        for name, width in WIDTHS.items()
    }
    is_second = round(10 * (stamp - BEGIN)) % 10 == 0
    given["gnss"] = given["gnss"][-1:] if is_second else EMPTY["gnss"]
    return given


def drive(rate, begin, seconds, change=lambda given, k: given, **options):
    """Return the names of the senses that are doubted after each period."""
    found = []
    for k in range(1, round(10 * seconds) + 1):
        stamp = BEGIN + begin + k / 10
        given = change(rows(stamp, **options), k)
        rate.update(stamp, given["imu"], given["wheels"], given["compass"], given["gnss"])
        found.append(set(rate.warnings()))
    return found


def known(**options):
    """Return the supervision of senses whose usual rates are known."""
    rate = ArrivalRate()
    rate.reset(BEGIN)
    assert not any(drive(rate, 0.0, 10.0, **options))
    return rate


def after(found):
    """Return the time until the first doubt [s], None without any."""
    return next((round(0.1 * (k + 1), 1) for k, names in enumerate(found) if names), None)


def only(name, share):
    """Return a change that keeps a share of the rows of a sense, evenly."""

    def change(given, k):
        count = len(given[name])
        numbers = k * count + np.arange(count + 1)
        return given | {name: given[name][np.diff(np.floor(numbers * share + 1e-9)) > 0]}

    return change


@pytest.mark.parametrize("name", ["imu", "wheels", "compass"])
def test_a_tenth_of_the_readings_is_named_within_a_second(name):
    """It is named alone, with what is lost, and believed again when all arrive."""
    rate = known()
    found = drive(rate, 10.0, 5.0, only(name, 0.1))
    assert after(found) == 0.9
    assert found[-1] == {name}
    assert rate.warnings()[name] == f"{name}: fewer usable readings than usual, by 89 %, for 4.1 s"
    found = drive(rate, 15.0, 5.0)
    assert found[0] == {name}
    assert not any(found[15:])


@pytest.mark.parametrize("share", [0.6, 0.8])
def test_more_than_half_of_the_readings_is_no_shortage(share):
    """Whatever the network loses now and then."""
    assert not any(drive(known(), 10.0, 20.0, only("compass", share)))


@pytest.mark.parametrize(("gap", "is_named"), [(6, False), (8, True)])
def test_a_pause_of_half_a_second_is_no_shortage(gap, is_named):
    """One of 0.8 s is."""
    found = drive(known(), 10.0, 3.0, lambda given, k: EMPTY if k <= gap else given)
    assert any(found) == is_named


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e30, 1e30])
@pytest.mark.parametrize(
    ("name", "column", "named"),
    [
        ("imu", 2, {"imu"}),
        ("imu", 5, {"gravity"}),
        ("wheels", 2, {"wheels"}),
        ("compass", 3, {"compass"}),
    ],
)
def test_readings_that_nothing_can_use_do_not_count(name, column, named, bad):
    """A bad number of any column; what is wrong with the rows is not told of the accelerometer."""

    def change(given, k):
        given[name][:-1, column] = bad
        return given

    found = drive(known(), 10.0, 3.0, change)
    assert after(found) <= 1.1
    assert found[-1] == named


def test_a_sense_that_comes_seldom_is_not_judged_by_its_rate():
    """A receiver sends one fix a second, or none: others know its periods."""
    rate = known()
    assert not any(drive(rate, 10.0, 3.0, lambda given, k: given | {"gnss": EMPTY["gnss"]}))


@pytest.mark.parametrize(("delay", "is_named"), [(0.3, False), (1.0, True)])
def test_what_arrives_later_than_usual_is_named(delay, is_named):
    """The first late fix is named by its delay, and the first punctual one ends it."""
    rate = known()

    def change(given, k):
        given["gnss"][:, 0] -= delay
        return given

    found = drive(rate, 10.0, 2.0, change)
    assert after(found) == (1.0 if is_named else None)
    if is_named:
        assert rate.warnings() == {"gnss": "gnss: arrives late, by 1.0 s more than usual"}
    assert not any(drive(rate, 12.0, 2.0)[10:])


@pytest.mark.parametrize("offset", [-3.0, 0.02, 0.4, 3.0])
def test_a_clock_that_differs_is_usual(offset):
    """A constant age is no delay, whatever its sign."""
    rate = known(age=offset)
    assert not any(drive(rate, 10.0, 10.0, age=offset))


def test_messages_that_waited_at_the_start_teach_neither_rate_nor_age():
    """A thousand old rows in the first period: the usual ones are those afterwards."""
    rate = ArrivalRate()
    rate.reset(BEGIN)
    old = rows(BEGIN + 0.1, hz=10_000, age=5.0)
    rate.update(BEGIN + 0.1, old["imu"], old["wheels"], old["compass"], old["gnss"])
    assert not any(drive(rate, 0.1, 20.0))
    assert after(drive(rate, 20.1, 3.0, only("wheels", 0.1))) <= 1.0


def test_a_burst_after_a_pause_is_no_new_habit():
    """What waited for half a second comes at once: the usual number afterwards is enough."""
    rate = known()
    drive(rate, 10.0, 0.5, lambda given, k: EMPTY)
    drive(rate, 10.5, 0.1, lambda given, k: rows(BEGIN + 10.6, hz=600))
    assert not any(drive(rate, 10.6, 20.0))


@pytest.mark.parametrize("begin", [0.4, 1.9])
def test_a_process_that_is_held_up_while_it_learns_learns_the_rate_of_the_stamps(begin):
    """What waited comes at once in the last period of the learning; it is no habit."""
    rate = ArrivalRate()
    rate.reset(BEGIN)
    assert not any(drive(rate, 0.0, begin))
    drive(rate, begin, 3.0 - begin, lambda given, k: EMPTY)
    waited = round(100 * (3.1 - begin))
    late = rows(BEGIN + 3.1, hz=10 * waited)
    for name in ("imu", "wheels", "compass"):
        late[name][:, 0] = BEGIN + begin + np.arange(1, waited + 1) / 100
    drive(rate, 3.0, 0.1, lambda given, k: late)
    assert not any(drive(rate, 3.1, 20.0))
    assert after(drive(rate, 23.1, 3.0, only("wheels", 0.1))) <= 1.0


def test_periods_of_any_length_are_the_same_rate():
    """Two updates in a control period, or one after a stall."""
    sense, stamp = np.zeros(COLUMNS), 100.0
    for dt in [0.1, 0.05, 0.2] * 40 + [1.0]:
        stamp += dt
        follow_arrivals(sense, stamp, dt, round(100 * dt), stamp)
    assert sense[RATE] == pytest.approx(100.0, rel=1e-3)
    assert sense[USUAL_RATE] == pytest.approx(100.0, rel=5e-2)
    before = sense.copy()
    follow_arrivals(sense, stamp, 0.0, 50, stamp)
    assert np.array_equal(sense, before)


def test_before_the_first_reading_and_after_a_reset_nothing_is_missed():
    """A robot may have no compass; another drive begins anew."""
    rate = known()
    rate.reset(BEGIN + 10.0)
    assert not any(drive(rate, 10.0, 10.0, only("compass", 0.0)))
    assert rate.doubted == 0


def test_the_warning_of_a_laser_has_its_name():
    """Others supervise their own sense by the same numbers."""
    sense = np.zeros(COLUMNS)
    for k in range(60):
        follow_arrivals(sense, k / 10, 0.1, 4 if k < 40 else 0, k / 10)
    assert arrival_warning("laser", sense, 6.0).startswith("laser: fewer usable readings")
