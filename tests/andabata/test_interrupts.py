"""Ctrl-C in the command line: quiet, with the exit code of an interrupt, wherever it comes."""

import signal
import subprocess
import sys
from itertools import count

import pytest

from andabata.interrupts import held_interrupts, is_command_line

_CUT = "import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n"
"""Module or code that gets Ctrl-C."""


def run(code, tmp_path, **modules):
    for name, text in modules.items():
        (tmp_path / f"{name}.py").write_text(text)
    head = f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n"
    head += "from andabata.interrupts import handle_interrupts; handle_interrupts()\n"
    words = [sys.executable, "-c", head + code]
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    "cut",
    [
        _CUT,
        f"try:\n    exec({_CUT!r})\nexcept BaseException:\n    raise ImportError('no') from None\n",
        f"exec({_CUT!r})",
    ],
    ids=["plain", "caught", "exec"],
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


def test_elsewhere_the_interrupt_is_raised_and_what_is_open_is_closed(tmp_path):
    """Blocks end in their order; a caught interrupt leaves no trace in the exit code."""
    code = f"""
import sys
try:
    try:
        exec({_CUT!r})
    finally:
        print("closed")
except KeyboardInterrupt:
    sys.exit(130)
"""
    done = run(code, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "closed\n", "")


def test_an_interrupt_in_a_destructor_is_raised_again(tmp_path):
    """It is not lost, and nothing is printed of it."""
    code = f"""
import time
class Cut:
    def __del__(self):
        exec({_CUT!r})
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


@pytest.mark.parametrize("words", [["-m", "andabata"], ["SCRIPT"]], ids=["module", "script"])
def test_the_command_is_quiet_from_its_first_import_on(tmp_path, words):
    """Gymnasium is what the package imports first: Ctrl-C there ends the command quietly."""
    (tmp_path / "gymnasium.py").write_text(_CUT)
    script = tmp_path / "andabata"
    script.write_text("import sys\nfrom andabata.app.cli import run\nrun()\n")
    head = f"import sys; sys.path.insert(0, {str(tmp_path)!r})"
    (tmp_path / "sitecustomize.py").write_text(head)
    import os

    path = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run(
        [sys.executable, *(str(script) if word == "SCRIPT" else word for word in words)],
        env=os.environ | {"PYTHONPATH": path},
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
