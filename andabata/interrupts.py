"""Ctrl-C and SIGTERM in the command line: quiet and at once, also while libraries are imported.

An interrupt that is raised in the middle of an import reaches code that does not expect it: the
initialization of a C extension turns it into another error, or loses it, and the interpreter prints
a traceback. Nothing is open yet when a command imports its libraries, so the process ends there.
Anywhere else the interrupt is raised, so that files and pages are closed, and a robot is stopped.

SIGTERM, with which supervisors and shutdowns end a process, is treated as Ctrl-C.
"""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import pairwise
from multiprocessing import parent_process
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sys import UnraisableHookArgs

INTERRUPTED = 130
"""Exit code of an interrupted command, as shells have it."""

TEXT = "interrupted\n"
"""Line that an interrupted command prints."""

_SHOW_CURSOR = "\x1b[?25h"
"""Escape sequence that undoes what a progress bar has done to a terminal."""

_IMPORT = "<frozen importlib"
"""Beginning of the file names of the import system."""

_SECOND_TRY = 0.05
"""Time after which an interrupt that was lost is raised again [s]."""


class Interrupt(KeyboardInterrupt):
    """Ctrl-C or SIGTERM; its argument is the signal.

    A type of its own: Python ends a process by the signal instead of its exit code when a plain
    KeyboardInterrupt has once passed through ``exec``, even if it was caught.
    """


def is_command_line() -> bool:
    """Return True in the process of ``andabata``, or ``python -m andabata``."""
    words = sys.orig_argv
    started = Path(sys.argv[0]).name if getattr(sys, "argv", None) else ""
    return started == "andabata" or ("-m", "andabata") in pairwise(words)


def handle_interrupts() -> None:
    """Handle Ctrl-C and SIGTERM as this module does, from now on.

    A signal that is ignored stays ignored, and workers are ended by their parent.
    """
    if threading.current_thread() is not threading.main_thread() or parent_process() is not None:
        return
    defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGTERM: signal.SIG_DFL}
    ours = [each for each, default in defaults.items() if signal.getsignal(each) is default]
    if not ours:
        return
    stderr: int | None = None
    with suppress(OSError):  # Some imports replace the descriptor for a while.
        stderr = os.dup(2)

    def handle(number: int, frame: FrameType | None) -> None:
        if _imports(frame):
            _end(stderr)
        raise Interrupt(number)

    for each in ours:
        signal.signal(each, handle)
    sys.unraisablehook = _raise_again


@contextmanager
def held_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back until the block ends; processes that are started in it never get it.

    A new process cannot ignore the signal before Python has started in it, and would print a
    traceback.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows.
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _imports(frame: FrameType | None) -> bool:
    """Return True if a frame stands within an import."""
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORT):
            return True
        frame = frame.f_back
    return False


def _end(stderr: int | None) -> None:
    """End the process, with what it has printed so far."""
    with suppress(Exception):  # The signal may have come in the middle of a write.
        sys.stdout.flush()
    if stderr is not None:
        with suppress(OSError):
            text = _SHOW_CURSOR + TEXT if os.isatty(stderr) else TEXT
            os.write(stderr, text.encode())
    os._exit(INTERRUPTED)


def _raise_again(lost: "UnraisableHookArgs") -> None:
    """Raise an interrupt again that came where no exception can be raised, as in a destructor."""
    if not issubclass(lost.exc_type, Interrupt):
        sys.__unraisablehook__(lost)
        return
    number = lost.exc_value.args[0] if lost.exc_value else signal.SIGINT
    again = threading.Timer(_SECOND_TRY, _raise_in_main_thread, (number,))
    again.daemon = True
    again.start()


def _raise_in_main_thread(number: int) -> None:
    """Raise a signal where it is handled, so that it ends a sleep or a wait there."""
    main = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, number)
    else:  # Windows.
        signal.raise_signal(number)
