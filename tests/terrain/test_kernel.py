"""Compiled functions: their machine code follows every module that it depends on."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

from terrain import kernel as kernel_module
from terrain.kernel import borrowing_kernel, source_digest

CALLER = """
from terrain.kernel import kernel
from worlds.callee import scaled


@kernel
def shifted(x: float) -> float:
    return scaled(x) + 1.0
"""
CALLEE = """
from terrain.kernel import inlined_kernel, kernel
from worlds.constants import FACTOR


@inlined_kernel
def twice(x: float) -> float:
    return 2.0 * x


@kernel
def scaled(x: float) -> float:
    return FACTOR * twice(x)
"""
RUN = """
from worlds.caller import shifted
value = shifted(10.0)
print(value, sum(shifted.stats.cache_hits.values()) if hasattr(shifted, "stats") else "plain")
"""


@pytest.fixture
def copy(tmp_path):
    """Return a folder with the package ``terrain`` and made-up compiled modules beside it."""
    shutil.copytree(Path(kernel_module.__file__).parent, tmp_path / "terrain")
    (tmp_path / "worlds").mkdir()
    for name, text in (
        ("__init__", ""),
        ("caller", CALLER),
        ("callee", CALLEE),
        ("constants", "FACTOR = 3.0\n"),
        ("unrelated", "FACTOR = 1.0\n"),
    ):
        (tmp_path / "worlds" / f"{name}.py").write_text(text)
    return tmp_path


def call(copy, code=RUN, **environment):
    """Return what a new process computes, and how often it found its machine code in the cache."""
    default = {"NUMBA_CACHE_DIR": str(copy / "cache"), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy), **default, **environment},
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return done.stdout.split()


def rewrite(copy, name, old, new):
    """Replace a word of a module."""
    file = copy / "worlds" / f"{name}.py"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))


def test_a_change_of_any_module_it_depends_on_shows_at_once_and_others_compile_nothing(copy):
    """A callee's code and a constant two modules away are never stale; the rest stays cached."""
    assert call(copy) == ["61.0", "0"]
    folders = set(os.listdir(copy / "cache"))
    rewrite(copy, "unrelated", "1.0", "4.0")
    assert call(copy) == ["61.0", "1"]
    assert set(os.listdir(copy / "cache")) == folders
    rewrite(copy, "callee", "2.0 * x", "5.0 * x")
    assert call(copy) == ["151.0", "0"]
    rewrite(copy, "constants", "3.0", "7.0")
    assert call(copy) == ["351.0", "0"]


def test_a_second_clone_finds_the_code_of_the_first_and_that_of_no_other_source(copy):
    """Machine code belongs to the sources: to the same ones in any folder, and to no others."""
    second = copy / "second"
    for package in ("terrain", "worlds"):
        shutil.copytree(copy / package, second / package)
    shared = {"NUMBA_CACHE_DIR": str(copy / "cache")}
    assert call(copy) == ["61.0", "0"]
    os.utime(second / "worlds" / "caller.py", (0, 0))
    assert call(second, **shared) == ["61.0", "1"]
    rewrite(second, "constants", "3.0", "7.0")
    assert call(second, **shared) == ["141.0", "0"]
    assert call(copy) == ["61.0", "1"]


def test_a_compilation_is_noticed_and_a_cached_function_is_none(copy):
    """The notice comes before the result of a first use, and does not come with the second."""
    code = f"""
from terrain.compilation import on_first_compilation
on_first_compilation(lambda: print("compiles"))
{RUN}"""
    assert call(copy, code) == ["compiles", "61.0", "0"]
    assert call(copy, code) == ["61.0", "1"]


def test_a_folder_that_cannot_be_written_means_no_cache(copy):
    """A cache path that is a file costs the cache, not the result, and leaves nothing behind."""
    (copy / "file").write_text("")
    before = set(copy.rglob("*"))
    assert call(copy, NUMBA_CACHE_DIR=str(copy / "file")) == ["61.0", "0"]
    assert set(copy.rglob("*")) == before


def test_without_compilation_functions_stay_plain(copy):
    """NUMBA_DISABLE_JIT=1 returns the functions unchanged, with the same result."""
    assert call(copy, NUMBA_DISABLE_JIT="1") == ["61.0", "plain"]
    assert not (copy / "cache").exists()


@pytest.fixture
def fresh(copy, monkeypatch):
    """Let the module see the copy as its own root, with nothing remembered."""
    monkeypatch.setattr(kernel_module, "_ROOT", copy)
    monkeypatch.setattr(kernel_module._settings, "CACHE_DIR", "")
    for function in (kernel_module._read, kernel_module._folder, kernel_module._base):
        function.cache_clear()
    yield copy
    for function in (kernel_module._read, kernel_module._folder, kernel_module._base):
        function.cache_clear()


