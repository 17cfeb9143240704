"""TensorBoard event files of training runs, written when the history is; needs ``tensorboard``.

What stands in an event file stands in the checkpoint, too, so that a resumed run goes on in the
same folder without a step twice or left out.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from andabata.distribution import install_extra

Row = Mapping[str, Any]

FOLDER = "tensorboard"
"""Folder of the event files in that of a run."""

_NUMBERS = (
    "recent_success",
    "success_rate",
    "mean_return",
    "mean_steps",
    "circling",
    "difficulty",
)
"""Keys of a row that are curves of their own."""

_GROUPS = {"terms": "reward", "losses": "losses", "validation": "validation"}
"""Names of the curves of a row's groups of figures, by their keys."""

_HEAD, _CHECK = struct.Struct("<QI"), 4
"""Length of a record with its checksum, and the size of the checksum that ends it [bytes]."""


class EventFilesError(ValueError):
    """Event files that cannot be written here."""


class EventFiles:
    """Writes the rows of a run's history that are not in its event files yet."""

    def __init__(self, run: Path) -> None:
        """Go on where the event files of a run's folder end.

        Args:
            run: Folder of the run.

        Raises:
            EventFilesError: If tensorboardX is not installed.
        """
        self._library = _tensorboardx()
        self._folder = run / FOLDER
        self._last = last_step(self._folder)
        self._writer: Any = None

    def write(self, history: Sequence[Row]) -> None:
        """Write the rows beyond the last step that is written, and wait until they are on the disk.

        Args:
            history: All rows of the run so far.
        """
        rows = [row for row in history if row["steps"] > self._last]
        if not rows:
            return
        if self._writer is None:
            # The library names files after the second: one of the same second would be lost.
            number = len(list(self._folder.glob("events.*")))
            writer = self._library.FileWriter
            self._writer = writer(str(self._folder), filename_suffix=f".{number}")
        for row in rows:
            # One record a row: a kill leaves whole iterations behind.
            self._writer.add_summary(_summary(scalars(row)), row["steps"])
        self._writer.flush()
        self._last = rows[-1]["steps"]

    def close(self) -> None:
        """Close the file."""
        if self._writer is not None:
            self._writer.close()


def scalars(row: Row) -> dict[str, float]:
    """Return the figures of an iteration by the names of their curves, ``stage/figure``.

    Args:
        row: Row of a run's history, see ``rl.curriculum.TrainingIteration``.
    """
    figures = {key: row[key] for key in _NUMBERS if row.get(key) is not None}
    for key, name in _GROUPS.items():
        figures |= {f"{name}/{part}": value for part, value in row.get(key, {}).items()}
    played = sum(row["outcomes"].values())
    figures |= {f"ends/{name}": count / played for name, count in row["outcomes"].items()}
    tasks = row.get("tasks")
    if tasks is not None:
        figures |= {"tasks/score": tasks["score"], "tasks/successes": tasks["successes"]}
    return {f"{row['name']}/{tag}": float(value) for tag, value in figures.items()}


def _summary(values: Mapping[str, float]) -> Any:  # noqa: ANN401 - protobuf has no types.
    """Return values as TensorBoard keeps them."""
    from tensorboardX.proto.summary_pb2 import Summary

    return Summary(value=[Summary.Value(tag=tag, simple_value=v) for tag, v in values.items()])


def last_step(folder: Path) -> int:
    """Return the last step in the event files of a folder, -1 without any."""
    steps = [step for path in sorted(folder.glob("events.*")) for step, _ in read_scalars(path)]
    return max(steps, default=-1)


def read_scalars(path: Path) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield step and values by name of each record with scalars in an event file.

    A record that a kill cut short ends the file.

    Args:
        path: Event file.

    Raises:
        EventFilesError: If tensorboardX is not installed.
    """
    _tensorboardx()
    from tensorboardX.proto import event_pb2

    for data in _records(path.read_bytes()):
        event = event_pb2.Event.FromString(data)
        values = {value.tag: float(value.simple_value) for value in event.summary.value}
        if values:
            yield int(event.step), values


def _records(data: bytes) -> Iterator[bytes]:
    """Yield the whole records of a TFRecord file."""
    offset = 0
    while offset + _HEAD.size <= len(data):
        length, _ = _HEAD.unpack_from(data, offset)
        begin = offset + _HEAD.size
        offset = begin + length + _CHECK
        if offset > len(data):
            return
        yield data[begin : begin + length]


def _tensorboardx() -> ModuleType:
    """Return the library.

    Raises:
        EventFilesError: If it is not installed.
    """
    try:
        import tensorboardX
    except ImportError as error:
        raise EventFilesError(
            "--tensorboard: expected tensorboardX, got no such package; install it with "
            f"`{install_extra('tensorboard')}`"
        ) from error
    return tensorboardX
