"""Remarks on a recording or a live session: counted corrections, refusals and notes."""

from dataclasses import dataclass, replace
from typing import Any

_MOST_TEXTS = 12
"""Number of different texts that are kept per subject: texts with numbers must not fill memory."""

_OTHERS = "for other reasons"


@dataclass(frozen=True)
class Remark:
    """One remark on one subject, with the number of messages that it holds for.

    Attributes:
        subject: Name of the topic, or another source such as ``clock``.
        text: Finding, on one line.
        count: Number of its messages; 0 for a note on the whole session.
        first: Time of the first message [s], None without a time.
        last: Time of the last message [s].
        refused: True if the messages were left out.
        is_failure: True if a check failed: results may be wrong.
    """

    subject: str
    text: str
    count: int = 0
    first: float | None = None
    last: float | None = None
    refused: bool = False
    is_failure: bool = False

    def __str__(self) -> str:
        """Return the remark on one line."""
        if not self.count:
            return f"{self.subject}: {self.text}"
        left_out = " left out" if self.refused else ""
        when = "" if self.first is None else f", {_span(self.first, self.last)}"
        return f"{self.subject}: {self.count}{left_out}: {self.text}{when}"

    def as_dict(self) -> dict[str, Any]:
        """Return the remark, ready for JSON."""
        return {
            "subject": self.subject,
            "text": self.text,
            "count": self.count,
            "first_s": self.first,
            "last_s": self.last,
            "refused": self.refused,
            "is_failure": self.is_failure,
        }


class Remarks:
    """Collects remarks by subject and text, with counts and times."""

    def __init__(self) -> None:
        """Create an empty collection."""
        self._found: dict[tuple[str, str, bool], Remark] = {}

    def note(self, subject: str, text: str) -> None:
        """Add a note on a whole session; a repetition changes nothing."""
        self._found.setdefault((subject, text, False), Remark(subject, text))

    def fail(self, subject: str, text: str) -> None:
        """Add a note on a check that failed; a repetition changes nothing."""
        self._found.setdefault((subject, text, False), Remark(subject, text, is_failure=True))

    @property
    def has_failures(self) -> bool:
        """True if a check failed."""
        return bool(self.failures)

    @property
    def failures(self) -> tuple[str, ...]:
        """Checks that failed, one line each."""
        return tuple(str(remark) for remark in self._sorted() if remark.is_failure)

    def count(self, subject: str, text: str, stamp: float | None = None, number: int = 1) -> None:
        """Count messages that were corrected.

        Args:
            subject: Name of the topic.
            text: Correction, on one line.
            stamp: Time of the messages [s].
            number: Number of messages.
        """
        self._count(subject, text, stamp, number, refused=False)

    def refuse(
        self, subject: str, reason: str, stamp: float | None = None, number: int = 1
    ) -> None:
        """Count messages that were left out, by reason; see ``count``."""
        self._count(subject, reason, stamp, number, refused=True)

    def _count(
        self, subject: str, text: str, stamp: float | None, number: int, refused: bool
    ) -> None:
        """Add to the count of a remark; beyond the most texts of a subject, to a common one."""
        known = sum(key[0] == subject for key in self._found)
        if (subject, text, refused) not in self._found and known >= _MOST_TEXTS:
            text = _OTHERS
        key = (subject, text, refused)
        old = self._found.get(key, Remark(subject, text, refused=refused))
        first = stamp if old.first is None else old.first
        last = old.last if stamp is None else stamp
        self._found[key] = replace(old, count=old.count + number, first=first, last=last)

    @property
    def texts(self) -> tuple[str, ...]:
        """Remarks as text, one line each, notes on whole sessions first."""
        return tuple(str(remark) for remark in self._sorted())

    @property
    def refused(self) -> int:
        """Number of messages that were left out."""
        return sum(remark.count for remark in self._found.values() if remark.refused)

    def refused_by_reason(self) -> dict[str, dict[str, int]]:
        """Return the numbers of messages that were left out, by subject and reason."""
        counts: dict[str, dict[str, int]] = {}
        for remark in self._sorted():
            if remark.refused:
                counts.setdefault(remark.subject, {})[remark.text] = remark.count
        return counts

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return the remarks, ready for JSON."""
        return [remark.as_dict() for remark in self._sorted()]

    def _sorted(self) -> list[Remark]:
        """Return notes, then counted remarks, each in the order of their first."""
        return sorted(self._found.values(), key=lambda remark: remark.count > 0)


def _span(first: float, last: float | None) -> str:
    """Return a time span [s] as text."""
    if last is None or last - first < 0.05:
        return f"at {first:.1f} s"
    return f"from {first:.1f} to {last:.1f} s"
