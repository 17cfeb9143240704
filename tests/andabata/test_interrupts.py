"""Ctrl-C and SIGTERM in the command line: quiet, with one exit code, wherever they come."""

import os
import signal
import subprocess
import sys
from itertools import count

import pytest

from andabata.interrupts import held_interrupts, is_command_line

_CUT = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n"
"""Module or code that gets Ctrl-C."""


_TERM = _CUT.replace("SIGINT", "SIGTERM")


def _path(folder):
    """Return Python's path with a folder before it."""
    return os.pathsep.join([str(folder), *sys.path])


def run(code, tmp_path, env=None, **modules):
    for name, text in modules.items():
        (tmp_path / f"{name}.py").write_text(text)
    head = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
    head += "from andabata.interrupts import handle_interrupts; handle_interrupts()\n"
    words = [sys.executable, "-c", head + code]
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=60, env=env)


@pytest.mark.parametrize(
    "cut",
    [
        _CUT,
        f"try:\n    exec({_CUT!r})\nexcept BaseException:\n    raise ImportError('no') from None\n",
        f"exec({_CUT!r})",
        _TERM,
    ],
    ids=["plain", "caught", "exec", "term"],
)
def test_within_an_import_the_process_ends_at_once(tmp_path, cut):
    """Whatever the imported module makes of it, there is one line and exit code 130."""
    code = "try:\n    import cut\nexcept BaseException as error:\n    print(error)\nprint('on')"
    done = run(code, tmp_path, cut=cut)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_the_line_is_written_though_an_import_has_replaced_stderr(tmp_path):
    """pybullet's import captures the descriptor."""
    cut = f"import os\nos.dup2(os.open(os.devnull, os.O_WRONLY), 2)\n{_CUT}"
    done = run("import cut", tmp_path, cut=cut)
    assert (done.returncode, done.stderr) == (130, "interrupted\n")


@pytest.mark.parametrize("cut", [_CUT, _TERM], ids=["ctrl-c", "term"])
def test_elsewhere_the_interrupt_is_raised_and_what_is_open_is_closed(tmp_path, cut):
    """Blocks end in their order; a caught interrupt leaves no trace in the exit code."""
    code = f"""
import sys
try:
    try:
        exec({cut!r})
    finally:
        print("closed")
except KeyboardInterrupt:
    sys.exit(130)
"""
    done = run(code, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "closed\n", "")


@pytest.mark.parametrize("cut", [_CUT, _TERM], ids=["ctrl-c", "term"])
def test_an_interrupt_in_a_destructor_is_raised_again(tmp_path, cut):
    """It is not lost, and nothing is printed of it."""
    code = f"""
import time
class Cut:
    def __del__(self):
        exec({cut!r})
try:
    Cut()
    time.sleep(30)
except KeyboardInterrupt:
    print("again")
"""
    done = run(code, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "again\n", "")


def test_a_signal_that_is_ignored_stays_ignored(tmp_path):
    """As in a shell's background job."""
    code = f"""
import signal, subprocess, sys
signal.signal(signal.SIGINT, signal.SIG_IGN)
handle_interrupts()
exec({_CUT!r})
print("on")
"""
    assert run(code, tmp_path).stdout == "on\n"


def test_a_job_in_the_background_is_ended_by_sigterm(tmp_path):
    """A shell lets it ignore Ctrl-C; SIGTERM still closes what is open."""
    head = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n"
    (tmp_path / "sitecustomize.py").write_text(head)
    code = f"try:\n    exec({_TERM!r})\nfinally:\n    print('closed')"
    done = run(code, tmp_path, env=os.environ | {"PYTHONPATH": _path(tmp_path)})
    assert done.stdout == "closed\n"


def test_workers_are_ended_by_their_parent_as_ever(tmp_path):
    """A process of a pool keeps the system's handler of SIGTERM, which ends it at once."""
    (tmp_path / "work.py").write_text(
        "import signal\nfrom andabata.interrupts import handle_interrupts\n"
        "def handler(_):\n    handle_interrupts()\n    return signal.getsignal(signal.SIGTERM)\n"
    )
    code = """
import multiprocessing, signal, work
with multiprocessing.get_context("spawn").Pool(1) as pool:
    assert pool.map(work.handler, [0]) == [signal.SIG_DFL]
print("ended")
"""
    done = run(code, tmp_path)
    assert (done.stdout, done.stderr) == ("ended\n", "")


@pytest.mark.parametrize("words", [["-m", "andabata"], ["SCRIPT"]], ids=["module", "script"])
def test_the_command_is_quiet_from_its_first_import_on(tmp_path, words):
    """Gymnasium is what the package imports first: Ctrl-C there ends the command quietly."""
    (tmp_path / "gymnasium.py").write_text(_CUT)
    script = tmp_path / "andabata"
    script.write_text("import sys\nfrom andabata.app.cli import run\nrun()\n")
    head = f"import sys; sys.path.insert(0, {str(tmp_path)!r})"
    (tmp_path / "sitecustomize.py").write_text(head)
    done = subprocess.run(
        [sys.executable, *(str(script) if word == "SCRIPT" else word for word in words)],
        env=os.environ | {"PYTHONPATH": _path(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_other_programs_keep_their_handler():
    """Only the command line ends at imports; here tests run."""
    assert not is_command_line()


def test_processes_that_start_in_a_held_block_never_get_it():
    """The parent gets it at the end of the block; its child does not."""
    code = "import signal; print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))"
    seen = count()
    before = signal.signal(signal.SIGINT, lambda *_: next(seen))
    try:
        with held_interrupts():
            signal.raise_signal(signal.SIGINT)
            done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
            assert next(seen) == 0
        assert next(seen) == 2
    finally:
        signal.signal(signal.SIGINT, before)
    assert done.stdout.strip() == b"True"
