"""Guard against other distributions with our import names."""

import base64
import csv
import hashlib
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import Distribution, distributions
from importlib.util import find_spec
from pathlib import Path, PurePosixPath
from typing import Any

from andabata.distribution import HOME, install_again

SIBLINGS = ("terrain", "worlds", "traversability", "rl")

_OURS = "andabata"


class PackageOriginError(ValueError):
    """A sibling package of another distribution."""


@dataclass(frozen=True)
class Claim:
    """Files of another distribution under one of our import names.

    Attributes:
        distribution: Name of the distribution.
        version: Its version.
        package: Import name that it shares with us.
        folder: Folder of its files.
        files: Names of its modules there, from the package's folder on.
        shared: Those among them that we have, too: of such a file one of the two is lost.
        overwritten: Those of the shared ones whose content is no longer ours, by our own record.
    """

    distribution: str
    version: str
    package: str
    folder: Path
    files: tuple[str, ...]
    shared: tuple[str, ...]
    overwritten: tuple[str, ...]

    @property
    def is_mixed(self) -> bool:
        """True if its files lie among ours: pip installs one over the other without a word."""
        return self.folder == HOME / self.package

    @property
    def text(self) -> str:
        """What is known of it, and what to do, in one line."""
        where = "among ours" if self.is_mixed else f"in {self.folder}"
        names = ", ".join(f"{self.package}/{file}" for file in self.overwritten[:3])
        lost = f", {names} in place of ours" if names else ""
        owner = f"{self.distribution} {self.version}"
        return f"package {self.package}: {owner} has files of it {where}{lost}; {self.next_step}"

    @property
    def next_step(self) -> str:
        """What to do."""
        step = f"`pip uninstall {self.distribution}`"
        if self.is_mixed:
            step += f", then `{install_again()}`"
        return f"{step}, or keep the two in different virtual environments"

    def as_dict(self) -> dict[str, Any]:
        """Return the claim, ready for JSON."""
        return {
            "distribution": self.distribution,
            "version": self.version,
            "package": self.package,
            "folder": str(self.folder),
            "files": len(self.files),
            "shared": list(self.shared),
            "overwritten": list(self.overwritten),
            "is_mixed": self.is_mixed,
            "next_step": self.next_step,
        }


def check_origins() -> dict[str, str]:
    """Return the folder of each package, without importing it.

    Raises:
        PackageOriginError: If a sibling is missing or is not beside ``andabata``. The names are
            generic, and pip installs two distributions of one name over each other without a word.
    """
    folders = {_OURS: str(HOME / _OURS)}
    for name in SIBLINGS:
        spec = find_spec(name)
        origin = Path(spec.origin).resolve().parent if spec is not None and spec.origin else None
        if origin != HOME / name:
            raise PackageOriginError(
                f"package {name}: expected {HOME / name}, got {origin}; {_way_out(name, origin)}"
            )
        folders[name] = str(origin)
    return folders


def other_claims(path: list[str] | None = None) -> list[Claim]:
    """Return what pip's records say of other distributions with our import names.

    Args:
        path: Folders with installed distributions; None for those that Python imports from.
    """
    installed = list(distributions(path=sys.path if path is None else path))
    digests = _recorded(installed)
    return [claim for each in installed if _name(each) != _OURS for claim in _claims(each, digests)]


def changed_files(path: list[str] | None = None) -> list[Path]:
    """Return our files that are gone or no longer as pip installed them.

    What another distribution overwrites stays so when that is uninstalled, and then nobody claims
    it. An editable installation has no record of our files: none is returned.

    Args:
        path: Folders with installed distributions; None for those that Python imports from.
    """
    digests = _recorded(distributions(path=sys.path if path is None else path))
    return sorted(file for file, digest in digests.items() if _digest(file) != digest)


def changed_text(changed: Sequence[Path], claims: Sequence[Claim]) -> str | None:
    """Return what to do about changed files, in one line; None if none is changed.

    Args:
        changed: Result of ``changed_files``.
        claims: Result of ``other_claims``: what is said there is not said again.
    """
    said = {claim.folder / file for claim in claims for file in claim.overwritten}
    left = [str(file) for file in changed if file not in said]
    if not left:
        return None
    more = f" and {len(left) - 3} more" if len(left) > 3 else ""
    return (
        f"files: expected them as they were installed, got others or none: {', '.join(left[:3])}"
        f"{more}; `{install_again()}`"
    )


def _recorded(installed: Iterable[Distribution]) -> dict[Path, str]:
    """Return the digests of our packages' files in our own record of what was installed.

    ``Distribution.files`` leaves out those that are gone from Python 3.12 on; the record has them.
    """
    ours = [each for each in installed if _name(each) == _OURS]
    rows = [
        (each, file, digest.removeprefix("sha256="))
        for each in ours
        for file, digest, _ in csv.reader((each.read_text("RECORD") or "").splitlines())
        if digest.startswith("sha256=") and PurePosixPath(file).parts[0] in (_OURS, *SIBLINGS)
    ]
    return {Path(str(each.locate_file(file))).resolve(): digest for each, file, digest in rows}


def _way_out(name: str, origin: Path | None) -> str:
    """Return what to do about a package that is imported from another folder."""
    for claim in other_claims():
        if (claim.package, claim.folder) == (name, origin):
            return f"it is of {claim.distribution} {claim.version}: {claim.next_step}"
    return "uninstall the other distribution of that name and install andabata again"


def _name(distribution: Distribution) -> str:
    """Return the name of a distribution, in small letters."""
    return str(distribution.metadata["Name"] or "").lower()


def _claims(other: Distribution, digests: Mapping[Path, str]) -> Iterator[Claim]:
    """Yield a claim for each of our import names under which a distribution has modules.

    Args:
        other: Another distribution.
        digests: Digests of our files as they were installed, by path.
    """
    modules = [file for file in other.files or () if file.suffix == ".py" and len(file.parts) > 1]
    for name in SIBLINGS:
        files = tuple("/".join(file.parts[1:]) for file in modules if file.parts[0] == name)
        if not files:
            continue
        folder = Path(str(other.locate_file(name))).resolve()
        shared = tuple(file for file in files if folder / file in digests)
        lost = tuple(file for file in shared if _digest(folder / file) != digests[folder / file])
        yield Claim(other.metadata["Name"], other.version, name, folder, files, shared, lost)


def _digest(file: Path) -> str:
    """Return the digest of a file as pip's records have it; none for one that is missing."""
    if not file.is_file():
        return ""
    digest = hashlib.sha256(file.read_bytes()).digest()
    # RECORD has digests in URL-safe base64 without padding (PEP 376).
    return base64.urlsafe_b64encode(digest).rstrip(b"=").decode()
