"""Engine: work cut into tasks that carry their own seeds, run in any process."""

import ctypes
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from types import TracebackType
from typing import Self, TypeVar

_M_MMAP_THRESHOLD = -3
_LARGE = 1 << 20
"""Parameter of glibc's ``mallopt``, and the size from which a freed array goes back to the system
[bytes]."""

Task = TypeVar("Task")
Result = TypeVar("Result")


class Engine:
    """Maps a function over tasks, in this process or over several.

    A task carries its own seed, so that results do not depend on who ran it. As a context the
    engine keeps its processes between maps, with whatever they have loaded; an error or Ctrl-C ends
    them at once.

    Attributes:
        workers: Number of processes; one works in this process.
    """

    def __init__(self, workers: int) -> None:
        """Prepare for a number of processes, which ``with`` starts."""
        self.workers = workers
        self._stack = ExitStack()
        self._pool: ProcessPoolExecutor | None = None

    def map(self, work: Callable[[Task], Result], tasks: Iterable[Task]) -> Iterator[Result]:
        """Yield the result of each task, in the order of the tasks.

        Args:
            work: Function that a process can import.
            tasks: Arguments of the calls, one each.

        Raises:
            ValueError: If there are several workers, and the engine is not in a ``with`` block.
        """
        if self.workers <= 1:
            yield from map(work, tasks)
            return
        if self._pool is None:
            raise ValueError("engine: expected a `with` block for several workers, got none")
        for future in [self._pool.submit(work, task) for task in tasks]:
            yield future.result()

    def __enter__(self) -> Self:
        """Start the processes."""
        if self.workers > 1:
            self._pool = self._stack.enter_context(open_pool(self.workers))
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> bool | None:
        """Stop the processes, at once after an error or Ctrl-C."""
        self._pool = None
        return self._stack.__exit__(kind, error, trace)


def run_tasks(
    work: Callable[[Task], Result], tasks: Iterable[Task], workers: int
) -> Iterator[tuple[Task, Result]]:
    """Yield each task with its result, in the order of the tasks.

    Args:
        work: Function that a process can import.
        tasks: Arguments of the calls, one each.
        workers: Number of processes; one works in this process.
    """
    waiting = list(tasks)
    with Engine(workers) as engine:
        yield from zip(waiting, engine.map(work, waiting), strict=True)


@contextmanager
def open_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of fresh processes; an error or Ctrl-C ends them at once."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    before = set(active_children())
    try:
        yield pool
    except BaseException:
        for child in set(active_children()) - before:
            child.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """Leave Ctrl-C to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _give_memory_back()
    Thread(target=_follow_the_parent, daemon=True).start()


def _give_memory_back() -> None:
    """Fix the size from which arrays have pages of their own.

    Unasked glibc raises it to 32 MB with use, and the arrays of worlds that come and go leave
    holes: an eighth of a worker's memory. Other systems' allocators are left alone.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE)


def _follow_the_parent() -> None:
    """End this process when its parent has ended: a killed run leaves no process behind.

    The pool's own workers would wait for work for ever.
    """
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