@pytest.mark.parametrize(
    ("line", "follows"),
    [
        ("from worlds.constants import FACTOR", True),
        ("from worlds import constants", True),
        ("from worlds import (\n    caller,\n    constants,\n)", True),
        ("import worlds.constants as c", True),
        ("    from worlds.constants import FACTOR", True),
        ("from worlds.callee import scaled", True),
        ("import worlds.unrelated", False),
        ("# from worlds.constants import FACTOR", False),
        ("from numpy import constants", False),
    ],
)
def test_every_form_of_import_is_followed(fresh, line, follows):
    """A digest changes with a module imported in any form, directly or not, and with no other."""
    file = fresh / "worlds" / "importer.py"
    file.write_text(line)
    before = source_digest(file)
    rewrite(fresh, "constants", "3.0", "7.0")
    kernel_module._read.cache_clear()
    assert (source_digest(file) != before) is follows


def test_the_text_of_a_package_counts(fresh):
    """A name imported from a package may be defined in its __init__."""
    file = fresh / "worlds" / "importer.py"
    file.write_text("from worlds import VERSION")
    before = source_digest(file)
    (fresh / "worlds" / "__init__.py").write_text("VERSION = 2")
    kernel_module._read.cache_clear()
    assert source_digest(file) != before


def test_folders_long_unused_are_deleted(fresh, monkeypatch):
    """A folder unused for 30 days goes; younger ones, and those of other programs, stay."""
    base = fresh / "cache"
    monkeypatch.setattr(kernel_module._settings, "CACHE_DIR", str(base))
    monkeypatch.setattr(kernel_module, "time", SimpleNamespace(time=lambda: 100.0 * 86_400))
    for name, day in (("a" * 32, 69.9), ("b" * 32, 70.1), ("c" * 40, 0.0), ("z" * 32, 0.0)):
        (base / name).mkdir(parents=True)
        (base / name / "code.nbi").write_text("")
        os.utime(base / name, (day * 86_400, day * 86_400))
    assert kernel_module._base() == base
    assert sorted(os.listdir(base)) == ["b" * 32, "c" * 40, "z" * 32]


def test_use_keeps_a_folder_young(fresh, monkeypatch):
    """Choosing a folder sets its time of last use."""
    monkeypatch.setattr(kernel_module._settings, "CACHE_DIR", str(fresh / "cache"))
    file = fresh / "worlds" / "caller.py"
    folder = kernel_module._folder(file)
    os.utime(folder, (0, 0))
    kernel_module._folder.cache_clear()
    assert kernel_module._folder(file) == folder
    assert folder.stat().st_mtime > 0


def test_without_a_home_there_is_no_cache(fresh, monkeypatch):
    """A user without a home folder gets no cache; XDG_CACHE_HOME gives one."""

    def homeless(cls):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "home", classmethod(homeless))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    file = fresh / "worlds" / "caller.py"
    assert kernel_module._folder(file) is None
    kernel_module._folder.cache_clear()
    monkeypatch.setenv("XDG_CACHE_HOME", str(fresh / "home"))
    folder = kernel_module._folder(file)
    assert folder.parent == fresh / "home" / "andabata" / "kernels"
    assert kernel_module._folder(fresh / "no such module.py") is None


def test_numbas_setting_is_left_as_it_was(monkeypatch):
    """Decorating a function leaves numba's own cache folder to other distributions."""
    settings = kernel_module._settings
    before = settings.CACHE_DIR, settings.CACHE_LOCATOR_CLASSES

    @kernel_module.kernel
    def reciprocal(x: float) -> float:
        return 1.0 / x

    assert before == (settings.CACHE_DIR, settings.CACHE_LOCATOR_CLASSES)
    assert reciprocal(0.0) == np.inf


def test_a_borrowing_kernel_counts_no_references_and_creates_no_array():
    """Its machine code knows no counter, views work, and an allocation is an error."""

    class Pair(NamedTuple):
        first: np.ndarray
        second: np.ndarray

    @borrowing_kernel
    def product(pair):
        total = 0.0
        for a, b in zip(pair.first[1:], pair.second[1:]):  # noqa: B905 - numba knows no strict.
            total += a * b
        return total

    @borrowing_kernel
    def doubled(array):
        return (2.0 * array).sum()

    assert product(Pair(np.arange(4.0), np.arange(4.0))) == 14.0
    (code,) = product.inspect_llvm().values()
    assert "NRT_incref" not in code
    with pytest.raises(NumbaError, match="NRT required"):
        doubled(np.zeros(3))
