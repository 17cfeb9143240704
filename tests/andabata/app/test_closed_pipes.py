"""Output into a pipe whose reader has left."""

import os
import subprocess
import sys

import pytest


def run(words, closed):
    """Run a command one or both of whose streams nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | dict.fromkeys(closed, writer)
    try:
        return subprocess.run([sys.executable, *words], check=False, timeout=60, **streams)
    finally:
        os.close(writer)


@pytest.mark.parametrize(
    ("words", "code"),
    [(["--help"], 0), (["world", "list", "--json"], 0), (["world", "list"], 0), (["fly"], 2)],
)
def test_a_closed_pipe_changes_neither_the_exit_code_nor_stderr(words, code):
    """Help, tables and JSON into it: no message, and the code that the command has elsewhere."""
    done = run(["-m", "andabata", *words], ["stdout"])
    error = b"error: No such command 'fly'.\n" if code else b""
    assert (done.returncode, done.stderr) == (code, error)


def test_errors_that_nobody_reads_keep_their_code():
    """Both streams are closed, as with ``2>&1 | true``."""
    assert run(["-m", "andabata", "fly"], ["stdout", "stderr"]).returncode == 2


def test_work_goes_on_after_its_reader_has_left(tmp_path):
    """What is written later is dropped, and the work itself is done; text keeps its encoding."""
    code = f"""
import sys
from andabata.app.closed_pipes import drop_unread_output
before = sys.stdout
drop_unread_output()
assert sys.stdout is not before
assert (sys.stdout.encoding, sys.stdout.errors) == (before.encoding, before.errors)
assert sys.stdout.isatty() == before.isatty()
for _ in range(3):
    print("\\u03b1" * 100_000, flush=True)
open({str(tmp_path / "done")!r}, "w").close()
"""
    done = run(["-c", code], ["stdout"])
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "done").exists()


def test_what_is_read_arrives_whole():
    """Text before and after the change of the stream comes in its order."""
    code = "import sys\nfrom andabata.app.closed_pipes import drop_unread_output\n"
    code += "print('a')\ndrop_unread_output()\nprint('b' * 200_000)\nprint('c')"
    done = run(["-c", code], [])
    assert (done.returncode, done.stdout) == (0, b"a\n" + b"b" * 200_000 + b"\nc\n")
