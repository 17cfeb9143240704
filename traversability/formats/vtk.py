"""Legacy ASCII VTK, as libpointmatcher writes it: parser."""

from traversability.formats.error import FormatError
from traversability.formats.table import Columns, header_lines, text_columns


def parse(data: bytes) -> Columns:
    """Return the points' coordinates.

    Raises:
        FormatError: If the bytes are no such file.
    """
    if not data.startswith(b"# vtk DataFile"):
        raise FormatError(f"expected a file that begins with '# vtk DataFile', got {data[:16]!r}")
    lines, body = header_lines(data, b"POINTS")
    if len(lines) < 3 or lines[2][:1] != ["ASCII"]:
        raise FormatError("expected the ASCII form, got another")
    words = lines[-1]
    if len(words) < 2 or not words[1].isdigit():
        raise FormatError(f"expected 'POINTS n type', got {' '.join(words)!r}")
    return text_columns(body, int(words[1]), {"x": 0, "y": 1, "z": 2}, 3)
