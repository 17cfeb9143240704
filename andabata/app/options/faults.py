"""Text of ``--faults`` to faults of senses, from options or a file."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from andabata.configuration.usage import UsageError

if TYPE_CHECKING:
    from andabata.machine.faults import Fault

FAULT_METAVAR = "SENSE:KIND[=N][@S[+S]],..."
"""Form of the option's value in the help."""

_OPTION, _SUFFIX = "--faults", ".toml"


@dataclass(frozen=True)
class FaultOptions:
    """Faults of the senses, all in one drive: ``--faults``."""

    faults: Annotated[
        str | None,
        typer.Option(
            metavar=FAULT_METAVAR,
            help="Faults of senses, such as gnss:stuck@20,laser:off@20+10, in seconds from the "
            "start, or a .toml file; `faults --list` explains them.",
        ),
    ] = None

    def read(self) -> "tuple[Fault, ...]":
        """Return the faults.

        Raises:
            UsageError: If one is none, or a file cannot be read.
        """
        return read_faults(self.faults)


def read_faults(text: str | None) -> "tuple[Fault, ...]":
    """Return the faults of an option.

    Args:
        text: Comma-separated faults and names of files; None for none.

    Raises:
        UsageError: If one is none or there twice, or a file cannot be read.
    """
    from andabata.machine.faults import Fault

    found: list[Fault] = []
    for word in () if text is None else map(str.strip, text.split(",")):
        if word.endswith(_SUFFIX):
            found += _of_file(Path(word))
            continue
        try:
            found.append(Fault.parse(word))
        except ValueError as error:
            raise UsageError(f"{_OPTION}: {error}") from error
    twice = next((fault for fault in found if found.count(fault) > 1), None)
    if twice is not None:
        raise UsageError(f"{_OPTION}: expected each fault once, got {twice} twice; leave one out")
    return tuple(found)


def _of_file(path: Path) -> "list[Fault]":
    """Return the faults of a file, ``faults = [...]`` of texts or tables.

    Raises:
        UsageError: If it cannot be read, or has something else.
    """
    import tomllib

    from andabata.machine.faults import as_fault

    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(
            f"{_OPTION} {path}: expected a readable file, got {error.strerror}"
        ) from error
    except ValueError as error:
        raise UsageError(f"{_OPTION} {path}: expected TOML, got {error}") from error
    listed = data.get("faults")
    if set(data) != {"faults"} or not isinstance(listed, list):
        raise UsageError(
            f'{_OPTION} {path}: expected faults = ["gnss:stuck@20", ...] alone, got '
            f"{', '.join(data) or 'nothing'}"
        )
    try:
        return [as_fault(each) for each in listed]
    except ValueError as error:
        raise UsageError(f"{_OPTION} {path}: {error}") from error


@dataclass(frozen=True)
class FaultMatrixOptions:
    """A typical fault of each sense and kind: ``--senses``, ``--kinds``, ``--onset``."""

    senses: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES", help="laser, gnss, compass, imu, wheels, comma-separated; all."
        ),
    ] = None
    kinds: Annotated[
        str | None,
        typer.Option(
            metavar="NAMES",
            help="off, stuck, garbage, scale, slow, delayed, intermittent, jump, comma-separated; "
            "all.",
        ),
    ] = None
    onset: Annotated[
        float,
        typer.Option(min=0.0, help="Time at which each fault begins, in seconds from the start."),
    ] = 20.0
    duration: Annotated[
        float | None,
        typer.Option(min=0.1, help="Time that each fault lasts, in seconds; to the end."),
    ] = None

    def text(self) -> str:
        """Return the faults as the text of ``--faults``.

        Raises:
            UsageError: If there is no such sense or kind, or a time is none.
        """
        from andabata.configuration.usage import words
        from andabata.machine.faults import KINDS, SENSES, typical_faults

        senses = SENSES if self.senses is None else words(self.senses, SENSES, "--senses")
        kinds = tuple(KINDS) if self.kinds is None else words(self.kinds, tuple(KINDS), "--kinds")
        try:
            faults = typical_faults(
                tuple(dict.fromkeys(senses)),
                tuple(dict.fromkeys(kinds)),
                self.onset,
                self.duration,
            )
        except ValueError as error:
            raise UsageError(str(error)) from error
        return ",".join(map(str, faults))
