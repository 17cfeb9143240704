"""Faults of sensors as values: which sense fails, how, when, for how long; their text form.

``andabata.machine.fault_injector`` applies them to readings.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple, Self

from pydantic import BeforeValidator, PlainSerializer

SENSES = ("laser", "gnss", "compass", "imu", "wheels")
"""Names of the senses, as in the causes of a localizer's health."""

FORM = "SENSE:KIND[=NUMBER][@ONSET[+DURATION]]"
"""Text form of a fault; times are in seconds."""

_TEXT = re.compile(r"([^:=@]+):([^:=@]+)(?:=([^@]*))?(?:@([^+]*)(?:\+(.*))?)?")


class FaultKind(NamedTuple):
    """Kind of fault.

    Attributes:
        meaning: Effect on the readings.
        parameter: Meaning of its number; empty for a kind that takes none.
        low: Smallest number.
        high: Largest number.
        default: Number of a fault that gives none; None where it has to be given.
    """

    meaning: str
    parameter: str = ""
    low: float = -math.inf
    high: float = math.inf
    default: float | None = None


_LEAST = 1e-9
"""Number that stands for a lower bound of more than zero."""

KINDS: Mapping[str, FaultKind] = MappingProxyType(
    {
        "off": FaultKind("nothing arrives"),
        "stuck": FaultKind("the last values repeat, with fresh stamps"),
        "garbage": FaultKind(
            "values become NaN, infinite or huge", "share of the values", _LEAST, 1.0, default=0.5
        ),
        "scale": FaultKind("values are multiplied, as in a wrong unit", "factor", -1e9, 1e9),
        "slow": FaultKind("only a share of the messages arrives, evenly", "share", _LEAST, 1.0),
        "delayed": FaultKind("messages arrive late, with their stamps", "seconds", _LEAST, 600.0),
        "intermittent": FaultKind(
            "nothing arrives in the first half of each period", "seconds of a period", 0.2, 600.0
        ),
        "jump": FaultKind("values are off by a constant", "offset", -1e6, 1e6),
    }
)
"""Kinds of faults by name."""

JUMPS: Mapping[str, str] = MappingProxyType(
    {
        "laser": "metres of range",
        "gnss": "metres to the north",
        "compass": "radians of heading",
        "imu": "rad/s of yaw rate",
        "wheels": "rad/s of each wheel",
    }
)
"""Meaning of the offset of a jump, by sense."""

_TYPICAL: Mapping[str, float | Mapping[str, float]] = MappingProxyType(
    {
        "garbage": 0.5,
        "scale": {"laser": 1.2, "gnss": 1.0001, "compass": 2.0, "imu": 2.0, "wheels": 2.0},
        "slow": 0.1,
        "delayed": 1.0,
        "intermittent": 4.0,
        "jump": {"laser": 0.5, "gnss": 50.0, "compass": 1.0, "imu": 0.3, "wheels": 2.0},
    }
)
"""Numbers of typical faults by kind, or by kind and sense (assumptions)."""


