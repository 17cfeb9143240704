"""Judges a release: runs every table of ``release_tables.toml`` once, one after the other.

``python -m andabata.report.release_tables 0.2.0 --out DIR`` gives each table a folder of its own in
DIR. Some take hours; a run that was interrupted goes on with the same command at the same commit,
and leaves out what is finished. ``--keep`` then stores the rows of all finished tables for the
results pages; see ``andabata.report.results_tables``.
"""

import argparse
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

from pydantic import BaseModel, ConfigDict, TypeAdapter

from andabata.report.results_tables import PAGES, StoredRows
from andabata.runs import atomic_io

_TABLES = Path(__file__).with_name("release_tables.toml")

_FINISHED = "finished"
"""File in the folder of a table that is finished."""


class ReleaseTable(BaseModel):
    """A table that judges a release.

    Attributes:
        command: Words behind ``andabata``, with ``{release}`` and ``{worlds}``.
        columns: Keys of the page's columns, separated by commas.
        over_rooms: True to add up the counts of all rooms.
        differences: Columns of the table in pairs; empty for none.
        failures: Columns of the table of what ended the other drives; empty for none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    command: str
    columns: str
    over_rooms: bool = False
    differences: str = ""
    failures: str = ""

    def words(self, release: str, worlds: Path | None) -> list[str] | None:
        """Return the words of the command, None where they need worlds that are not given.

        Args:
            release: Release that is judged.
            worlds: Folder of BARN's public worlds.
        """
        if worlds is None and "{worlds}" in self.command:
            return None
        named = {"release": release, "worlds": worlds}
        return [word.format(**named) for word in shlex.split(self.command)]


def release_tables() -> dict[str, ReleaseTable]:
    """Return all tables by name, in their order."""
    known = tomllib.loads(_TABLES.read_text(encoding="utf-8"))
    return TypeAdapter(dict[str, ReleaseTable]).validate_python(known)


def judge(words: Sequence[str], folder: Path) -> int:
    """Run the command of a table, and return its exit code.

    Args:
        words: Words behind ``andabata``.
        folder: Folder of the table.
    """
    if (folder / _FINISHED).is_file():
        return 0
    command = [sys.executable, "-m", "andabata", *words, "--out", str(folder)]
    try:
        code = subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode
    except KeyboardInterrupt:
        # The command has had the signal, too, and has said how it goes on.
        return 130
    if code == 0:
        atomic_io.write(folder / _FINISHED, b"")
    return code


def keep(name: str, table: ReleaseTable, folder: Path, pages: Path) -> Iterator[Path]:
    """Store the rows of a finished table for the results pages, and yield the files.

    Args:
        name: Name of the table.
        table: Table.
        folder: Its folder.
        pages: Folder of the results pages.

    Raises:
        RunFolderError: If the folder holds no finished run.
    """
    parts = {"": StoredRows.of_run(folder, table.columns.split(","), table.over_rooms)}
    for part in ("differences", "failures"):
        if columns := getattr(table, part):
            parts[f"-{part}"] = StoredRows.of_run(folder, columns.split(","), part=part)
    for end, rows in parts.items():
        path = pages / "data" / f"judged-{name}{end}.json"
        atomic_io.write(path, rows.to_bytes())
        yield path


def main(argv: Sequence[str] | None = None) -> int:
    """Judge, or store what was judged; return the exit code of the first command that failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("release", help="Release as 0.2.0.")
    parser.add_argument("--out", type=Path, required=True, help="Folder of all tables.")
    parser.add_argument("--worlds", type=Path, help="Folder of BARN's public worlds.")
    parser.add_argument("--only", default="", metavar="NAMES", help="Some tables, with commas.")
    parser.add_argument("--keep", action="store_true", help="Store the rows of finished tables.")
    parser.add_argument("--pages", type=Path, default=PAGES, help="Folder of the results pages.")
    options = parser.parse_args(argv)
    known = release_tables()
    chosen = options.only.split(",") if options.only else list(known)
    if unknown := [name for name in chosen if name not in known]:
        parser.error(f"--only: expected some of {', '.join(known)}, got {', '.join(unknown)}")
    for name in chosen:
        folder = options.out / name
        words = known[name].words(options.release, options.worlds)
        if words is None:
            sys.stderr.write(f"{name}: left out, its worlds are not given (--worlds)\n")
        elif options.keep:
            if (folder / _FINISHED).is_file():
                for path in keep(name, known[name], folder, options.pages):
                    sys.stdout.write(f"{path}\n")
        else:
            sys.stderr.write(f"{name}: andabata {shlex.join(words)}\n")
            if code := judge(words, folder):
                return code
    return 0


if __name__ == "__main__":
    sys.exit(main())
