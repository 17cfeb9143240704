"""Atomic output: files and folders are whole or absent, and a log's lines are on the disk."""

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write(path: Path, data: bytes) -> None:
    """Write a file atomically: a kill at any moment leaves the old file or the new one.

    Args:
        path: Path of the file; its folder has to exist.
        data: Contents of the file.

    Raises:
        OSError: If the folder does not exist or is not writable, or the disk is full.
    """
    with open_file(path, len(data)) as file:
        file.write(data)


@contextmanager
def open_file(path: Path, size: int | None = None) -> Iterator[IO[bytes]]:
    """Yield a new file to write and seek in; it takes its name when the block has succeeded.

    The bytes go to a temporary file of the same folder and onto the disk; then a rename, which is
    atomic, replaces the old file.

    Args:
        path: Path of the file; its folder has to exist.
        size: Number of bytes that it will have, for the message of a full disk; None if unknown.

    Raises:
        OSError: If the folder does not exist or is not writable, or the disk is full.
    """
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "expected an existing folder", str(path.parent))
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "w+b") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException as error:
        temporary.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno in _NO_SPACE:
            needed = "the file" if size is None else f"{size:,} bytes"
            why = f"expected disk space for {needed}, got none; free some and go on"
            raise OSError(error.errno, why, str(path)) from error
        raise
    _sync_folder(path.parent)


def append_line(path: Path, text: str) -> None:
    """Append a line to a file and return when it is on the disk.

    A kill in between can leave a part of the line at the end of the file, and no other damage.

    Args:
        path: Path of the file, which has to exist.
        text: Line without its line feed.

    Raises:
        OSError: If the file cannot be written, or the disk is full.
    """
    with path.open("r+b") as file:
        file.seek(0, os.SEEK_END)
        file.write(text.encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


@contextmanager
def create_folder(path: Path) -> Iterator[Path]:
    """Yield a new folder to fill; it takes its name when the block has succeeded.

    Args:
        path: Path of the folder, which must not exist; its parent has to.

    Raises:
        OSError: If the parent does not exist or is not writable.
    """
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "expected an existing folder", str(path.parent))
    temporary = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    try:
        yield temporary
        temporary.chmod(0o755)
        temporary.rename(path)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    _sync_folder(path.parent)


def _sync_folder(folder: Path) -> None:
    """Put the entries of a folder onto the disk, where the system supports it."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
