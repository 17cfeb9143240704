"""Origin of a process: the code, models and packages that its results depend on.

Every worker compares its own with that of the process that hands out the tasks.
"""

import hashlib
import platform
import socket
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from andabata.runs.folder import commit, versions

_ROOT = Path(__file__).resolve().parents[1]
_PACKAGES = ("andabata", "rl", "terrain", "traversability", "worlds")
_SOURCES, _MODELS = (".py", ".toml", ".sdf"), (".npz", ".safetensors")


class OriginError(ValueError):
    """A worker whose results would be those of other code, models or packages."""


@dataclass(frozen=True)
class Origin:
    """What a process runs, and where.

    Attributes:
        host: Name of the machine.
        cpu: Model of its processor; other ones may differ in the last digits.
        commit: Git commit of the code, with ``+`` if files are changed; None without git.
        sources: SHA-256 of the packages' source files.
        models: SHA-256 of each shipped model, by file.
        versions: Version of Python and of each package that results depend on.
    """

    host: str
    cpu: str
    commit: str | None
    sources: str
    models: dict[str, str]
    versions: dict[str, str | None]

    def check(self, expected: "Origin") -> None:
        """Refuse this process as a worker for another one that runs something else.

        The commit is compared where both know theirs: an installed package has no git.

        Raises:
            OriginError: If commit, sources, models or versions differ.
        """
        step = "install the same commit there (git checkout, make install) and start its ray again"
        if expected.commit and self.commit and _clean(expected.commit) != _clean(self.commit):
            self._refuse("commit", expected.commit, self.commit, step)
        for kind in ("models", "versions"):
            wanted, got = getattr(expected, kind), getattr(self, kind)
            for name in sorted(wanted.keys() | got.keys()):
                if wanted.get(name) != got.get(name):
                    self._refuse(f"{kind} {name}", wanted.get(name), got.get(name), step)
        if expected.sources != self.sources:
            self._refuse("sources", expected.sources[:12], self.sources[:12], step)

    def _refuse(self, what: str, expected: str | None, got: str | None, step: str) -> None:
        """Raise the error of a difference."""
        short = [None if text is None else text[:13] for text in (expected, got)]
        raise OriginError(
            f"worker on {self.host}: expected {what} {short[0]}, as the driver's, got {short[1]}; "
            f"{step}"
        )


@cache
def here() -> Origin:
    """Return the origin of this process, as it was when it was first asked."""
    shipped = _digests(_ROOT / "andabata" / "models", _MODELS)
    sources = hashlib.sha256()
    for package in _PACKAGES:
        for name, digest in _digests(_ROOT / package, _SOURCES).items():
            sources.update(f"{package}/{name} {digest}\n".encode())
    return Origin(
        host=socket.gethostname(),
        cpu=_cpu(),
        commit=commit(),
        sources=sources.hexdigest(),
        models=shipped,
        versions=versions() | {"python": platform.python_version()},
    )


def _digests(folder: Path, kinds: tuple[str, ...]) -> dict[str, str]:
    """Return the SHA-256 of a folder's files of some kinds, by their paths in it."""
    paths = sorted(path for path in folder.rglob("*") if path.suffix in kinds)
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in paths
    }


def _cpu() -> str:
    """Return the model of the processor, as far as the system tells."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in text.splitlines() if "model name" in line]
    return names[0] if names else platform.machine()


def _clean(commit: str) -> str:
    """Return a commit without the mark of changed files, which the sources tell better."""
    return commit.removesuffix("+")
