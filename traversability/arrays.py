"""Named arrays and a JSON header in one npz: equal bytes for equal arrays, checked when read."""

import io
import json
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
"""Array of any type and shape."""

_HEADER = "header"
"""Name of the array that holds the JSON header."""

_TRIED_BYTES = 16_384
"""Number of bytes at the end of an array that are compressed as a trial."""

_MAX_RATIO = 0.85
"""Share of their size below which those bytes have to shrink for the array to be compressed."""


class ArrayFileError(ValueError):
    """Bytes that are no npz, or not the one that was expected."""


def pack(arrays: Mapping[str, Array], header: Mapping[str, Any]) -> bytes:
    """Return arrays and a header as npz; equal inputs give equal bytes.

    Compressed at the fastest level, which takes a third of the time of numpy's own and a tenth more
    bytes; arrays that hardly shrink, such as measured coordinates, are stored as they are.

    Args:
        arrays: Arrays by name.
        header: Header, ready for JSON.
    """
    text = np.frombuffer(json.dumps(header, sort_keys=True).encode(), dtype=np.uint8)
    stream = io.BytesIO()
    columns: dict[str, Any] = {_HEADER: text, **dict(sorted(arrays.items()))}
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in columns.items():
            raw = io.BytesIO()
            np.lib.format.write_array(raw, np.asanyarray(array), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy")  # Dated 1980, whenever it is written.
            data = raw.getbuffer()
            tried = data[-_TRIED_BYTES:]
            packs = len(zlib.compress(tried, 1)) < _MAX_RATIO * len(tried)
            kind = zipfile.ZIP_DEFLATED if packs else zipfile.ZIP_STORED
            archive.writestr(entry, data, kind, compresslevel=1)
    return stream.getvalue()


def unpack(data: bytes, max_bytes: int) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the arrays and the header of ``pack``, or of any npz (then with an empty header).

    Nothing is unpickled, and the declared sizes are checked before anything is read.

    Args:
        data: Bytes of the file.
        max_bytes: Largest number of bytes that the arrays may take unpacked.

    Raises:
        ArrayFileError: If the bytes are no npz, are damaged, or declare more than that.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            declared = sum(entry.file_size for entry in archive.infolist())
            if declared > max_bytes:
                raise ArrayFileError(f"expected at most {max_bytes} bytes unpacked, got {declared}")
            arrays = {
                entry.filename.removesuffix(".npy"): _read(archive.read(entry))
                for entry in archive.infolist()
            }
    except ArrayFileError:
        raise
    except Exception as error:  # zipfile and zlib raise many kinds on damaged input.
        raise ArrayFileError(f"expected a whole npz file, got a damaged one ({error})") from error
    return arrays, _header(arrays.pop(_HEADER, None))


def _read(data: bytes) -> Array:
    """Return the array of one npy entry, its declared shape checked against its length."""
    stream = io.BytesIO(data)
    major, _ = np.lib.format.read_magic(stream)
    read = (
        np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
    )
    shape, _, dtype = read(stream)
    wanted = int(np.prod(shape, dtype=object)) * dtype.itemsize
    left = len(data) - stream.tell()
    if dtype.hasobject or wanted != left:
        raise ArrayFileError(f"expected {wanted} bytes of {dtype} {shape}, got {left}")
    stream.seek(0)
    return np.lib.format.read_array(stream, allow_pickle=False)


def _header(text: Array | None) -> dict[str, Any]:
    """Return the JSON header, empty without one."""
    if text is None:
        return {}
    try:
        header = json.loads(text.astype(np.uint8).tobytes())
    except (ValueError, TypeError) as error:
        raise ArrayFileError(f"header: expected JSON, got {error}") from error
    if not isinstance(header, dict):
        raise ArrayFileError(f"header: expected an object, got {type(header).__name__}")
    return header
