"""Journal of a run: finished pieces in a file, so that a killed run goes on."""

import json
from pathlib import Path
from typing import Any

from andabata.runs import atomic_io
from andabata.runs.atomic_io import append_line
from andabata.runs.strict_json import dumps, finite

Entry = dict[str, Any]


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
            append_line(self.path, dumps(entry))


def _read(path: Path, about: Entry) -> list[Entry]:
    """Return the entries of a journal of the same run, which is begun where there is none.

    Raises:
        ValueError: If the journal belongs to another run.
    """
    head = dumps(about)
    if not path.exists() or path.stat().st_size == 0:
        atomic_io.write(path, f"{head}\n".encode())
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    if lines[0] != head:
        raise ValueError(
            f"{path}: expected a journal of this run, got one that differs in "
            f"{_what_differs(lines[0], about)}; take another --out"
        )
    kept = [line for line in lines[1:] if _is_json(line)]  # A kill may cut the last line short.
    atomic_io.write(path, "".join(f"{line}\n" for line in [head, *kept]).encode())
    return [json.loads(line) for line in kept]


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
    except json.JSONDecodeError:
        return False
    return True
