"""Lock of a run folder, or of a file: one command writes there at a time.

Who gets the lock sweeps what killed commands have left there, half written.
"""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from andabata.runs import atomic_io
from andabata.runs.folder import command_line, make_folder

try:
    import fcntl
except ImportError:  # Windows has no such locks.
    fcntl = None  # type: ignore[assignment]

LOCK = ".lock"
"""Name of the file in the folder, there while a command writes."""


class RunLockError(ValueError):
    """A run folder, or a file, that another command writes."""


@contextmanager
def locked_folder(folder: Path | None) -> Iterator[Path | None]:
    """Make a run folder, and keep it to this command until the block ends.

    The system releases the lock when the process ends, however it ends: what a killed command
    leaves is no obstacle. Folders that were made for a block that writes nothing are removed.

    Args:
        folder: Folder of the run, or None.

    Raises:
        RunLockError: If another command writes there.
        OSError: If the folder cannot be made.
    """
    if folder is None:
        yield None
        return
    path = folder.absolute()
    made = [each for each in (path, *path.parents) if not each.exists()]
    make_folder(folder)
    try:
        with _locked(folder / LOCK, f"{folder}: expected a folder that no other command writes"):
            atomic_io.sweep(folder)
            yield folder
    finally:
        with suppress(OSError):
            for each in made:
                each.rmdir()


@contextmanager
def locked_file(path: Path) -> Iterator[Path]:
    """Keep a file to this command until the block ends, as ``locked_folder`` keeps a folder.

    Args:
        path: Path of the file; its folder has to exist.

    Raises:
        RunLockError: If another command writes it.
        OSError: If its folder does not exist or is not writable.
    """
    if not path.absolute().parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, "expected an existing folder", str(path.parent))
    with _locked(
        path.with_name(f".{path.name}{LOCK}"),
        f"{path}: expected a file that no other command writes",
    ):
        atomic_io.sweep(path.absolute().parent, path.name)
        yield path


@contextmanager
def _locked(path: Path, expected: str) -> Iterator[None]:
    """Hold the lock of a file, which is removed at the end.

    Args:
        path: File of the lock.
        expected: Begin of the error: what is locked.

    Raises:
        RunLockError: If another process has the lock.
    """
    with atomic_io.explained(path, "a lock"):
        file = _open(path, expected)
    try:
        with atomic_io.explained(path, "a lock"):
            file.truncate(0)
            file.write(f"{os.getpid()} {command_line()}")
            file.flush()
        yield
    finally:
        with suppress(OSError):
            path.unlink()  # Before the lock is released: nobody else has it.
        file.close()


def _open(path: Path, expected: str) -> IO[str]:
    """Return a lock's file, opened and locked; see ``_locked``.

    Raises:
        RunLockError: If another process has the lock.
    """
    while True:
        file = path.open("a+", encoding="utf-8")
        try:
            _lock(file)
        except BlockingIOError:
            file.seek(0)
            number, _, command = file.read().partition(" ")
            file.close()
            raise RunLockError(
                f"{expected}, got that of process "
                f"{number or 'unknown'}{f' ({command})' if command else ''}; wait for it, or take "
                "another --out"
            ) from None
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()  # Its owner has removed it in between.


def _lock(file: IO[str]) -> None:
    """Lock a file for this process.

    Raises:
        BlockingIOError: If another one has the lock.
    """
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        return  # A file system without locks: the work matters more than its guard.
