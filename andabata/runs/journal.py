"""Journal of a run: finished pieces in a file, so that a killed run goes on."""

import json
import zlib
from pathlib import Path
from typing import Any

from andabata.runs import atomic_io
from andabata.runs.atomic_io import append_line
from andabata.runs.strict_json import dumps, finite

Entry = dict[str, Any]

_CRC = "crc32"
"""Key of the checksum that ends an entry's line, of the line as it is without."""


class Journal:
    """JSON-lines file of a run: its description first, then an entry for each piece.

    Attributes:
        path: Path of the file, None for a journal that nothing is written to.
        entries: Entries in their order.
    """

    def __init__(self, path: Path | None, about: Entry) -> None:
        """Begin a journal, or go on with one of the same run.

        Args:
            path: Path of the file; None writes nothing.
            about: Description of the run: all that its results depend on, ready for JSON.

        Raises:
            ValueError: If the file belongs to another run.
        """
        self.path = path
        self.entries: list[Entry] = [] if path is None else _read(path, about)

    def append(self, entry: Entry) -> None:
        """Append the entry of a finished piece and return when it is on the disk."""
        entry = finite(entry)  # As it is read again.
        self.entries.append(entry)
        if self.path is not None:
            append_line(self.path, dumps({**entry, _CRC: _crc(entry)}))


def _read(path: Path, about: Entry) -> list[Entry]:
    """Return the entries of a journal of the same run, which is begun where there is none.

    Raises:
        ValueError: If the journal belongs to another run, or a line of it has changed.
    """
    head = dumps(about)
    if not path.exists() or path.stat().st_size == 0:
        atomic_io.write(path, f"{head}\n".encode())
        return []
    lines = path.read_bytes().decode("utf-8", "replace").splitlines()
    if lines[0] != head:
        raise ValueError(
            f"{path}: expected a journal of this run, got one that differs in "
            f"{_what_differs(lines[0], about)}; take another --out"
        )
    # A kill may cut the last line short.
    kept = {n: line for n, line in enumerate(lines[1:], start=2) if _is_json(line)}
    entries = [_entry(path, number, line) for number, line in kept.items()]
    atomic_io.write(path, "".join(f"{line}\n" for line in [head, *kept.values()]).encode())
    return entries


def _entry(path: Path, number: int, line: str) -> Entry:
    """Return the entry of a line; journals of older releases have no checksums.

    Raises:
        ValueError: If the line is not as it was written.
    """
    entry = checked_entry(json.loads(line))
    if entry is not None:
        return entry
    raise ValueError(
        f"{path}: line {number}: expected an entry with its CRC-32, got a changed one; delete the "
        "line, and its piece of the run is made again"
    )


def checked_entry(content: object) -> Entry | None:
    """Return the entry in a line's JSON without its checksum; None if it has changed.

    Args:
        content: JSON of the line, with or without a checksum.
    """
    if not isinstance(content, dict):
        return None
    entry = {key: value for key, value in content.items() if key != _CRC}
    return entry if content.get(_CRC) in (None, _crc(entry)) else None


def _crc(entry: Entry) -> str:
    """Return the CRC-32 of an entry's line, in hexadecimal."""
    return f"{zlib.crc32(dumps(entry).encode()):08x}"


def _what_differs(head: str, about: Entry) -> str:
    """Return the parts in which the first line of a journal differs."""
    try:
        recorded = json.loads(head)
        return ", ".join(name for name in about if recorded.get(name) != finite(about[name]))
    except (json.JSONDecodeError, AttributeError):
        return "kind"


def _is_json(line: str) -> bool:
    """Return True if a line is whole."""
    try:
        json.loads(line)
    except (json.JSONDecodeError, RecursionError):
        return False
    return True
