"""Engine: work cut into tasks that carry their own seeds, run in any process on any machine.

``SerialEngine`` here runs tasks in this process; ``engine_processes`` has the processes of this
machine, ``engine_ray`` those of a cluster. All give the same results.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from types import TracebackType
from typing import Any, Generic, NamedTuple, Self, TypeVar

from andabata.engine_origin import Origin, here
from andabata.own_code import own_error

Task = TypeVar("Task")
Result = TypeVar("Result")

ATTEMPTS = 5
"""Largest number of workers that may end during a task before the task counts as their cause."""

Tell = Callable[[str], None]
"""Function that takes a line for people: a worker that joined or ended, a task that runs again."""


class WorkerLostError(ChildProcessError):
    """A worker that ended before it had finished its task: killed, out of memory, off the net."""


class Finished(NamedTuple, Generic[Task, Result]):
    """A task with its result.

    Attributes:
        number: Number of the task, from 0.
        task: Task.
        result: Result of the work on it.
    """

    number: int
    task: Task
    result: Result


class Engine(ABC):
    """Runs a function over tasks, each of which carries its own seed.

    Results do not depend on who ran a task, nor on how often: a task whose worker was lost runs
    again, and its result is given once. As a context the engine keeps its workers between calls,
    with whatever they have loaded; an error or Ctrl-C ends them at once.

    Attributes:
        workers: Number of tasks at a time.
    """

    workers: int = 1

    @abstractmethod
    def run(
        self, work: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Result]]:
        """Yield each task once with its result, as soon as it is there, in any order.

        Tasks are taken as workers come free, and no more results wait than there are tasks in
        flight: memory does not grow with the number of tasks.

        Args:
            work: Function that a process can import.
            tasks: Arguments of the calls, one each.

        Raises:
            OriginError: If a worker has other code, models or packages than this process.
            WorkerLostError: If a task has lost ``ATTEMPTS`` workers.
        """

    def map(self, work: Callable[[Task], Result], tasks: Iterable[Task]) -> Iterator[Result]:
        """Yield the results in the order of the tasks; those that come early wait.

        Args:
            work: Function that a process can import.
            tasks: Arguments of the calls, one each.

        Raises:
            OriginError: As of ``run``.
            WorkerLostError: As of ``run``.
        """
        early: dict[int, Result] = {}
        turn = 0
        for number, _, result in self.run(work, tasks):
            early[number] = result
            while turn in early:
                yield early.pop(turn)
                turn += 1

    def __enter__(self) -> Self:
        """Start the workers."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the workers, at once after an error or Ctrl-C."""
        return


class SerialEngine(Engine):
    """Runs all tasks in this process, one after the other."""

    def run(
        self, work: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Result]]:
        """Yield each task with its result, in the order of the tasks."""
        for number, task in enumerate(tasks):
            yield Finished(number, task, work(task))


@dataclass
class _Flight(Generic[Task]):
    """A task on its way.

    Attributes:
        number: Number of the task, from 0.
        task: Task.
        lost: Number of workers that it has lost.
    """

    number: int
    task: Task
    lost: int = 0


class Reply(NamedTuple, Generic[Result]):
    """What a worker sends back.

    Attributes:
        origin: Origin of the worker.
        result: Result of the task.
    """

    origin: Origin
    result: Result


def answer(expected: Origin, work: Callable[[Task], Result], task: Task) -> Reply[Result]:
    """Run a task in a worker, if its code, models and packages are those of the driver.

    Args:
        expected: Origin of the process that hands out the tasks.
        work: Function to call.
        task: Its argument.

    Raises:
        OriginError: If the worker has another origin.
        OwnCodeError: If code of the user's own raises an error.
    """
    origin = here()
    origin.check(expected)
    try:
        return Reply(origin, work(task))
    except OSError as error:
        if error.strerror is None or origin.host == expected.host:
            raise
        # A full disk, or a file that only the driver's machine has.
        text = f"{error.strerror} (on {origin.host})"
        raise OSError(error.errno, text, error.filename) from error
    except Exception as error:
        # The traceback stays here: say which line of a user's own code it was.
        if (own := own_error(error)) is not None:
            raise own from error
        raise


