"""Hand-over of the newest value."""

import threading

from andabata.viewer.newest import Newest


def test_a_newer_value_replaces_one_that_nobody_took():
    """A slow taker gets the last of three, and each value once."""
    slot = Newest()
    for value in "abc":
        slot.put(value)
    assert slot.take() == "c"
    slot.put("d")
    assert slot.take() == "d"


def test_the_last_value_is_taken_before_the_end():
    """After closing, what is left comes first and None for ever after."""
    slot = Newest()
    slot.put("a")
    slot.close()
    assert [slot.take(), slot.take(), slot.take()] == ["a", None, None]


def test_a_taker_that_waits_is_woken():
    """By a value, and by the end."""
    slot, taken = Newest(), []
    thread = threading.Thread(target=lambda: taken.extend([slot.take(), slot.take()]), daemon=True)
    thread.start()
    slot.put(1)
    slot.close()
    thread.join(10)
    assert taken == [1, None]
