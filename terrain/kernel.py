"""The decorator of every compiled function, and a cache of machine code that is never stale.

numba keeps machine code until the file of the function itself changes, and looks at no other file:
a caller keeps the old code of a callee, and the old value of a constant, of another module. Here
what was compiled lies in a folder named after the content of the function's own module and of all
modules of these packages that it imports, directly or not: change one of them, and whatever depends
on it is compiled again. numba itself tells CPUs and its own versions apart.

The module stands in the lowest package so that all of them can import it.
"""

import hashlib
import os
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import config, njit

Function = TypeVar("Function", bound=Callable[..., Any])

_settings: Any = config

_ROOT = Path(__file__).resolve().parents[1]
_PACKAGES = ("andabata", "rl", "terrain", "traversability", "worlds")
_IMPORT = re.compile(
    rf"^[ \t]*(?:from|import)[ \t]+((?:{'|'.join(_PACKAGES)})(?:\.\w+)*)"
    r"(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?",
    re.MULTILINE,
)

_KEPT_DAYS = 30.0
"""Machine code that was not used for so long is deleted [days]."""


def kernel(function: Function) -> Function:
    """Compile a function to machine code when it is first called, without Python's lock.

    numba takes the types of the arguments as they come and ignores annotations: those are for
    readers and for mypy. Divisions follow numpy (x / 0 is infinite). With ``NUMBA_DISABLE_JIT=1``
    the function stays as it is.
    """
    return _compiled(function, {})


def inlined_kernel(function: Function) -> Function:
    """Compile a function into its callers: for steps of a few operations inside of hot loops."""
    return _compiled(function, {"inline": "always"})


def source_digest(file: Path) -> str:
    """Return the SHA-256 of a module's source and of all modules of ours that it imports."""
    seen: set[Path] = set()
    waiting = [file.resolve()]
    while waiting:
        path = waiting.pop()
        if path not in seen:
            seen.add(path)
            waiting.extend(_read(path)[1])
    digest = hashlib.sha256()
    for path in sorted(seen):
        digest.update(_read(path)[0])
    return digest.hexdigest()


def _compiled(function: Function, options: dict[str, Any]) -> Function:
    """Return a function as numba's dispatcher whose machine code lies in its own folder."""
    folder = _folder(Path(function.__code__.co_filename))
    before = _settings.CACHE_DIR
    # numba reads the setting while it decorates; others' kernels keep their own.
    _settings.CACHE_DIR = str(folder) if folder else before
    try:
        return cast(
            Function,
            njit(cache=folder is not None, nogil=True, error_model="numpy", **options)(function),
        )
    finally:
        _settings.CACHE_DIR = before


@cache
def _folder(file: Path) -> Path | None:
    """Return the folder for a module's machine code, None where nothing can be written."""
    try:
        folder = _base() / source_digest(file)[:32]
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
    except (OSError, RuntimeError):  # No home folder, or one that cannot be written.
        return None
    return folder


@cache
def _base() -> Path:
    """Return the folder of all machine code, without what nobody has used for long."""
    if _settings.CACHE_DIR:
        base = Path(_settings.CACHE_DIR)
    else:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        base = Path(home) / "andabata" / "kernels"
    oldest = time.time() - _KEPT_DAYS * 86_400
    with suppress(OSError):
        for folder in base.iterdir():
            if len(folder.name) == 32 and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)
    return base


@cache
def _read(path: Path) -> tuple[bytes, tuple[Path, ...]]:
    """Return the SHA-256 of a source file, and the files of ours that it imports."""
    source = path.read_bytes()
    found: list[Path] = []
    for module, names in _IMPORT.findall(source.decode()):
        words = re.findall(r"\w+", names)
        for name in (module, *(f"{module}.{word}" for word in words)):
            file = _ROOT.joinpath(*name.split(".")).with_suffix(".py")
            if file.is_file():
                found.append(file)
    return hashlib.sha256(source).digest(), tuple(found)
