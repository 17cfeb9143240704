"""The decorator of every compiled function, with a cache of machine code that cannot be stale.

numba invalidates cached code only when the file of the function itself changes: a caller keeps the
old code of a callee, and the old value of a constant, of another module. Here the cache folder is
named after the content of the function's module and of every module of these packages that it
imports, directly or not. A change of any of them selects a new folder, so that all code that
depends on it is compiled again. Where the modules lie does not count: two clones of the same
sources share their machine code. numba itself tells CPUs and its own versions apart.

The module is in the lowest package so that all packages can import it.
"""

import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, TypeVar, cast

from numba import config, njit
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator

from terrain.compilation import compilation_begins

Function = TypeVar("Function", bound=Callable[..., Any])

_settings: Any = config
_lock = Lock()

_ROOT = Path(__file__).resolve().parents[1]
_PACKAGES = ("andabata", "rl", "terrain", "traversability", "worlds")
_IMPORT = re.compile(
    rf"^[ \t]*(?:from|import)[ \t]+((?:{'|'.join(_PACKAGES)})(?:\.\w+)*)"
    r"(?:[ \t]+import[ \t]+(\([^)]*\)|[^\n]*))?",
    re.MULTILINE,
)
_FOLDER = re.compile(r"[0-9a-f]{32}")
_LOCATORS = "CACHE_LOCATOR_CLASSES"

_KEPT_DAYS = 30.0
"""Time after its last use at which a folder of machine code is deleted [days]."""


class _Compilation(event.Listener):
    """Listener of numba's compiler; the cache does not wake it."""

    def on_start(self, event: "event.Event") -> None:
        """Tell that a function is compiled."""
        compilation_begins()

    def on_end(self, event: "event.Event") -> None:
        """Do nothing."""


event.register("numba:compile", _Compilation())


class SourceCacheLocator(UserProvidedCacheLocator):
    """Place of a function's machine code in its folder, by the module's name and not its path."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Return the name of a module's subfolder."""
        path = Path(py_file).resolve()
        if path.is_relative_to(_ROOT):
            return ".".join(path.relative_to(_ROOT).parent.parts)
        return str(super().get_suitable_cache_subpath(py_file))

    def get_source_stamp(self) -> str:
        """Return nothing: the folder is named after the source."""
        return ""


def kernel(function: Function) -> Function:
    """Compile a function to machine code on its first call; it runs without Python's lock.

    numba infers types from the arguments and ignores annotations, which are for readers and mypy.
    Divisions follow numpy (x / 0 is infinite). With ``NUMBA_DISABLE_JIT=1`` the function is
    returned unchanged.
    """
    return _compiled(function, {})


def inlined_kernel(function: Function) -> Function:
    """Compile a function into each of its callers, for steps of a few operations in hot loops."""
    return _compiled(function, {"inline": "always"})


def borrowing_kernel(function: Function) -> Function:
    """Compile a function that creates no arrays: it counts no references to those that it is given.

    Counting takes some 10 ns for each array of a named tuple, wherever the tuple is passed on or
    read. Views may be taken but not returned; to create an array is an error of the compiler.
    """
    return _compiled(function, {"_nrt": False})


def source_digest(file: Path) -> str:
    """Return the SHA-256 of a module's source and of all modules that it depends on.

    Args:
        file: Path of the module. Modules of other distributions are not followed.

    Raises:
        OSError: If the module cannot be read.
    """
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
    """Return a function as numba's dispatcher, its cache in the folder of its module."""
    if _settings.DISABLE_JIT:
        return function
    folder = _folder(Path(function.__code__.co_filename))
    with _cache_in(folder):
        compile_ = njit(cache=folder is not None, nogil=True, error_model="numpy", **options)
        return cast(Function, compile_(function))


@contextmanager
def _cache_in(folder: Path | None) -> Iterator[None]:
    """Let numba keep what it decorates meanwhile in a folder; without one, leave its settings.

    numba reads its settings while it decorates. They are global: other threads' decorators wait,
    and other distributions' functions keep their own. Versions without the setting of locators
    name the place after the module's path.
    """
    with _lock:
        before = {name: getattr(_settings, name, "") for name in ("CACHE_DIR", _LOCATORS)}
        if folder:
            _settings.CACHE_DIR = str(folder)
            setattr(_settings, _LOCATORS, f"{__name__}.{SourceCacheLocator.__name__}")
        try:
            yield
        finally:
            for name, value in before.items():
                setattr(_settings, name, value)


@cache
def _folder(file: Path) -> Path | None:
    """Return the folder for a module's machine code, or None if it cannot be written."""
    try:
        folder = _base() / source_digest(file)[:32]
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        # numba would fall back to __pycache__, which can be stale, if it could not write here.
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError):  # RuntimeError: the user has no home folder.
        return None


@cache
def _base() -> Path:
    """Return the parent of all folders of machine code, after deleting those long unused."""
    if _settings.CACHE_DIR:
        base = Path(_settings.CACHE_DIR)
    else:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        base = Path(home) / "andabata" / "kernels"
    oldest = time.time() - _KEPT_DAYS * 86_400
    with suppress(OSError):
        for folder in base.iterdir():
            # The user's NUMBA_CACHE_DIR may hold other distributions' folders: those are kept.
            if _FOLDER.fullmatch(folder.name) and folder.stat().st_mtime < oldest:
                shutil.rmtree(folder, ignore_errors=True)
    return base


@cache
def _read(path: Path) -> tuple[bytes, tuple[Path, ...]]:
    """Return the SHA-256 of a source file, and the files of these packages that it imports."""
    source = path.read_bytes()
    imported: list[Path] = []
    for module, names in _IMPORT.findall(source.decode()):
        # "from a.b import c": c may be a module itself, or a name in a/b.py or a/b/__init__.py.
        for name in (module, *(f"{module}.{word}" for word in re.findall(r"\w+", names))):
            place = _ROOT.joinpath(*name.split("."))
            files = (place.with_suffix(".py"), place / "__init__.py")
            imported.extend(file for file in files if file.is_file())
    return hashlib.sha256(source).digest(), tuple(imported)
