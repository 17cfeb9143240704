"""Compressed stretches of recordings, unpacked whole or as far as they are whole."""

import bz2
from typing import Any

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
LARGEST = 1 << 31
"""Size of the largest stretch that is unpacked [bytes]: a greater one is damage or an attack."""


def unpack(compression: str, data: bytes | memoryview, size: int) -> bytes | memoryview:
    """Return what a stretch holds.

    Args:
        compression: ``none`` or empty, ``bz2``, ``lz4`` or ``zstd``.
        data: The stretch.
        size: Number of unpacked bytes.

    Raises:
        ValueError: If the compression is unknown, or the stretch is damaged.
    """
    if compression in ("", "none"):
        return data
    if size > LARGEST:
        raise ValueError(f"expected at most {LARGEST:,} unpacked bytes, got {size:,}")
    unpacked, ended = _unpack(compression, data, size)
    if len(unpacked) != size or not ended:
        got = f"{len(unpacked):,}" + ("" if ended else " and no end")
        raise ValueError(f"expected {size:,} bytes unpacked by {compression}, got {got}")
    return unpacked


def unpack_prefix(compression: str, data: bytes | memoryview, limit: int = LARGEST) -> bytes:
    """Return what a stretch holds up to its first damage.

    Args:
        compression: ``bz2``, ``lz4`` or ``zstd``.
        data: The stretch, which may be cut short.
        limit: Largest number of unpacked bytes.

    Raises:
        ValueError: If the compression is unknown.
    """
    return _unpack(compression, data, limit)[0]


def _unpack(compression: str, data: bytes | memoryview, limit: int) -> tuple[bytes, bool]:
    """Return what a stretch holds up to its first damage, and whether its end was met."""
    parts: list[bytes] = []
    unpacker, room = _unpacker(compression), limit
    view = memoryview(data)
    try:
        # Small pieces, so that what was unpacked before the damage is kept.
        for place in range(0, len(view), _PIECE):
            parts.append(unpacker.decompress(bytes(view[place : place + _PIECE])))
            room -= len(parts[-1])
            if room < 0 or unpacker.eof:
                break
    except Exception as error:  # Each library has its own error, some of them private.
        if isinstance(error, MemoryError):
            raise
    return b"".join(parts), bool(unpacker.eof)


_PIECE = 1 << 14


def _unpacker(compression: str) -> Any:  # noqa: ANN401 - three libraries, one method in common.
    """Return an object that unpacks piece by piece."""
    if compression == "bz2":
        return bz2.BZ2Decompressor()
    if compression == "lz4":
        import lz4.frame  # type: ignore[import-untyped]

        return lz4.frame.LZ4FrameDecompressor()
    if compression == "zstd":
        import zstandard

        return zstandard.ZstdDecompressor().decompressobj()
    raise ValueError(f"expected a compression of none, bz2, lz4 or zstd, got {compression!r}")


def pack(compression: str, data: bytes) -> bytes:
    """Return a compressed stretch.

    Args:
        compression: ``none`` or empty, ``bz2``, ``lz4`` or ``zstd``.
        data: What it holds.
    """
    if compression == "bz2":
        return bz2.compress(data)
    if compression == "lz4":
        import lz4.frame

        packed: bytes = lz4.frame.compress(data)
        return packed
    if compression == "zstd":
        import zstandard

        return zstandard.compress(data)
    return data
