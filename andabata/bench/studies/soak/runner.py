"""Runs checks of promises, each in a process of its own that ends in time."""

import os
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from andabata.bench.studies.soak.outcome import Outcome
from andabata.bench.studies.soak.promise import Promise

_RESULT = "outcome.json"
"""File of the outcome in the folder of a check."""

_PATIENCE = 10.0
"""Time for which an interrupted check may clean up [s]."""


def run_apart(promise: Promise, count: int, folder: Path, time_limit: float) -> Outcome:
    """Run a check in a process of its own, and return its outcome.

    A check that hangs or whose process dies has failed; its files are kept.

    Args:
        promise: Promise.
        count: Number of trials.
        folder: Folder for its files, which is made anew, and removed if the promise was kept.
        time_limit: Time after which the process is ended [s].
    """
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "tmp").mkdir(parents=True)
    module = __name__.rpartition(".")[0] + ".check"
    words = [sys.executable, "-m", module, promise.name, str(count), str(folder)]
    environment = os.environ | {"TMPDIR": str(folder / "tmp"), "OMP_NUM_THREADS": "1"}
    with (folder / "output.txt").open("wb") as output:
        process = subprocess.Popen(
            words, env=environment, stdout=output, stderr=output, start_new_session=True
        )
        try:
            process.wait(time_limit)
            reason = f"its process ended with {process.returncode}"
        except subprocess.TimeoutExpired:
            reason = f"hangs: not done after {time_limit:.0f} s"
        finally:
            _end(process)
    outcome = _outcome(folder, reason)
    if not outcome.failed:
        shutil.rmtree(folder, ignore_errors=True)
    return outcome


def write_outcome(folder: Path, outcome: Outcome) -> None:
    """Write the outcome of a check for the process that waits for it."""
    (folder / _RESULT).write_text(outcome.model_dump_json(), encoding="utf-8")


def _outcome(folder: Path, reason: str) -> Outcome:
    """Return the outcome that a check has written, or a failure for a reason."""
    if (folder / _RESULT).is_file():
        return Outcome.model_validate_json((folder / _RESULT).read_bytes())
    lines = (folder / "output.txt").read_text("utf-8", "replace").splitlines()
    last = f": {lines[-1][:200]}" if lines else ""
    return Outcome(
        trials=0, figure="-", failed=1, failures=(f"{reason}{last}; files kept in {folder}",)
    )


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a process with all that it has started."""
    if process.poll() is None:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGTERM)
        with suppress(subprocess.TimeoutExpired):
            process.wait(_PATIENCE)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
