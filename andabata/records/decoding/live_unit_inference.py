"""Inference of units in a live session: by the first readings, and again after turns."""

from collections.abc import Callable

from andabata.records import topics
from andabata.records.decoding.accepted_types import ALTERNATIVES
from andabata.records.decoding.row_history import RowHistory
from andabata.records.decoding.units import UnitError, UnitFactors
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.topics import Topic

_FIRST_ROWS = 25
"""Number of rows by which a sensor's unit is inferred; these are not used otherwise."""

_FIRST_SECONDS = 1.0
"""Time after which fewer rows of a slow sensor suffice [s]."""

_FEWEST_ROWS = 3
"""Number of rows that are needed in any case."""

_FIRST_REPEAT = 10.0
"""Time after which all units are inferred again, and after twice as long each time [s]."""


class LiveUnitInference:
    """Infers the units of a live session as its readings come in.

    Attributes:
        units: Factors to SI that were inferred so far.
    """

    def __init__(self, infer: Callable[[RowHistory], UnitFactors], units: UnitFactors) -> None:
        """Create an inference without readings.

        Args:
            infer: Function that infers units from a history.
            units: Factors until they are inferred.
        """
        self._infer = infer
        self.units = units
        self._inferred: set[Topic] = set()
        self._refused: dict[Topic, str] = {}
        self.restart()

    def restart(self) -> None:
        """Forget the readings; inferred units are kept."""
        self._history = RowHistory()
        self._next_repeat = _FIRST_REPEAT

    def accept(self, topic: Topic, row: list[float], kind: str) -> bool:
        """Add a row and return whether it may be used: its unit is known.

        Args:
            topic: Topic of the reading.
            row: Stamp [s] and numbers in their own unit.
            kind: Type of the message.

        Raises:
            UnusableMessageError: If no unit fits the sensor's readings.
        """
        if topic not in ALTERNATIVES:
            return True
        self._history.add(topic, row, kind)
        if topic not in self._inferred:
            self._infer_one(topic)
            return False
        if topic in self._refused:
            raise UnusableMessageError(self._refused[topic])
        # Only turns reveal the units of gyro and wheels, and they may come late.
        if topic is topics.IMU and self._history.seconds(topic) > self._next_repeat:
            self._next_repeat *= 2
            self._update(self._history, None)
        return True

    def _infer_one(self, topic: Topic) -> None:
        """Infer the units of one topic, once it has enough rows."""
        history = self._history
        if history.count(topic) < _FIRST_ROWS:
            short = history.seconds(topic) < _FIRST_SECONDS
            if short or history.count(topic) < _FEWEST_ROWS:
                return
        self._inferred.add(topic)
        self._update(history.only(topic), topic)

    def _update(self, history: RowHistory, topic: Topic | None) -> None:
        """Infer the units of a topic, or of all with None, from a history."""
        try:
            self.units = self._infer(history).merged_into(self.units, topic)
        except UnitError as error:
            self._refused[error.topic] = error.reason
