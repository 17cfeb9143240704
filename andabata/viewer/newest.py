"""Hand-over of the newest value between two threads: a slow taker never holds up the giver."""

import threading
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Newest(Generic[Value]):
    """Holds one value; a newer one replaces it, whether it was taken or not."""

    def __init__(self) -> None:
        """Begin without a value."""
        self._changed = threading.Condition()
        self._value: Value | None = None
        self._is_closed = False

    def put(self, value: Value) -> None:
        """Offer a value, without waiting."""
        with self._changed:
            self._value = value
            self._changed.notify()

    def take(self) -> Value | None:
        """Wait for a value that was not taken yet; None after the end."""
        with self._changed:
            while self._value is None and not self._is_closed:
                self._changed.wait()
            value, self._value = self._value, None
            return value

    def close(self) -> None:
        """Let the taker go once it has the last value."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
