"""Outcome of the check of a promise: trials, what was measured, and the trials that failed."""

import hashlib
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from pydantic import BaseModel, ConfigDict

_SHOWN = 5
"""Number of failures that an outcome describes; all are counted."""


class Outcome(BaseModel):
    """Outcome of a check.

    Attributes:
        trials: Number of trials that were run.
        figure: Measured figure in words.
        failed: Number of trials that failed.
        failures: Descriptions of the first of them.
        skipped: Reason why nothing was checked; empty if it was.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trials: int
    figure: str
    failed: int = 0
    failures: tuple[str, ...] = ()
    skipped: str = ""

    @property
    def verdict(self) -> str:
        """Word for a table: whether the promise was kept."""
        if self.skipped:
            return f"not run: {self.skipped}"
        return "no" if self.failed else "yes"


Check = Callable[[int, Path], Outcome]
"""Check of a promise: takes the number of trials and an empty folder for its files."""


def not_run(reason: str) -> Outcome:
    """Return the outcome of a check that could not be run."""
    return Outcome(trials=0, figure="", skipped=reason)


class Tally:
    """Count of trials, of what came of them, and of those that failed.

    Attributes:
        trials: Number of trials.
        results: Number of trials by their result, in words.
        failures: Descriptions of the trials that failed.
    """

    def __init__(self) -> None:
        """Begin without a trial."""
        self.trials = 0
        self.results = Counter[str]()
        self.failures: list[str] = []

    def add(self, result: str) -> None:
        """Count a trial with its result."""
        self.trials += 1
        self.results[result] += 1

    def fail(self, description: str) -> None:
        """Record that a trial failed."""
        self.failures.append(description)

    def expect(self, holds: bool, description: str) -> None:
        """Record a failure unless something holds."""
        if not holds:
            self.fail(description)

    @contextmanager
    def guarded(self, trial: str, data: bytes = b"", folder: Path | None = None) -> Iterator[None]:
        """Record any exception of a trial as its failure, and keep the input that raised it.

        Args:
            trial: Description of the trial.
            data: Input of the trial.
            folder: Folder in which such inputs are kept, or None.
        """
        try:
            yield
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            text = (str(error).splitlines() or [""])[0][:200]
            place = f"{Path(where.filename).name}:{where.lineno}"
            kept = "" if folder is None else f", kept as {kept_input(folder, data)}"
            self.fail(f"{trial}: {type(error).__name__} at {place}: {text}{kept}")

    def outcome(self, figure: str = "") -> Outcome:
        """Return the outcome.

        Args:
            figure: Measured figure in words; empty for the numbers of each result.
        """
        parts = (f"{count:,} {result}" for result, count in sorted(self.results.items()))
        return Outcome(
            trials=self.trials,
            figure=figure or ", ".join(parts),
            failed=len(self.failures),
            failures=tuple(self.failures[:_SHOWN]),
        )


def kept_input(folder: Path, data: bytes) -> Path:
    """Write an input that failed to a folder, named after its SHA-256, and return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"failed-{hashlib.sha256(data).hexdigest()[:12]}"
    path.write_bytes(data)
    return path
