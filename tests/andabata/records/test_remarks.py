"""Remarks are counted by subject and reason, with the first and the last time."""

from andabata.records.remarks import Remarks


def test_refusals_are_counted_by_reason_with_their_times():
    """Equal reasons share a count, with the first and the last time."""
    remarks = Remarks()
    for stamp in (1.0, 2.5, 4.0):
        remarks.refuse("/imu", "not a number", stamp)
    remarks.refuse("/imu", "too old", number=2)
    remarks.count("/fix", "a stamp that came before is dropped", 3.0)
    assert remarks.refused_by_reason() == {"/imu": {"not a number": 3, "too old": 2}}
    assert remarks.refused == 5
    assert "/imu: 3 left out: not a number, from 1.0 to 4.0 s" in remarks.texts
    first = next(r for r in remarks.as_dicts() if r["text"] == "not a number")
    assert (first["count"], first["first_s"], first["last_s"]) == (3, 1.0, 4.0)
    assert first["refused"] is True


def test_a_note_is_kept_once_and_before_counted_remarks():
    """Notes are not counted and come first."""
    remarks = Remarks()
    remarks.refuse("/imu", "too old")
    for _ in range(3):
        remarks.note("clock", "cut")
    assert remarks.texts == ("clock: cut", "/imu: 1 left out: too old")


def test_reasons_with_numbers_do_not_fill_memory():
    """Beyond a dozen texts, refusals share a common reason and are all counted."""
    remarks = Remarks()
    for k in range(1000):
        remarks.refuse("/imu", f"row {k}")
    assert len(remarks.as_dicts()) < 20
    assert remarks.refused == 1000


def test_a_failed_check_is_a_note_that_counts_as_failure():
    """Notes and counts alone are no failures."""
    remarks = Remarks()
    remarks.note("/imu", "a note")
    remarks.count("/imu", "a count")
    assert not remarks.has_failures
    remarks.fail("/imu", "a failure")
    assert remarks.has_failures
    assert [each["is_failure"] for each in remarks.as_dicts()] == [False, True, False]
    assert "/imu: a failure" in remarks.texts
