"""Processes: killed ones are replaced, and none outlives the one that began it."""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from andabata.engine_processes import ProcessEngine, open_pool, run_tasks
from terrain.compilation import on_first_compilation
from tests.support import engine_laws as laws
from tests.support.engine_work import compile_something, kill_the_worker_once, square

_PARENT = """
import os, time
from andabata.engine_processes import open_pool
if __name__ == "__main__":
    with open_pool(1) as pool:
        print(pool.submit(os.getpid).result(), flush=True)
        time.sleep(600)
"""

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


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


def test_a_worker_of_the_command_line_ends_without_a_word(monkeypatch):
    """Its parent ends it by SIGTERM, which it does not handle as the command line does."""
    monkeypatch.setattr(sys, "argv", ["andabata", "train"])
    with open_pool(1) as pool:
        handlers = [pool.submit(signal.getsignal, each).result() for each in _SIGNALS]
    assert handlers == [signal.SIG_IGN, signal.SIG_DFL]


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


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_killed_workers_lose_nothing(tmp_path, monkeypatch):
    """Processes that are killed are replaced, told and counted."""
    told = []
    with ProcessEngine(2, told.append) as engine:
        work = partial(kill_the_worker_once, str(tmp_path))
        laws.a_killed_worker_loses_nothing(engine, work, told)
        laws.a_task_that_kills_its_workers_ends_the_run(engine, told, monkeypatch)
        laws.a_worker_of_another_origin_is_refused(engine)


def test_several_workers_need_their_processes():
    """Without a ``with`` block several workers are refused."""
    with pytest.raises(ValueError, match="expected a `with` block for several workers"):
        list(ProcessEngine(2).map(square, [1]))


def test_processes_stay_between_maps():
    """Two maps have the same workers, none of them this process."""
    with ProcessEngine(2) as engine:
        workers = {pid for _ in range(2) for _, pid in engine.map(square, range(12))}
    assert os.getpid() not in workers
    assert len(workers) <= 2
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


def test_a_compilation_in_workers_is_told_once():
    """However many of them compile; where none does, nothing is told."""
    for work, told in ((square, 0), (compile_something, 1)):
        said = []
        on_first_compilation(lambda said=said: said.append("compiles"))
        with ProcessEngine(2) as engine:
            assert len(list(engine.map(work, range(6)))) == 6
        assert len(said) == told
