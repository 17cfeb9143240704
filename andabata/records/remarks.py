"""Remarks on a recording or a live session: what was taken otherwise than it says, or left out."""

from dataclasses import dataclass, replace
from typing import Any

_MOST_TEXTS = 12
"""Different texts that are kept for one sense: a message that quotes numbers must not fill memory.
"""

_OTHERS = "for other reasons"


@dataclass(frozen=True)
class Remark:
    """One remark on one sense, however often it was made.

    Attributes:
        sense: Name of the topic.
        text: What was found, on one line.
        count: Number of messages that it was made of; 0 for one on the whole session.
        first: Time of the first of them [s], None where no time belongs to it.
        last: Time of the last [s].
        refused: Whether the messages were left out.
    """

    sense: str
    text: str
    count: int = 0
    first: float | None = None
    last: float | None = None
    refused: bool = False

    def __str__(self) -> str:
        """Return the remark on one line."""
        if not self.count:
            return f"{self.sense}: {self.text}"
        left_out = " left out" if self.refused else ""
        when = "" if self.first is None else f", {_span(self.first, self.last)}"
        return f"{self.sense}: {self.count}{left_out}: {self.text}{when}"

    def as_dict(self) -> dict[str, Any]:
        """Return the remark, ready for JSON."""
        return {
            "sense": self.sense,
            "text": self.text,
            "count": self.count,
            "first_s": self.first,
            "last_s": self.last,
            "refused": self.refused,
        }


class Remarks:
    """Remarks by sense and text, counted, with the times of the first and the last."""

    def __init__(self) -> None:
        """Begin without any."""
        self._found: dict[tuple[str, str, bool], Remark] = {}

    def note(self, sense: str, text: str) -> None:
        """Remember what holds for a whole session; saying it again changes nothing."""
        self._found.setdefault((sense, text, False), Remark(sense, text))

    def count(self, sense: str, text: str, stamp: float | None = None, number: int = 1) -> None:
        """Count messages that were taken in another way than they came.

        Args:
            sense: Name of the topic.
            text: What was done with them.
            stamp: Their time [s].
            number: How many they are.
        """
        self._count(sense, text, stamp, number, refused=False)

    def refuse(self, sense: str, reason: str, stamp: float | None = None, number: int = 1) -> None:
        """Count messages that were left out, by reason; see ``count``."""
        self._count(sense, reason, stamp, number, refused=True)

    def _count(
        self, sense: str, text: str, stamp: float | None, number: int, refused: bool
    ) -> None:
        known = sum(key[0] == sense for key in self._found)
        if (sense, text, refused) not in self._found and known >= _MOST_TEXTS:
            text = _OTHERS
        key = (sense, text, refused)
        old = self._found.get(key, Remark(sense, text, refused=refused))
        first = stamp if old.first is None else old.first
        last = old.last if stamp is None else stamp
        self._found[key] = replace(old, count=old.count + number, first=first, last=last)

    @property
    def texts(self) -> tuple[str, ...]:
        """The remarks, one line each, those on whole sessions first."""
        return tuple(str(remark) for remark in self._sorted())

    @property
    def refused(self) -> int:
        """Number of messages that were left out."""
        return sum(remark.count for remark in self._found.values() if remark.refused)

    def refused_by_reason(self) -> dict[str, dict[str, int]]:
        """Return the numbers of messages that were left out, by sense and reason."""
        found: dict[str, dict[str, int]] = {}
        for remark in self._sorted():
            if remark.refused:
                found.setdefault(remark.sense, {})[remark.text] = remark.count
        return found

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return the remarks, ready for JSON."""
        return [remark.as_dict() for remark in self._sorted()]

    def _sorted(self) -> list[Remark]:
        return sorted(self._found.values(), key=lambda remark: remark.count > 0)


def _span(first: float, last: float | None) -> str:
    """Return when something was, in words."""
    if last is None or last - first < 0.05:
        return f"at {first:.1f} s"
    return f"from {first:.1f} to {last:.1f} s"
