"""Writing of zip files: the same bytes on every system, each entry deflated in its own way.

Python's ``zipfile`` reads them. As a writer it notes the operating system, copies what it is given,
and has no strategies of deflate, of which ``zlib.Z_RLE`` takes half of the time where runs are all
that there is to find.

Source: PKWARE's APPNOTE.TXT, sections 4.3 and 4.4; without dates, comments and zip64.
"""

import struct
import zlib
from collections.abc import Sequence
from typing import NamedTuple

_STORED, _DEFLATED = 0, 8
"""Methods of compression."""

_VERSION = 20
"""Version of the format that readers of deflated entries need: 2.0."""

_MADE_BY = 3 << 8 | _VERSION
"""What made the file, on every system: Unix, whose permissions entries have."""

_DAY = 1 << 5 | 1
"""First day that the format knows: 1980-01-01."""

_MODE = 0o600 << 16
"""Permissions of an entry: its owner reads and writes it."""

_LOCAL, _LOCAL_MARK = struct.Struct("<IHHHHHIIIHH"), 0x04034B50
_CENTRAL, _CENTRAL_MARK = struct.Struct("<IHHHHHHIIIHHHHHII"), 0x02014B50
_END, _END_MARK = struct.Struct("<IHHHHIIH"), 0x06054B50

_MAX_BYTES, _MAX_ENTRIES = 2**32 - 1, 2**16 - 1
"""Largest size and number of entries of an archive without zip64."""


class ZipEntry(NamedTuple):
    """Entry of an archive.

    Attributes:
        name: Name in the archive.
        parts: Content, one part after the other.
        strategy: Strategy of deflate as in ``zlib``; None stores the content as it is.
    """

    name: str
    parts: Sequence[bytes | memoryview]
    strategy: int | None


def zip_archive(entries: Sequence[ZipEntry]) -> bytes:
    """Return a zip file; equal entries give equal bytes.

    Args:
        entries: Entries in their order in the file; they are deflated at the fastest level.

    Raises:
        ValueError: If they are too many or too large for a file without zip64.
    """
    pieces: list[bytes | memoryview] = []
    directory: list[bytes] = []
    place = 0
    for name, parts, strategy in entries:
        check, size = 0, sum(map(_size, parts))
        for part in parts:
            check = zlib.crc32(part, check)
        content = parts if strategy is None else _deflated(parts, strategy)
        packed = sum(map(_size, content))
        if place + max(size, packed) > _MAX_BYTES or len(directory) == _MAX_ENTRIES:
            raise ValueError(
                f"{name}: expected at most {_MAX_BYTES} bytes and {_MAX_ENTRIES} entries in a zip "
                f"file, got more; write fewer arrays into it"
            )
        method = _STORED if strategy is None else _DEFLATED
        label = name.encode("ascii")
        # The same in both places: version, flags, method, time, day, checksum, sizes, name, extra.
        about = (_VERSION, 0, method, 0, _DAY, check, packed, size, len(label), 0)
        pieces += [_LOCAL.pack(_LOCAL_MARK, *about), label, *content]
        # Comment, disk, internal attributes, permissions, place of the entry.
        directory += [_CENTRAL.pack(_CENTRAL_MARK, _MADE_BY, *about, 0, 0, 0, _MODE, place), label]
        place += _LOCAL.size + len(label) + packed
    count, length = len(entries), sum(map(len, directory))
    return b"".join(
        [*pieces, *directory, _END.pack(_END_MARK, 0, 0, count, count, length, place, 0)]
    )


def _size(part: bytes | memoryview) -> int:
    """Return the number of bytes of a part."""
    return part.nbytes if isinstance(part, memoryview) else len(part)


def _deflated(parts: Sequence[bytes | memoryview], strategy: int) -> list[bytes]:
    """Return the raw deflate stream of some parts, in pieces."""
    deflate = zlib.compressobj(1, zlib.DEFLATED, -zlib.MAX_WBITS, zlib.DEF_MEM_LEVEL, strategy)
    return [*map(deflate.compress, parts), deflate.flush()]
