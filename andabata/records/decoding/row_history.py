"""The first readings of a session, by which its units are inferred."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from andabata.records.topics import Topic

_MOST_ROWS = 20_000
"""Number of rows per topic that are kept: some minutes."""


@dataclass
class RowHistory:
    """First rows of readings by topic, in the units in which they came.

    Attributes:
        kinds: Message types by topic.
    """

    kinds: dict[Topic, str] = field(default_factory=dict)
    _rows: dict[Topic, list[list[float]]] = field(default_factory=dict)

    def add(self, topic: Topic, row: list[float], kind: str) -> None:
        """Add a row.

        Args:
            topic: Topic of the readings.
            row: Stamp [s] and numbers.
            kind: Type of its message.
        """
        self.kinds[topic] = kind
        rows = self._rows.setdefault(topic, [])
        if len(rows) < _MOST_ROWS:
            rows.append(row)

    def count(self, topic: Topic) -> int:
        """Return the number of rows of a topic."""
        return len(self._rows.get(topic, ()))

    def seconds(self, topic: Topic) -> float:
        """Return the time that the rows of a topic span [s]."""
        rows = self._rows.get(topic)
        return rows[-1][0] - rows[0][0] if rows else 0.0

    def is_repeated(self, topic: Topic) -> bool:
        """Return whether most readings of a topic that share a stamp are equal: recorded twice."""
        rows = self.array(topic)
        if rows is None:
            return False
        same = np.diff(rows[:, 0]) == 0
        equal = (rows[1:] == rows[:-1]).all(axis=1)
        return bool(same.any()) and 2 * int(equal[same].sum()) > int(same.sum())

    def only(self, topic: Topic) -> "RowHistory":
        """Return the history of one topic alone."""
        return RowHistory({topic: self.kinds[topic]}, {topic: self._rows[topic]})

    def array(self, topic: Topic) -> NDArray[np.float64] | None:
        """Return the rows of a topic in order of time, shape (k, width), None without any."""
        rows = self._rows.get(topic)
        if not rows:
            return None
        sorted_rows = np.array(rows, dtype=np.float64)
        return sorted_rows[np.argsort(sorted_rows[:, 0], kind="stable")]
