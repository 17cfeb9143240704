"""Bad measurements: a few of each kind change nothing, and one that does would be noticed."""

from andabata.bench.studies.soak import bad_measurements
from andabata.bench.studies.soak.bad_measurements import (
    bad_measurements_change_nothing,
    damages,
)


def test_no_bad_measurement_changes_the_state(tmp_path, monkeypatch):
    """Each kind of each sense is rejected and counted, and dead reckoning stays, too."""
    monkeypatch.setattr(bad_measurements, "_WARM_UP", 30)
    kinds = sum(map(len, damages().values()))
    outcome = bad_measurements_change_nothing(6, tmp_path)
    assert outcome.failures == ()
    assert outcome.trials >= kinds


def test_five_senses_are_damaged():
    """Each has numbers that are none, infinite and huge."""
    found = damages()
    assert set(found) == {"gyro", "accelerometer", "wheels", "compass", "satellites"}
    for sense, kinds in found.items():
        assert {"not a number", "infinite", "huge"} <= set(kinds), sense


def test_a_good_row_would_be_noticed(tmp_path, monkeypatch):
    """Rows that the filter takes change the state: the check fails, sense by sense."""
    monkeypatch.setattr(bad_measurements, "_WARM_UP", 5)
    monkeypatch.setattr(bad_measurements, "_with_bad", lambda sense, rows, *_: 1.01 * rows)
    wheels = {"wheels": {"good": lambda row, rng: row}}
    monkeypatch.setattr(bad_measurements, "damages", lambda: wheels)
    outcome = bad_measurements_change_nothing(3, tmp_path)
    assert outcome.failures == ("wheels, good: expected the state as without it, got another",)


def test_a_row_that_is_not_counted_would_be_noticed(tmp_path, monkeypatch):
    """A rejection has to be counted once."""
    monkeypatch.setattr(bad_measurements, "_WARM_UP", 5)

    def far_ahead_of_nothing(rows, *_):
        return rows[-1]

    monkeypatch.setattr(bad_measurements, "_with_bad", lambda sense, rows, *_: rows)
    kinds = {"compass": {"none": far_ahead_of_nothing}}
    monkeypatch.setattr(bad_measurements, "damages", lambda: kinds)
    (failure,) = bad_measurements_change_nothing(3, tmp_path).failures
    assert failure == "compass, none: expected one row more to be counted by its reason, got 0"
