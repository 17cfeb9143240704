"""CSV file of one topic's messages; columns are added while it is filled."""

import base64
import csv
import json
import tempfile
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path
from typing import Any, Self, TextIO

import numpy as np

from andabata.records.topics import RosMessage
from andabata.runs import atomic_io
from andabata.runs.strict_json import dumps

LONGEST_BYTES = 64
"""Number of bytes up to which each has a column; longer arrays are written as base64."""

LONGEST_ARRAY = 4096
"""Number of values up to which each has a column; longer arrays are written as a JSON list."""

LONGEST_LIST = 256
"""Number of messages or strings up to which each has columns; longer lists are a JSON list."""


class CsvTable:
    """Table that collects rows in a temporary file and writes them when all columns are known.

    Columns stand in the order of their first appearance. Arrays of more than ``LONGEST_BYTES``
    bytes become one column of base64, other arrays of more than ``LONGEST_ARRAY`` values and lists
    of more than ``LONGEST_LIST`` messages one of a JSON list.

    Attributes:
        path: Path of the CSV file.
        notes: Columns that hold whole arrays, and their format; known after ``finish``.
    """

    def __init__(self, path: Path) -> None:
        """Create an empty table."""
        self.path = path
        self.notes: list[str] = []
        self._columns: dict[str, int] = {"recorded_ns": 0}
        self._whole_arrays: dict[str, str] = {}
        self._rows: TextIO

    def __enter__(self) -> Self:
        """Open the temporary file."""
        # Memory stays bounded whatever the length of the recording.
        self._rows = tempfile.TemporaryFile("w+", encoding="utf-8", newline="")
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the temporary file."""
        self._rows.close()

    def add(self, stamp_ns: int, message: RosMessage) -> None:
        """Add a row.

        Args:
            stamp_ns: Time of recording [ns].
            message: Message of the row.
        """
        row: dict[int, object] = {0: stamp_ns}
        for name, value in self._flat("", message):
            row[self._columns.setdefault(name, len(self._columns))] = value
        # json keeps integers whole and writes NaN and Infinity as Python reads them again.
        self._rows.write(json.dumps(list(row.items())) + "\n")

    def finish(self) -> Path:
        """Write the CSV file and return its path.

        Raises:
            OSError: If it cannot be written.
        """
        self.notes = [f"{name} is written as {form}" for name, form in self._whole_arrays.items()]
        self._rows.seek(0)
        with atomic_io.open_file(self.path) as file:
            text = TextIOWrapper(file, encoding="utf-8", newline="")
            writer = csv.writer(text)
            writer.writerow(self._columns)
            for line in self._rows:
                row: list[object] = [None] * len(self._columns)
                for column, value in json.loads(line):
                    row[column] = value
                writer.writerow(row)
            text.flush()
            text.detach()
        return self.path

    def _flat(self, name: str, value: Any) -> Iterator[tuple[str, object]]:  # noqa: ANN401
        """Yield the numbers and strings of a message by dotted names."""
        if hasattr(value, "__dataclass_fields__"):
            for part, content in fields_of(value):
                yield from self._flat(f"{name}.{part}".strip("."), content)
        elif isinstance(value, np.ndarray | list):
            yield from self._array(name, value)
        elif isinstance(value, np.generic):
            yield name, value.item()
        else:
            yield name, value

    def _array(self, name: str, value: Any) -> Iterator[tuple[str, object]]:  # noqa: ANN401
        """Yield the elements of an array, or a long one as a single value."""
        if isinstance(value, np.ndarray):
            is_bytes = value.dtype.kind in "iu" and value.dtype.itemsize == 1
            if is_bytes and (len(value) > LONGEST_BYTES or name in self._whole_arrays):
                self._whole_arrays[name] = "base64"
                yield name, base64.b64encode(value.tobytes()).decode()
                return
            if len(value) > LONGEST_ARRAY or name in self._whole_arrays:
                self._whole_arrays[name] = "a JSON list"
                yield name, dumps(value.tolist())
                return
        elif len(value) > LONGEST_LIST or name in self._whole_arrays:
            self._whole_arrays[name] = "a JSON list"
            yield name, dumps([_plain(part) for part in value])
            return
        for k, part in enumerate(value):
            yield from self._flat(f"{name}.{k}", part)


def fields_of(message: RosMessage) -> Iterator[tuple[str, Any]]:
    """Yield name and value of a message's fields, without its constants."""
    for name in message.__dataclass_fields__:
        if not name.isupper() and not name.startswith("__"):
            yield name, getattr(message, name)


def _plain(value: Any) -> Any:  # noqa: ANN401 - any field of a message.
    """Return a value that JSON can represent."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: _plain(part) for name, part in fields_of(value)}
    if isinstance(value, list):
        return [_plain(part) for part in value]
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
