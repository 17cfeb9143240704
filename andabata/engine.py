"""Work cut into tasks that carry their own seeds: results don't depend on who ran them."""

import ctypes
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import active_children, get_context, parent_process
from multiprocessing.connection import wait
from threading import Thread
from typing import TypeVar

_M_MMAP_THRESHOLD = -3
_LARGE = 1 << 20
"""Parameter of glibc's ``mallopt``, and the size from which a freed array goes back to the system
[bytes]."""

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_tasks(
    work: Callable[[Task], Result], tasks: Iterable[Task], workers: int
) -> Iterator[tuple[Task, Result]]:
    """Yield each task with its result, in the order of the tasks.

    Args:
        work: A function that a process can import.
        tasks: Its arguments.
        workers: Processes; one works in this process.
    """
    if workers <= 1:
        for task in tasks:
            yield task, work(task)
        return
    with open_pool(workers) as pool:
        pending = [(task, pool.submit(work, task)) for task in tasks]
        for task, future in pending:
            yield task, future.result()


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
    """Leave Ctrl-C to the parent, whose death is the worker's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _give_memory_back()
    Thread(target=_follow_the_parent, daemon=True).start()


def _give_memory_back() -> None:
    """Fix the size from which arrays have pages of their own.

    By itself glibc raises it to 32 MB with use, and the arrays of worlds that come and go leave
    holes: an eighth of a player's memory. Other systems' allocators are left alone.
    """
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE)


def _follow_the_parent() -> None:
    """End this process when its parent has ended: a killed run leaves nobody behind.

    The pool's own workers would wait for work for ever.
    """
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
