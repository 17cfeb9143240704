"""Engine of this machine: processes that are started anew, and started again when one is killed."""

import ctypes
import os
import signal
from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor
from concurrent.futures import wait as wait_for
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import Pipe, active_children, get_context, parent_process
from multiprocessing.connection import Connection, wait
from threading import Thread
from types import TracebackType
from typing import Any, Self

from andabata.engine import (
    Finished,
    ParallelEngine,
    Reply,
    Result,
    SerialEngine,
    Task,
    Tell,
    WorkerLostError,
    answer,
)
from andabata.interrupts import held_interrupts
from terrain.compilation import compilation_begins, on_first_compilation

_COMPILES, _OVER = b"compiles", b"over"
"""Messages of a worker that compiles, and of the end of a pool."""

_M_MMAP_THRESHOLD = -3
_LARGE = 1 << 20
"""Parameter of glibc's ``mallopt``, and the size from which a freed array goes back to the system
[bytes]."""


class ProcessEngine(ParallelEngine):
    """Runs tasks in processes of this machine; one worker is this process.

    When a process is killed, all of them end, as Python's pools have it, and new ones take up
    their tasks.
    """

    def __init__(self, workers: int, tell: Tell = lambda text: None) -> None:
        """Prepare for a number of processes, which ``with`` starts.

        Args:
            workers: Number of processes.
            tell: Function that takes a line for people.
        """
        # A second task for each, so that none waits for this process.
        super().__init__(workers, 2 * workers, tell)
        self._stack = ExitStack()
        self._pool: ProcessPoolExecutor | None = None

    def run(
        self, work: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Result]]:
        """Yield each task once with its result, as soon as it is there; see ``Engine``.

        Raises:
            ValueError: If there are several workers, and the engine is not in a ``with`` block.
        """
        if self.workers > 1:
            return super().run(work, tasks)
        return SerialEngine().run(work, tasks)

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
    ) -> None:
        """End the processes, at once after an error or Ctrl-C."""
        self._pool = None
        self._stack.__exit__(kind, error, trace)

    def _submit(self, work: Callable[[Task], Result], task: Task) -> "Future[Reply[Result]]":
        """Hand a task to the pool, or to a new one if a process of it was killed."""
        if self._pool is None:
            raise ValueError("engine: expected a `with` block for several workers, got none")
        with held_interrupts():  # The pool starts its processes when it gets tasks.
            try:
                return self._pool.submit(answer, self.origin, work, task)
            except BrokenProcessPool:
                self._stack.close()
                self._pool = self._stack.enter_context(open_pool(self.workers))
                return self._pool.submit(answer, self.origin, work, task)

    def _wait(self, calls: "Collection[Future[Any]]") -> "Iterable[Future[Any]]":
        """Return the calls that are over, at least one."""
        return wait_for(calls, return_when=FIRST_COMPLETED).done

    def _reply(self, call: "Future[Reply[Any]]") -> Reply[Any]:
        """Return the reply of a call that is over, or raise the error of its work."""
        try:
            return call.result()
        except BrokenProcessPool:
            raise WorkerLostError("a process of this machine was killed") from None


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
    with ProcessEngine(workers) as engine:
        yield from zip(waiting, engine.map(work, waiting), strict=True)


@contextmanager
def open_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of fresh processes; an error or Ctrl-C ends them at once."""
    with _notices() as notices:
        pool = ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=_begin, initargs=(notices,)
        )
        before = set(active_children())
        try:
            yield pool
        except BaseException:
            for child in set(active_children()) - before:
                child.terminate()
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _notices() -> Iterator[Connection]:
    """Yield a pipe on which workers say that they compile; this process says it to people.

    A message of a few bytes is written whole: no lock can be left by a worker that is killed.
    """
    reader, writer = Pipe(duplex=False)

    def listen() -> None:
        if reader.recv_bytes() == _COMPILES:
            compilation_begins()

    listener = Thread(target=listen, daemon=True)
    listener.start()
    try:
        yield writer
    finally:
        writer.send_bytes(_OVER)
        listener.join()
        reader.close()
        writer.close()


def _begin(notices: Connection) -> None:
    """Leave Ctrl-C to the parent, and end with it; tell it of a compilation."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # A worker is unpacked with the words of its parent, and takes itself for the command line: its
    # end by the parent would print a traceback.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    on_first_compilation(lambda: notices.send_bytes(_COMPILES))
    give_memory_back()
    Thread(target=_follow_the_parent, daemon=True).start()


def give_memory_back() -> None:
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
