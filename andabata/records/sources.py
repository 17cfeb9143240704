"""Sources of one thing: a frame, or the readings of a topic, that several nodes publish.

One rule holds for all of them. Two sources of one thing are always reported, in one remark. Where
their values differ by more than the bound of their kind, the thing is refused with both values: no
number says which of the two is right, so the user has to choose.

| kind | bound |
|---|---|
| frame | 5 cm or 3 degrees |
| angular velocity of an IMU | 0.2 rad/s in the median |
| specific force of an IMU, field of a compass | 15 degrees in the median |
| fixes | 5 m in the median |
| wheel speeds, where neither is zero | 1 rad/s in the median |
"""

from collections import Counter
from dataclasses import dataclass, field
from statistics import median

MOST_NAMED = 8
"""Number of frames or sources that a remark names."""

_KEPT = 500
"""Number of differences of which the median is taken."""


@dataclass(frozen=True)
class SourceDifference:
    """Difference of two values of one thing.

    Attributes:
        share: Size as a share of the bound of its kind; above 1 the two contradict each other.
        text: Size with its unit.
    """

    share: float
    text: str


@dataclass
class Sources:
    """Sources of one thing, with the differences between their values.

    Attributes:
        counts: Number of messages by source.
        enough: Number of differences by which sources are judged.
    """

    enough: int = 1
    counts: Counter[str] = field(default_factory=Counter)
    _differences: list[SourceDifference] = field(default_factory=list)

    def add(self, source: str, difference: SourceDifference | None = None) -> None:
        """Add a message of a source.

        Args:
            source: Name of the source: topic, node or frame.
            difference: Difference from the value of another source; None without one to compare.
        """
        self.counts[source] += 1
        if difference is not None and len(self._differences) < _KEPT:
            self._differences.append(difference)

    @property
    def is_shared(self) -> bool:
        """True if there are two sources or more."""
        return len(self.counts) > 1

    @property
    def difference(self) -> SourceDifference | None:
        """Median difference; None before there are enough of them."""
        if len(self._differences) < self.enough:
            return None
        middle = median(each.share for each in self._differences)
        return min(self._differences, key=lambda each: abs(each.share - middle))

    @property
    def contradiction(self) -> str | None:
        """Size of the difference in words where the sources contradict each other, else None."""
        difference = self.difference
        return None if difference is None or not difference.share > 1 else difference.text

    @property
    def names(self) -> str:
        """Names of the sources with their numbers of messages, in words."""
        shown = self.counts.most_common(MOST_NAMED)
        return " and ".join(f"{name} ({count} messages)" for name, count in shown)