class ParallelEngine(Engine):
    """Runs tasks in several workers: what processes and clusters have in common.

    A subclass submits a call, waits for calls and gives their replies; here is who runs when, and
    what happens when a worker is lost.
    """

    def __init__(self, workers: int, in_flight: int, tell: Tell) -> None:
        """Prepare.

        Args:
            workers: Number of tasks at a time.
            in_flight: Largest number of tasks that are handed out and not yet taken back.
            tell: Function that takes a line for people.
        """
        self.workers = workers
        self._in_flight, self._tell = in_flight, tell
        self._hosts: set[str] = set()

    @cached_property
    def origin(self) -> Origin:
        """Origin of this process, which every worker has to share."""
        return here()

    def run(
        self, work: Callable[[Task], Result], tasks: Iterable[Task]
    ) -> Iterator[Finished[Task, Result]]:
        """Yield each task once with its result, as soon as it is there; see ``Engine``."""
        shared = self._share(work)
        again: list[_Flight[Task]] = []
        fresh = (_Flight(number, task) for number, task in enumerate(tasks))
        flying: dict[Any, _Flight[Task]] = {}
        while True:
            self._hand_out(shared, again, fresh, flying)
            if not flying:
                return
            for call in self._wait(flying):
                flight = flying.pop(call)
                try:
                    reply: Reply[Result] = self._reply(call)
                except WorkerLostError as error:
                    again.append(self._again(flight, error))
                    continue
                self._greet(reply.origin)
                self._hand_out(shared, again, fresh, flying)  # Before the caller takes its time.
                yield Finished(flight.number, flight.task, reply.result)

    def _hand_out(
        self,
        shared: Any,  # noqa: ANN401 - as the subclass sends it.
        again: list[_Flight[Task]],
        fresh: Iterator[_Flight[Task]],
        flying: dict[Any, _Flight[Task]],
    ) -> None:
        """Hand out tasks, first those that run again, until enough are in flight."""
        while len(flying) < self._in_flight:
            flight = again.pop() if again else next(fresh, None)
            if flight is None:
                return
            flying[self._submit(shared, flight.task)] = flight

    def _share(self, work: Callable[[Task], Result]) -> Any:  # noqa: ANN401 - as the subclass sends it.
        """Return the work in the form that ``_submit`` takes, made once for all tasks."""
        return work

    @abstractmethod
    def _submit(self, work: Any, task: Any) -> Any:  # noqa: ANN401 - as the subclass sends it.
        """Hand out a task and return its call, which can be a key."""

    @abstractmethod
    def _wait(self, calls: Collection[Any]) -> Iterable[Any]:
        """Return the calls that are over, at least one."""

    @abstractmethod
    def _reply(self, call: Any) -> Reply[Any]:  # noqa: ANN401 - as the subclass sends it.
        """Return the reply of a call that is over, or raise the error of its work.

        Raises:
            WorkerLostError: If its worker ended before.
        """

    def _again(self, flight: _Flight[Task], error: WorkerLostError) -> _Flight[Task]:
        """Return a task that has lost its worker, to run again.

        Raises:
            WorkerLostError: If it has lost too many.
        """
        lost = flight.lost + 1
        name = f"task {flight.number + 1}"
        if lost == ATTEMPTS:
            raise WorkerLostError(
                f"{name}: expected a worker that finishes it, got {lost} that ended before: "
                f"{error}; free memory or take fewer --workers, and give the command again: what "
                "is done is kept"
            )
        self._tell(f"{name}: {error}; it runs again ({lost} of {ATTEMPTS - 1})")
        return _Flight(flight.number, flight.task, lost)

    def _greet(self, origin: Origin) -> None:
        """Tell of a worker's machine when it first sends a result."""
        if origin.host in self._hosts:
            return
        self._hosts.add(origin.host)
        if origin.host != self.origin.host:
            self._tell(f"results from {origin.host}: {origin.cpu}, commit {origin.commit}")
        if origin.cpu != self.origin.cpu:
            self._tell(
                f"note: {origin.host} has another processor than this machine "
                f"({self.origin.cpu}): last digits may differ"
            )
