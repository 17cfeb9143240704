"""Run folders: settings, seed, commit and versions beside the results of a run."""

import platform
import shlex
import subprocess
import sys
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from andabata.runs import atomic_io
from andabata.runs.strict_json import dumps
from traversability.dataset import config_hash

LEDGER = "docs/results/ledger.jsonl"
"""Ledger of the splits, from the repository's root; an entry in it is no change of the code."""

_PACKAGES = (
    *("andabata", "numpy", "scipy", "torch", "open3d", "pybullet", "scikit-learn", "numba"),
    "mujoco",
)


def make_folder(folder: Path) -> Path:
    """Create a folder with its parents, if it does not exist, and return it.

    Raises:
        OSError: If a file has its name, or the parent is not writable.
    """
    with atomic_io.explained(folder, "a folder"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write a JSON file atomically; numbers that are not finite become null."""
    atomic_io.write(path, (dumps(data, indent=1, sort_keys=True) + "\n").encode())


def describe(verb: str, config: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Return the description of a run for its folder: settings, seed, command, commit and versions.

    Args:
        verb: Command that was run.
        config: Resolved settings.
        seed: Seed of the run.
    """
    return {
        "verb": verb,
        "seed": seed,
        "config": dict(config),
        "config_sha256": config_hash(dict(config)),
        "command": command_line(),
        "commit": commit(),
        "python": platform.python_version(),
        "versions": versions(),
    }


def command_line() -> str:
    """Return the command line of this process, as a user would write it anywhere.

    The program is without its folder, and a package that was run by ``-m`` has its name.
    """
    program, *words = sys.argv or [""]
    name = Path(program).name
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    if name == "__main__.py" and spec is not None:
        package = spec.name.removesuffix(".__main__")
        run = [package] if package == "andabata" else ["python", "-m", package]
    else:
        run = [name]
    return shlex.join([*run, *words])


def commit() -> str | None:
    """Return the git commit of the code, with ``+`` if files are changed; None without git."""
    home = Path(__file__).resolve().parents[2]

    def git(*words: str) -> str:
        done = subprocess.run(
            ["git", "-C", str(home), *words], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    try:
        others = (".", f":(exclude){LEDGER}")
        status = git("status", "--porcelain", "--untracked-files=no", "--", *others)
        changed = "+" if status else ""
        return git("rev-parse", "HEAD")[:12] + changed
    except (OSError, subprocess.CalledProcessError):
        return None


def versions() -> dict[str, str | None]:
    """Return the versions of the packages that results depend on."""
    numbers: dict[str, str | None] = {}
    for name in _PACKAGES:
        try:
            numbers[name] = version(name)
        except PackageNotFoundError:
            numbers[name] = None
    return numbers
