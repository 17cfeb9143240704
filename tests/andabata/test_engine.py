"""The engine: results in the order of the tasks, and no process outlives the one that began it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from andabata.engine import Engine, open_pool, run_tasks

_PARENT = """
import os, time
from andabata.engine import open_pool
if __name__ == "__main__":
    with open_pool(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(600)
"""


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    if not Path("/proc/self").exists():
        return True
    try:  # Orphans that are not reaped stand there as Z.
        return ") Z " not in Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
@pytest.mark.parametrize("death", ["SIGKILL", "SIGTERM"])
def test_a_killed_run_leaves_no_process_behind(tmp_path, death):
    """The workers of a run that was killed end by themselves."""
    script = tmp_path / "parent.py"
    script.write_text(_PARENT)
    environment = os.environ | {"PYTHONPATH": os.getcwd()}
    command = [sys.executable, str(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as parent:
        worker = int(parent.stdout.readline())
        assert is_alive(worker)
        parent.send_signal(getattr(signal, death))
        parent.wait()
    for _ in range(600):
        if not is_alive(worker):
            break
        time.sleep(0.1)
    assert not is_alive(worker)


def test_workers_of_a_training_run_load_no_torch():
    """Policies are compiled: workers save the hundred megabytes of torch."""
    code = (
        "import sys; import andabata.training.parallel_sampler;"
        "from andabata.models import Models; Models();"
        "sys.exit('torch' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


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


def test_one_worker_works_here():
    """One worker needs no ``with`` block and no process; results come as they are asked for."""
    seen = []
    found = Engine(1).map(lambda number: seen.append(number) or number * number, range(4))
    assert next(found) == 0
    assert seen == [0]
    assert list(found) == [1, 4, 9]


def test_several_workers_need_their_processes():
    """Without a ``with`` block several workers are refused."""
    with pytest.raises(ValueError, match="expected a `with` block for several workers"):
        list(Engine(2).map(square, [1]))


def test_results_come_in_the_order_of_the_tasks():
    """Two processes give what one gives, in the order of the tasks, and stay between maps."""
    with Engine(2) as engine:
        first = list(engine.map(square, range(12)))
        assert [number for number, _ in first] == [k * k for k in range(12)]
        again = list(engine.map(square, range(3, 15)))
        assert [number for number, _ in again] == [k * k for k in range(3, 15)]
        workers = {pid for _, pid in first + again}
        assert os.getpid() not in workers
        assert len(workers) <= 2
        assert list(engine.map(later_first, range(4))) == [0, 1, 2, 3]
        with pytest.raises(ArithmeticError, match="task 5"):
            list(engine.map(fail, [5]))
    with pytest.raises(ValueError, match="expected a `with` block"):
        list(engine.map(square, [1]))


def test_tasks_come_with_their_results():
    """``run_tasks`` pairs each task with its own result."""
    found = list(run_tasks(abs, (number for number in (-3, 1, -2)), 1))
    assert found == [(-3, 3), (1, 1), (-2, 2)]


def test_an_error_ends_the_processes():
    """A pool that is left by an error has ended its processes."""
    pids = []

    def interrupted():
        with open_pool(1) as pool:
            pids.append(pool.submit(os.getpid).result())
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert not is_alive(pids[0])
