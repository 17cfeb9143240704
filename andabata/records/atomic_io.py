"""Files that are either whole or not there."""

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def write(path: Path, data: bytes) -> None:
    """Write a file so that a kill at any moment leaves the old one or the new one, never a part.

    The bytes go to a temporary file in the same folder, onto the disk, and take the name at once.

    Args:
        path: Where; its folder has to exist.
        data: What.

    Raises:
        OSError: If the folder is not there or cannot be written, or the disk is full.
    """
    with open_file(path, len(data)) as file:
        file.write(data)


@contextmanager
def open_file(path: Path, size: int | None = None) -> Iterator[IO[bytes]]:
    """Give a file to write and to seek in that takes its name when the block ends without an error.

    Args:
        path: Where; its folder has to exist.
        size: Number of bytes that it will have; None where that is not known.

    Raises:
        OSError: If the folder is not there or cannot be written, or the disk is full.
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
        if isinstance(error, OSError) and error.errno in _FULL:
            room = "the file" if size is None else f"{size:,} bytes"
            why = f"expected room for {room}, got none; make room and go on"
            raise OSError(error.errno, why, str(path)) from error
        raise
    _sync_folder(path.parent)


def append_line(path: Path, text: str) -> None:
    """Add a line to a file and put it onto the disk before anybody counts on it.

    A kill in between can leave a part of the line, the last of the file, and no other damage.

    Args:
        path: Where; it has to exist.
        text: The line, without its end.

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
    """Give a folder to fill that takes its name when the block ends without an error.

    Args:
        path: Where; the folder around it has to exist, itself it must not.

    Raises:
        OSError: If the folder around it is not there or cannot be written.
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
    """Put a folder's new names onto the disk, where the system can."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
