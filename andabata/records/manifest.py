"""Manifest beside a recording: the SHA-256 of its files and other facts, as ``NAME.json``."""

import hashlib
import json
from pathlib import Path
from typing import Any

from andabata.runs import atomic_io
from andabata.runs.strict_json import dumps

_SUMS = "sha256"


def write_manifest(path: Path, about: dict[str, Any]) -> Path:
    """Write a manifest beside a recording: SHA-256 of its files, and other facts.

    Args:
        path: Path of the recording.
        about: Facts about the recording, ready for JSON.

    Returns:
        Path of the manifest.
    """
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    sums = {file.name: _sha256(file) for file in files if file.is_file()}
    manifest = _manifest_of(path)
    text = dumps({_SUMS: sums, **about}, indent=1, sort_keys=True)
    atomic_io.write(manifest, text.encode())
    return manifest


def changed_files(path: Path) -> str:
    """Return how a recording differs from its manifest; empty if it does not or has none.

    Damage that the format has no checksum for is found by this alone.

    Args:
        path: Path of the recording.

    Raises:
        OSError: If a file cannot be read.
    """
    manifest = _manifest_of(path)
    if not manifest.is_file():
        return ""
    try:
        about = json.loads(manifest.read_bytes())
        sums = about.get(_SUMS, {}) if isinstance(about, dict) else {}
        sums = dict(sums)
    except (ValueError, TypeError, RecursionError):
        return f"expected checksums in {manifest.name}, got a damaged file"
    names = [name for name, total in sums.items() if _differs(path, str(name), total)]
    if not names:
        return ""
    return (
        f"expected {', '.join(names[:3])} with the SHA-256 in {manifest.name}, got another: "
        "messages may be wrong"
    )


def _manifest_of(path: Path) -> Path:
    """Return the path of a recording's manifest."""
    return path.with_name(f"{path.name}.json")


def _differs(path: Path, name: str, total: object) -> bool:
    """Return True if a file of a recording is missing or has another SHA-256."""
    files = [file for file in path.rglob("*") if file.name == name] if path.is_dir() else [path]
    return not files or any(not file.is_file() or _sha256(file) != total for file in files)


def _sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
