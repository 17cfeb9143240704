"""Notice of the first compilation of a process, which takes a minute where no cache is.

The module imports no compiler: a command line can ask for the notice before it imports one.
"""

from collections.abc import Callable
from threading import Lock

_lock = Lock()
_notices: list[Callable[[], None]] = []


def on_first_compilation(notice: Callable[[], None]) -> None:
    """Call a function once, when the next kernel is compiled; one that was given before is dropped.

    Kernels whose machine code is in the cache are not compiled.
    """
    with _lock:
        _notices[:] = [notice]


def compilation_begins() -> None:
    """Call the function that waits for a compilation, if there is one."""
    with _lock:
        waiting, _notices[:] = list(_notices), []
    for notice in waiting:
        notice()
