"""Reading of run folders for reports: descriptions and results, with errors that name the cause."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from andabata.configuration.settings import explain
from andabata.runs.folder import versions
from andabata.runs.journal import checked_entry
from traversability.dataset import MANIFEST

ABOUT = "run.json"
"""File of a run folder that says how it was made."""


Model = TypeVar("Model", bound=BaseModel)


class RunFolderError(ValueError):
    """A folder that holds no run, an unfinished one, or one of another version."""


def read_about(folder: Path) -> dict[str, Any]:
    """Return how a run was made.

    Clouds of earlier versions have a manifest alone, which says it, too.

    Args:
        folder: Folder of the run.

    Raises:
        RunFolderError: If the folder is missing, holds no run, or its description is damaged.
    """
    if not folder.is_dir():
        raise RunFolderError(
            f"{folder}: expected a run folder, got no such folder; give the --out of train, drive, "
            "evaluate, lidar-study, clouds generate or classifier"
        )
    path = folder / ABOUT
    if path.is_file():
        return _object(path)
    if (folder / MANIFEST).is_file():
        found = _object(folder / MANIFEST)
        return {"verb": "clouds generate", "seed": found.get("seed"), "config": found.get("config")}
    raise RunFolderError(
        f"{path}: No such file: expected the folder of a finished run, got one without it; "
        "run its command again with the same --out: it goes on where it was"
    )


def read_result(
    folder: Path, name: str, keys: Iterable[str], row_keys: Sequence[str] = ()
) -> dict[str, Any]:
    """Return the result of a run.

    Args:
        folder: Folder of the run.
        name: Name of the file.
        keys: Keys that the report needs.
        row_keys: Keys that it needs of each of ``rows``.

    Raises:
        RunFolderError: If the file is missing, damaged, or of a version without these keys.
    """
    path = folder / name
    if not path.is_file():
        raise RunFolderError(
            f"{path}: No such file: expected the result of a finished run, got none; run its "
            "command again with the same --out"
        )
    found = _object(path)
    check_keys(found, keys, path, folder)
    for row in found["rows"] if row_keys else ():
        check_keys(row, row_keys, path, folder)
    return found


def check_keys(row: Mapping[str, Any], keys: Iterable[str], source: object, folder: Path) -> None:
    """Check that a row has the keys that a report needs.

    Raises:
        RunFolderError: If it lacks one.
    """
    for key in keys:
        if key not in row:
            raise RunFolderError(
                f"{source}: expected {key}, got none: a run of {_version(folder)}, this is "
                f"andabata {versions()['andabata']}; make it again, or report it with its version"
            )


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return the whole lines of a file of JSON lines; a kill may have cut the last one short.

    Raises:
        RunFolderError: If the file is missing, or a line before the last is damaged.
    """
    if not path.is_file():
        raise RunFolderError(
            f"{path}: No such file: expected the rows of a run, got none; run its command again"
        )
    lines, found = path.read_bytes().decode("utf-8", "replace").splitlines(), []
    for number, line in enumerate(lines, start=1):
        try:
            entry = checked_entry(json.loads(line))
            if entry is None:
                raise RunFolderError(
                    f"{path}: line {number}: expected an entry with its CRC-32, got a changed "
                    "one; delete the line, and the same command makes its piece of the run again"
                )
            found.append(entry)
        except json.JSONDecodeError as error:
            if number < len(lines):
                raise RunFolderError(
                    f"{path}: line {number}: expected JSON, got {error.msg}; the file is damaged"
                ) from error
    return found


def settings_of(kind: type[Model], data: object, folder: Path) -> Model:
    """Return the settings of a run as this version knows them.

    Raises:
        RunFolderError: If they are those of another version.
    """
    try:
        return kind.model_validate(data)
    except ValidationError as error:
        raise RunFolderError(
            f"{folder / ABOUT}: {explain(error)}: settings of {_version(folder)}, this is andabata "
            f"{versions()['andabata']}; make the run again, or report it with its version"
        ) from error


def _version(folder: Path) -> str:
    """Return the version that made a run, in words."""
    try:
        description = read_about(folder)
    except RunFolderError:
        return "another version"
    name = (description.get("versions") or {}).get("andabata")
    commit = description.get("commit")
    return f"andabata {name or 'of another version'}" + (f" at commit {commit}" if commit else "")


def _object(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file.

    Raises:
        RunFolderError: If it is none.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # Also numbers of 5,000 digits, and depth.
        raise RunFolderError(
            f"{path}: expected JSON, got a damaged file: {error}; run its command again"
        ) from error
    if not isinstance(found, dict):
        raise RunFolderError(f"{path}: expected a JSON object, got {type(found).__name__}")
    return found
