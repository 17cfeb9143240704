"""Code of a user's own, named by file and name, such as ``my_law.py:Follow``.

The file is run when it is asked for, in each process that drives: it is the user's own program, and
it may do what a program may do.
"""

import hashlib
import importlib.util
import re
from collections.abc import Callable, Iterable
from functools import lru_cache
from pathlib import Path
from traceback import walk_tb
from types import ModuleType
from typing import Any

_MARK = ".py:"

_OWN_MODULE = re.compile(r"own_[0-9a-f]{16}")
"""Name of the module of a user's own file."""


class OwnCodeError(ValueError):
    """File or name of a user's own code that cannot be used."""


def is_own(name: str) -> bool:
    """Return True for a name of a user's own code, and not one of the package's words."""
    return _MARK in name


def load_own(name: str, methods: Iterable[str]) -> Callable[..., Any]:
    """Return what a name of a user's own code stands for, a class or a function.

    Args:
        name: File and name, ``FILE.py:NAME``; a class has to have the methods.
        methods: Names of methods.

    Raises:
        OwnCodeError: If there is no such file, it does not run, or it has no such name.
    """
    file, _, attribute = name.rpartition(":")
    module = _module(file, _bytes_of(name))
    found: Callable[..., Any] | None = getattr(module, attribute, None)
    if not callable(found):
        known = sorted(
            key
            for key, value in vars(module).items()
            if callable(value) and getattr(value, "__module__", "") == module.__name__
        )
        raise OwnCodeError(
            f"{name}: expected a class or a function of {file}, which has "
            f"{', '.join(known) or 'none'}, got {attribute!r}"
        )
    lacking = [method for method in methods if not hasattr(found, method)]
    if isinstance(found, type) and lacking:
        raise OwnCodeError(
            f"{name}: expected a class with {', '.join(methods)}, got one without "
            f"{', '.join(lacking)}; see the guide on controllers of your own"
        )
    return found


def own_digests(names: Iterable[str]) -> dict[str, str]:
    """Return the SHA-256 of the files of own code among some names, by file.

    Raises:
        OwnCodeError: If there is no such file.
    """
    own = [name for name in names if is_own(name)]
    return {
        name.rpartition(":")[0]: hashlib.sha256(_bytes_of(name)).hexdigest() for name in sorted(own)
    }


def own_error(error: BaseException) -> OwnCodeError | None:
    """Return the error of a user's own code that another one is, None if its code had no part.

    Args:
        error: Error as it was caught, with its traceback.
    """
    if isinstance(error, OwnCodeError):
        return None
    place = ""
    for frame, line in walk_tb(error.__traceback__):
        if _OWN_MODULE.fullmatch(frame.f_globals.get("__name__", "")):
            place = f"{frame.f_code.co_filename}, line {line}"
    if not place:
        return None
    return OwnCodeError(
        f"{place}: expected code that runs, got {type(error).__name__}: {error}; --debug shows the "
        "way there"
    )


def _bytes_of(name: str) -> bytes:
    """Return the bytes of the file of a name.

    Raises:
        OwnCodeError: If it cannot be read.
    """
    file = name.rpartition(":")[0]
    try:
        return Path(file).read_bytes()
    except OSError as error:
        raise OwnCodeError(
            f"{name}: expected a Python file {file}, got {error.strerror}; name it from here on"
        ) from error


@lru_cache(maxsize=64)
def _module(file: str, source: bytes) -> ModuleType:
    """Return the module of a file, run once for its content.

    Raises:
        OwnCodeError: If it does not run.
    """
    name = f"own_{hashlib.sha256(source).hexdigest()[:16]}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise OwnCodeError(f"{file}: expected a Python file, got another kind; end its name in .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise OwnCodeError(
            f"{file}: expected code that runs, got {type(error).__name__}: {error}; run python "
            f"{file} to see where"
        ) from error
    return module
