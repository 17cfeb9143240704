"""Output into a pipe whose reader has left, as in ``andabata --help | head -1``."""

import io
import sys
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer


class PipeFile(io.FileIO):
    """File descriptor that drops what nobody reads any more; a command's work goes on without."""

    def write(self, data: "Buffer") -> int:
        """Write bytes, or drop them; return their number."""
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes


def drop_unread_output() -> None:
    """Let output be dropped once its reader has left, instead of an error in the middle of work."""
    sys.stdout = _dropping(sys.stdout)
    sys.stderr = _dropping(sys.stderr)


def _dropping(stream: TextIO) -> TextIO:
    """Return a stream like another one that drops what nobody reads."""
    if not isinstance(stream, io.TextIOWrapper):
        return stream
    # What was written so far stands in the old buffer, which is left behind.
    stream.flush()
    return io.TextIOWrapper(
        io.BufferedWriter(PipeFile(stream.fileno(), "w", closefd=False)),
        encoding=stream.encoding,
        errors=stream.errors,
        line_buffering=stream.line_buffering,
        write_through=stream.write_through,
    )