@dataclass(frozen=True)
class Fault:
    """Fault of one sense.

    Attributes:
        sense: Name of the sense, one of ``SENSES``.
        kind: Kind of the fault, one of ``KINDS``.
        value: Number of the kind, see ``KINDS`` and ``JUMPS``; None for a kind without one, or for
            its default.
        onset: Time at which it begins, from the start of the drive [s].
        duration: Time that it lasts [s]; None to the end of the drive.
    """

    sense: str
    kind: str
    value: float | None = None
    onset: float = 0.0
    duration: float | None = None

    def __post_init__(self) -> None:
        """Check all fields once, and fill in the default number.

        Raises:
            ValueError: If there is no such sense or kind, its number is missing, has no meaning or
                is out of bounds, or a time is negative.
        """
        _check_word(self.sense, SENSES, "sense")
        _check_word(self.kind, tuple(KINDS), "kind")
        if self.value is None:
            object.__setattr__(self, "value", KINDS[self.kind].default)
        self._check_number()
        if not 0.0 <= self.onset < math.inf:
            raise ValueError(
                f"{self._name}: expected an onset of 0 s or more, got {self.onset:g}; count it "
                "from the start of the drive"
            )
        if self.duration is not None and not 0.0 < self.duration < math.inf:
            raise ValueError(
                f"{self._name}: expected a duration of more than 0 s, got {self.duration:g}; leave "
                "it out for a fault that stays"
            )

    def _check_number(self) -> None:
        """Refuse a number that is missing, has no meaning, or is out of bounds.

        Raises:
            ValueError: If the number is one of these.
        """
        kind, value = KINDS[self.kind], self.value
        if not kind.parameter:
            if value is not None:
                raise ValueError(
                    f"{self._name}: expected no number, got {value:g}; leave out ={value:g}"
                )
            return
        meaning = JUMPS[self.sense] if self.kind == "jump" else kind.parameter
        if value is None:
            number = typical_value(self.sense, self.kind)
            raise ValueError(
                f"{self._name}: expected a number, {meaning}, got none; write "
                f"{self._name}={number:g}"
            )
        neutral = {"scale": 1.0, "slow": 1.0, "jump": 0.0}.get(self.kind)
        if not kind.low <= value <= kind.high or value == neutral:
            low = "above 0 and up" if kind.low == _LEAST else f"from {kind.low:g}"
            but = "" if neutral is None else f" other than {neutral:g}"
            raise ValueError(
                f"{self._name}: expected {meaning} {low} to {kind.high:g}{but}, got {value:g}"
            )

    @property
    def _name(self) -> str:
        """Sense and kind."""
        return f"{self.sense}:{self.kind}"

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the fault of a text of the form ``FORM``, such as ``gnss:jump=500@20+15``.

        Raises:
            ValueError: If the text has another form, or a part of it is wrong.
        """
        match = _TEXT.fullmatch("".join(text.split()))
        if match is None:
            raise ValueError(
                f"fault: expected {FORM}, such as gnss:stuck@20, got {text!r}; `andabata faults "
                "--list` has all senses and kinds"
            )
        sense, kind, value, onset, duration = match.groups()
        return cls(
            sense,
            kind,
            None if value is None else _number(value, text),
            0.0 if onset is None else _number(onset, text),
            None if duration is None else _number(duration, text),
        )

    def __str__(self) -> str:
        """Return the text form, which ``parse`` takes back."""
        text = self._name
        if self.value is not None:
            text += f"={_short(self.value)}"
        if self.onset or self.duration is not None:
            text += f"@{_short(self.onset)}"
        return text if self.duration is None else f"{text}+{_short(self.duration)}"

    def is_active(self, stamp: float) -> bool:
        """Return True at a time from its onset on, and before its end [s]."""
        end = math.inf if self.duration is None else self.onset + self.duration
        # Stamps are whole tenths as a rule, which sums of decimal numbers are not.
        return self.onset - 1e-9 <= stamp < end - 1e-9


def typical_value(sense: str, kind: str) -> float | None:
    """Return the number of a typical fault of a sense; None for a kind that takes none."""
    value = _TYPICAL.get(kind)
    return value[sense] if isinstance(value, Mapping) else value


def typical_faults(
    senses: Sequence[str], kinds: Sequence[str], onset: float, duration: float | None = None
) -> tuple[Fault, ...]:
    """Return a typical fault of each sense and kind.

    Args:
        senses: Names of senses.
        kinds: Kinds of faults.
        onset: Time at which they begin [s].
        duration: Time that they last [s]; None to the end.

    Raises:
        ValueError: If there is no such sense or kind, or a time is negative.
    """
    return tuple(
        Fault(sense, kind, typical_value(sense, kind) if kind in KINDS else None, onset, duration)
        for sense in senses
        for kind in kinds
    )


def as_fault(data: Any) -> Fault:  # noqa: ANN401 - what a file or an option holds.
    """Return the fault that a text or a table of a file stands for.

    Raises:
        ValueError: If it is neither, or a part of it is wrong.
    """
    if isinstance(data, Fault):
        return data
    if isinstance(data, str):
        return Fault.parse(data)
    known = [field.name for field in fields(Fault)]
    if not isinstance(data, Mapping) or not {"sense", "kind"} <= set(data) <= set(known):
        raise ValueError(
            f"fault: expected a text {FORM} or a table with sense, kind and perhaps value, onset, "
            f"duration, got {data!r}"
        )
    for name in ("value", "onset", "duration"):
        if isinstance(number := data.get(name, 0.0), bool) or not isinstance(number, int | float):
            raise ValueError(f"fault.{name}: expected a number, got {number!r}")
    return Fault(**data)


FaultSetting = Annotated[Fault, BeforeValidator(as_fault), PlainSerializer(str, return_type=str)]
"""Fault in a configuration: a text or a table in files, a text in JSON."""


def _check_word(word: str, known: Sequence[str], what: str) -> None:
    """Refuse a word that is none of the known ones.

    Raises:
        ValueError: If it is none.
    """
    if word not in known:
        raise ValueError(
            f"fault: expected a {what} of {', '.join(known)}, got {word!r}; `andabata faults "
            "--list` explains them"
        )


def _number(text: str, fault: str) -> float:
    """Return a number of a fault's text.

    Raises:
        ValueError: If it is no finite number.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"fault {fault}: expected {FORM} with numbers, got {text!r}")
    return number


def _short(number: float) -> str:
    """Return a number as the shortest text that gives it back."""
    return repr(number).removesuffix(".0").replace("e+", "e")
