"""Work for the workers of engines, which have to be able to import it."""

import os
import signal
from pathlib import Path

from terrain.compilation import compilation_begins


def square(number):
    return number * number, os.getpid()


def later_first(number):
    """Return the number after as much work as the later tasks have less."""
    total = 0
    for k in range(200_000 * (3 - number)):
        total += k
    return number


def fail(number):
    raise ArithmeticError(f"task {number}")


def kill_the_worker(number):
    os.kill(os.getpid(), signal.SIGKILL)


def kill_the_worker_once(folder, number):
    """Leave a mark and kill this process on the first call with 3; return the number's square."""
    if number == 3:
        try:
            (Path(folder) / "killed").touch(exist_ok=False)
        except FileExistsError:
            return 9
        kill_the_worker(number)
    return number * number


class Unreadable:
    """A task that only the process that made it can read."""

    def __reduce__(self):
        return read_here, (os.getpid(),)


def read_here(pid):
    if pid != os.getpid():
        raise ModuleNotFoundError("no module that is only there")
    return Unreadable()


def threads_of_the_worker(number):
    return os.environ.get("OMP_NUM_THREADS")


def compile_something(number):
    """Say that a compilation begins, as the compiler does."""
    compilation_begins()
    return number
