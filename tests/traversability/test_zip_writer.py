"""Zip files that Python's own module reads."""

import io
import zipfile
import zlib

import pytest

from traversability.zip_writer import ZipEntry, zip_archive

RUNS = b"\0" * 5000 + b"\7" * 4000
ENTRIES = [
    ZipEntry("stored.npy", (b"some", memoryview(b" bytes")), None),
    ZipEntry("runs.npy", (RUNS[:3000], RUNS[3000:]), zlib.Z_RLE),
    ZipEntry("words.npy", (b"again and " * 500,), zlib.Z_DEFAULT_STRATEGY),
    ZipEntry("empty.npy", (), None),
]


def test_every_entry_comes_back():
    """Names in their order, contents and checksums."""
    with zipfile.ZipFile(io.BytesIO(zip_archive(ENTRIES))) as archive:
        assert archive.testzip() is None
        assert archive.namelist() == [entry.name for entry in ENTRIES]
        for entry in ENTRIES:
            assert archive.read(entry.name) == b"".join(entry.parts)
            packed = archive.getinfo(entry.name).compress_size
            assert packed == sum(map(len, entry.parts)) or packed < 100


def test_what_needs_zip64_is_refused(monkeypatch):
    """The format's numbers of 32 bits would wrap around."""
    monkeypatch.setattr("traversability.zip_writer._MAX_BYTES", 100)
    with pytest.raises(ValueError, match=r"runs.npy: expected at most 100 bytes .* got more"):
        zip_archive(ENTRIES)
