"""Commands in processes of their own."""

import subprocess

import pytest

from andabata.bench.command import run_command


def test_the_output_of_a_command_is_returned():
    """Standard output alone, as text."""
    assert "natural-test" in run_command("world", "list")


def test_a_command_that_fails_raises():
    """The exit code is kept."""
    with pytest.raises(subprocess.CalledProcessError) as caught:
        run_command("no-such-verb")
    assert caught.value.returncode == 2
