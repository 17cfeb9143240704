"""Filter of readings that injects faults of sensors; the true state is never touched."""

from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from andabata.machine.fault_signals import SIGNALS, Signal, Values
from andabata.machine.faults import Fault
from andabata.machine.sensor_readings import SensorReadings

_GARBAGE = (np.nan, np.inf, -np.inf, 1e30, -1e30)
"""Values that take the place of those that become garbage."""


class FaultInjector:
    """Readings filter with faults, each of which acts on the readings that the one before leaves.

    Readings outside of the faults' times, and senses without a fault, are passed on untouched.
    """

    def __init__(self, faults: Sequence[Fault], rng: np.random.Generator) -> None:
        """Begin a drive.

        Args:
            faults: Faults.
            rng: Source of garbage.
        """
        self._faults = tuple(faults)
        self.reset(rng)

    def reset(self, rng: np.random.Generator) -> None:
        """Begin another drive, whose stamps begin again.

        Args:
            rng: Source of garbage, of which each fault takes a stream of its own.
        """
        streams = rng.spawn(len(self._faults))
        self._effects = [
            _Effect(fault, signal, stream)
            for fault, stream in zip(self._faults, streams, strict=True)
            for signal in SIGNALS[fault.sense]
        ]

    def __call__(self, readings: SensorReadings) -> SensorReadings:
        """Return the readings with the faults that are active at their stamp.

        Args:
            readings: Readings of a control period.
        """
        for effect in self._effects:
            readings = effect(readings)
        return readings


class _Effect:
    """Fault of one signal, with what it remembers of the messages before."""

    def __init__(self, fault: Fault, signal: Signal[Any], rng: np.random.Generator) -> None:
        """Begin a drive with a fault of a signal."""
        self._fault, self._signal, self._rng = fault, signal, rng
        self._value = 0.0 if fault.value is None else fault.value
        self._last: Any = None
        self._count = 0
        self._waiting: deque[tuple[float, Any]] = deque()
        effects: dict[str, Callable[[Any, float], Any]] = {
            "off": lambda batch, stamp: None,
            "stuck": self._stuck,
            "garbage": lambda batch, stamp: signal.change(batch, self._garbage),
            "scale": lambda batch, stamp: signal.scale(batch, self._value),
            "slow": self._slow,
            "intermittent": self._intermittent,
            "jump": lambda batch, stamp: signal.shift(batch, self._value),
        }
        self._effect = effects.get(fault.kind)

    def __call__(self, readings: SensorReadings) -> SensorReadings:
        """Return readings with the fault, if it is active."""
        batch = self._signal.take(readings)
        if not self._fault.is_active(readings.stamp):
            self._last = self._last if batch is None else batch
            return readings
        if self._effect is None:
            return self._delayed(readings, batch)
        if batch is None:
            return readings
        return self._signal.put(readings, self._effect(batch, readings.stamp))

    def _stuck(self, batch: Any, stamp: float) -> Any:  # noqa: ANN401 - a batch of the signal.
        """Return the last message before the fault again; without one the first in it."""
        if self._last is None:
            first = np.arange(self._signal.count(batch)) == 0
            self._last = self._signal.select(batch, first)
        return self._signal.repeat(self._last, batch)

    def _garbage(self, values: Values) -> Values:
        """Return values a share of which is not finite, or huge."""
        is_bad = self._rng.random(values.shape) < self._value
        return np.where(is_bad, self._rng.choice(_GARBAGE, values.shape), values)

    def _slow(self, batch: Any, stamp: float) -> Any:  # noqa: ANN401 - a batch of the signal.
        """Return an even share of the messages, None for none of a batch."""
        numbers = self._count + np.arange(self._signal.count(batch) + 1)
        self._count = int(numbers[-1])
        # The n-th message is kept in which the share of n passes a whole number.
        kept = np.diff(np.floor(numbers * self._value + 1e-9)) > 0
        return self._signal.select(batch, kept) if kept.any() else None

    def _intermittent(self, batch: Any, stamp: float) -> Any:  # noqa: ANN401 - a batch.
        """Return the batch in the second half of each period."""
        phase = (stamp - self._fault.onset + 1e-9) % self._value
        return batch if phase >= self._value / 2 else None

    def _delayed(self, readings: SensorReadings, batch: Any) -> SensorReadings:  # noqa: ANN401
        """Return readings with what was sent a time ago; the rest waits, and is lost at the end."""
        if batch is not None:
            self._waiting.append((readings.stamp + self._value, batch))
        due = []
        while self._waiting and self._waiting[0][0] <= readings.stamp + 1e-9:
            due.append(self._waiting.popleft()[1])
        if batch is None and not due:
            return readings
        return self._signal.put(readings, self._signal.join(due) if due else None)
