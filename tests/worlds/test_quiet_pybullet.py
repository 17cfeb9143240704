"""The import of pybullet is silent, and errors beside it are not hidden."""

import os
import subprocess
import sys

import pytest

from tests.support.plants import module_needs_bullet

module_needs_bullet()

from worlds.quiet_pybullet import without_lines


def test_the_import_writes_nothing():
    """The robot's plant, and with it pybullet, is imported without a line on stdout or stderr."""
    code = "import andabata.machine.bullet_vehicle, sys; assert 'pybullet' in sys.modules"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_other_lines_and_errors_pass(capfd):
    """Only lines with the prefix are dropped, and an exception leaves stderr as it was."""

    def fail():
        os.write(2, b"build time: today\nwarning: other line\n")
        raise ImportError("broken library")

    with pytest.raises(ImportError, match="broken library"), without_lines(b"build time"):
        fail()
    os.write(2, b"build time: afterwards\n")
    assert capfd.readouterr().err == "warning: other line\nbuild time: afterwards\n"
