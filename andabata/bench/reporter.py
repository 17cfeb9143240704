"""Interface through which a benchmark reports its progress."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Protocol


class Reporter(Protocol):
    """Receiver of messages and progress; the command line's console is one."""

    def status(self, text: str) -> None:
        """Show a message."""

    def progress(self, what: str, total: int | None) -> AbstractContextManager[Callable[[], None]]:
        """Show a progress bar; yields a function that advances it by one.

        Args:
            what: Name of the work.
            total: Number of steps; None if it is unknown.
        """
        ...
