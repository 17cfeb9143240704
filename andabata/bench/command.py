"""Runs ``andabata`` commands in processes of their own, for benchmarks of whole commands."""

import subprocess
import sys


def run_command(*words: str) -> str:
    """Run one ``andabata`` command and return its standard output; messages pass through.

    Args:
        words: Words after the program's name.

    Raises:
        subprocess.CalledProcessError: If the command fails.
    """
    command = [sys.executable, "-m", "andabata", *words]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
