"""Compression of chunks and messages; damaged data are decompressed up to their first damage."""

import bz2
from typing import Any

from traversability.unpacked_size import largest_unpacked

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
"""First bytes of data compressed by zstd."""

LARGEST = 1 << 31
"""Largest size of decompressed data [bytes]: a greater one is damage or an attack."""

_PIECE = 1 << 11
"""Size of the pieces in which data are decompressed [bytes].

A piece may unpack to 30,000 times its size before that is noticed: 64 MiB.
"""


def check_size(size: int, compressed: int) -> None:
    """Check that data do not decompress to far more than themselves.

    Args:
        size: Number of decompressed bytes.
        compressed: Number of compressed bytes.

    Raises:
        ValueError: If they do.
    """
    limit = min(LARGEST, largest_unpacked(compressed))
    if size > limit:
        raise ValueError(
            f"expected at most {limit:,} decompressed bytes of {compressed:,}, got {size:,}"
        )


def decompress(compression: str, data: bytes | memoryview, size: int) -> bytes | memoryview:
    """Return decompressed data.

    Args:
        compression: Name of the compression: ``none`` or empty, ``bz2``, ``lz4`` or ``zstd``.
        data: Compressed data.
        size: Number of decompressed bytes.

    Raises:
        ValueError: If the compression is unknown, or the data are damaged.
    """
    if compression in ("", "none"):
        return data
    check_size(size, len(data))
    decompressed, ended = _decompress(compression, data, size)
    if len(decompressed) != size or not ended:
        got = f"{len(decompressed):,}" + ("" if ended else " and no end")
        raise ValueError(f"expected {size:,} bytes decompressed by {compression}, got {got}")
    return decompressed


def decompress_prefix(compression: str, data: bytes | memoryview, limit: int = LARGEST) -> bytes:
    """Return decompressed data up to their first damage.

    Args:
        compression: Name of the compression: ``bz2``, ``lz4`` or ``zstd``.
        data: Compressed data, which may be cut short.
        limit: Largest number of decompressed bytes.

    Raises:
        ValueError: If the compression is unknown.
    """
    return _decompress(compression, data, min(limit, largest_unpacked(len(data))))[0]


def _decompress(compression: str, data: bytes | memoryview, limit: int) -> tuple[bytes, bool]:
    """Return decompressed data up to their first damage, and True if their end was reached."""
    parts: list[bytes] = []
    decompressor, rest = _decompressor(compression), limit
    view = memoryview(data)
    try:
        # In small pieces, so that the data before the damage are kept.
        for offset in range(0, len(view), _PIECE):
            parts.append(decompressor.decompress(bytes(view[offset : offset + _PIECE])))
            rest -= len(parts[-1])
            if rest < 0 or decompressor.eof:
                break
    except Exception as error:  # Each library has errors of its own, some of them private.
        if isinstance(error, MemoryError):
            raise
    return b"".join(parts), bool(decompressor.eof)


def _decompressor(compression: str) -> Any:  # noqa: ANN401 - three libraries, one method in common.
    """Return an object that decompresses piece by piece.

    Raises:
        ValueError: If the compression is unknown.
    """
    if compression == "bz2":
        return bz2.BZ2Decompressor()
    if compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        return lz4.frame.LZ4FrameDecompressor()
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().decompressobj()
    raise ValueError(f"expected a compression of none, bz2, lz4 or zstd, got {compression!r}")


def compress(compression: str, data: bytes) -> bytes:
    """Return compressed data.

    Args:
        compression: Name of the compression: ``none`` or empty, ``bz2``, ``lz4`` or ``zstd``.
        data: Data to compress.
    """
    if compression == "bz2":
        return bz2.compress(data)
    if compression == "lz4":
        import lz4.frame

        compressed: bytes = lz4.frame.compress(data)
        return compressed
    if compression == "zstd":
        import zstandard

        return zstandard.compress(data)
    return data
