"""Atomic output: files and folders are whole or absent, and a log's lines are on the disk.

What is being written has a temporary name and a lock, which the system releases when the process
ends, however it ends. So ``sweep`` knows what a killed process has left from what another writes.
"""

import errno
import io
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

try:
    import fcntl
except ImportError:  # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

_NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NOT_WRITABLE = (errno.EACCES, errno.EPERM, errno.EROFS)

_SUFFIX = ".part"
_TEMPORARY = re.compile(r"\.(?P<name>.+)\.[a-z0-9_]{8}\.part")
"""Temporary name of what is being written, as ``tempfile`` makes it."""


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
    _check_folder(path.parent)
    with (
        explained(path, "the file" if size is None else f"{size:,} bytes"),
        _temporary(tempfile.mkstemp, path) as (handle, temporary),
    ):
        try:
            with os.fdopen(handle, "w+b") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            temporary.chmod(0o644)
            temporary.replace(path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        _sync_folder(path.parent)


def append_line(path: Path, text: str) -> None:
    """Append a line to a file and return when it is on the disk.

    A kill in between can leave a part of the line at the end of the file, and no other damage. A
    full disk leaves the file as it was.

    Args:
        path: Path of the file, which has to exist.
        text: Line without its line feed.

    Raises:
        OSError: If the file cannot be written, or the disk is full.
    """
    with explained(path, "a line"), path.open("r+b", buffering=0) as file:
        size = file.seek(0, os.SEEK_END)
        try:
            _write_all(file, text.encode() + b"\n")
            os.fsync(file.fileno())
        except OSError:
            with suppress(OSError):
                file.truncate(size)
            raise


@contextmanager
def create_folder(path: Path) -> Iterator[Path]:
    """Yield a new folder to fill; it takes its name when the block has succeeded.

    Args:
        path: Path of the folder, which must not exist; its parent has to.

    Raises:
        OSError: If the parent does not exist or is not writable.
    """
    _check_folder(path.parent)
    sweep(path.parent, path.name)
    with explained(path, "the folder"), _temporary(_make_folder, path) as (handle, temporary):
        try:
            yield temporary
            temporary.chmod(0o755)
            temporary.rename(path)
        except BaseException:
            shutil.rmtree(temporary, ignore_errors=True)
            raise
        finally:
            if handle >= 0:
                os.close(handle)
        _sync_folder(path.parent)


@contextmanager
def explained(path: Path, needed: str) -> Iterator[None]:
    """Let errors of a full disk and of a read-only folder say what is missing.

    Args:
        path: File or folder that is written.
        needed: Name or size of what is written, for the message.

    Raises:
        OSError: With another text than the one that the block has raised.
    """
    try:
        yield
    except OSError as error:
        if error.errno in _NO_SPACE:
            why = f"expected disk space for {needed}, got none; free some and go on"
            raise OSError(error.errno, why, str(path)) from error
        if error.errno in _NOT_WRITABLE and _is_of(error, path):
            why = f"expected permission to write, got '{error.strerror}'; take another folder"
            raise OSError(error.errno, why, str(path)) from error
        raise


def sweep(folder: Path, name: str | None = None) -> None:
    """Remove what killed processes have left of files and folders that they were writing.

    What another process writes at this moment stays. Nothing is removed on systems without locks.

    Args:
        folder: Folder to look in, with its subfolders if there is no name.
        name: Name of the only file or folder that is meant; None for all.
    """
    if fcntl is None:
        return
    for where, folders, files in os.walk(folder):
        for entry in (*folders, *files):
            match = _TEMPORARY.fullmatch(entry)
            if match is not None and name in (None, match["name"]):
                with suppress(OSError):
                    _remove_unlocked(Path(where) / entry)
        if name is not None:
            return


def _remove_unlocked(path: Path) -> None:
    """Remove a file or a folder, unless a process holds its lock.

    Raises:
        OSError: If it does, or the path cannot be removed.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    finally:
        os.close(handle)


@contextmanager
def _temporary(
    make: Callable[[str, str, Path], tuple[int, str]], path: Path
) -> Iterator[tuple[int, Path]]:
    """Yield descriptor and name of a new temporary file or folder, locked until the block ends.

    Args:
        make: Function that makes it, from end, begin and folder of its name.
        path: Path that it is written for.
    """
    while True:
        handle, name = make(_SUFFIX, f".{path.name}.", path.parent)
        if fcntl is None:
            yield handle, Path(name)
            return
        own = os.dup(handle)  # The lock outlives the file that is written, until it has its name.
        with suppress(OSError):  # A file system without locks is no reason not to write.
            fcntl.flock(own, fcntl.LOCK_EX)
        if os.fstat(own).st_nlink:
            break
        os.close(own)  # A sweep came before the lock.
        os.close(handle)
    try:
        yield handle, Path(name)
    finally:
        os.close(own)


def _make_folder(suffix: str, prefix: str, parent: Path) -> tuple[int, str]:
    """Return descriptor and name of a new folder, as ``tempfile.mkstemp`` does of a file."""
    name = tempfile.mkdtemp(suffix, prefix, parent)
    return os.open(name, os.O_RDONLY) if os.name == "posix" else -1, name


def _check_folder(folder: Path) -> None:
    """Check that a folder exists.

    Raises:
        FileNotFoundError: If it does not.
    """
    if not folder.is_dir():
        raise FileNotFoundError(errno.ENOENT, "expected an existing folder", str(folder))


def _write_all(file: io.RawIOBase, data: bytes) -> None:
    """Write bytes to a file without a buffer, which may take a part at a time."""
    rest = memoryview(data)
    while rest:
        rest = rest[file.write(rest) :]


def _is_of(error: OSError, path: Path) -> bool:
    """Return True if an error is about a path, its parents or temporary file, or none by name."""
    if error.filename is None:
        return True
    other = Path(os.fsdecode(error.filename))
    is_temporary = _TEMPORARY.fullmatch(other.name) is not None
    return other.name == path.name or is_temporary or other in path.parents


def _sync_folder(folder: Path) -> None:
    """Put the entries of a folder onto the disk, where the system supports it."""
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
