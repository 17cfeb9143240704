"""Promise of reliability: what is promised, how often it is checked, and where its limit is."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from andabata.bench.studies.soak.outcome import Check, Outcome

SHORT_MINUTES = 10.0
"""Time for which the numbers of the short version are chosen, on two cores [minutes]."""


class Promise(NamedTuple):
    """Promise, and the check of it.

    Attributes:
        name: Name on the command line.
        words: Text of the promise.
        check: Module of this package and function in it, as ``module:function``.
        unit: Name of a trial in the plural.
        short: Number of trials of the short version.
        full: Number of trials of the full version.
        limit: Limit of the figure in words.
        hours: Time after which the check is ended in the full version [h].
        least: Number of trials below which the check could not fail.
    """

    name: str
    words: str
    check: str
    unit: str
    short: int
    full: int
    limit: str
    hours: float = 1.0
    least: int = 1

    def count(self, minutes: float | None) -> int:
        """Return the number of trials for a time, None for the full version [minutes]."""
        if minutes is None:
            return self.full
        return max(self.least, min(self.full, round(self.short * minutes / SHORT_MINUTES)))

    def time_limit(self, minutes: float | None) -> float:
        """Return the time after which the check is ended [s]: it hangs."""
        return 3600.0 * self.hours if minutes is None else 60.0 * max(minutes, 5.0)

    def run(self, count: int, folder: Path) -> Outcome:
        """Run the check.

        Args:
            count: Number of trials.
            folder: Empty folder for its files.
        """
        module, _, function = self.check.partition(":")
        check: Check = getattr(import_module(f"{__package__}.{module}"), function)
        return check(count, folder)

    def row(self, outcome: Outcome, count: int) -> Mapping[str, Any]:
        """Return the row of a table: promise, numbers of trials, figure, limit and verdict.

        Args:
            outcome: Outcome of the check.
            count: Number of trials that it was asked for.
        """
        return {
            "promise": self.words,
            "checked": "-" if outcome.skipped else f"{count:,} {self.unit}",
            "in_full": f"{self.full:,} {self.unit}",
            "figure": outcome.figure or "-",
            "limit": self.limit,
            "kept": outcome.verdict,
        }
