"""Tables of the results pages, made from stored rows: nobody types them.

``docs/results/data/NAME.json`` holds the rows of a run, with its command and its commit. A page has
the table between ``<!-- table: NAME -->`` and ``<!-- end of table -->``: a page of results, or
``docs/reliability.md``. Without options all tables are written anew; ``--keep`` stores the rows of
a run first.
"""

import argparse
import re
import shlex
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from andabata.bench.table import markdown_table
from andabata.configuration.settings import explain
from andabata.evaluation.ledger import ledger_rows, read_ledger
from andabata.evaluation.room_policies import TRAINED
from andabata.evaluation.room_table import over_rooms
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.report.columns import spoken, with_reached
from andabata.report.folder import read_about, read_result
from andabata.report.run_folders import EVALUATION
from andabata.runs import atomic_io
from andabata.runs.folder import LEDGER
from andabata.runs.strict_json import dumps

PAGES = Path("docs/results")
"""Folder of the pages, from the repository's root."""

RELIABILITY = "reliability.md"
"""Page beside that folder whose table is made from stored rows, too."""

LEDGER_TABLE = "ledger"
"""Name of the table of the ledger, which stands beside the pages."""

_MARKED = re.compile(r"(<!-- table: ([a-z0-9-]+) -->\n)(.*?)(<!-- end of table -->)", re.DOTALL)


class StoredRows(BaseModel):
    """Rows of a run that a table is made from.

    Attributes:
        command: Command of the run.
        commit: Commit of the code that ran it.
        columns: Keys of the table's columns, in order.
        over_rooms: True if the counts of all rooms are added up, False for the rows as they are.
        date: Day of the run, which then stands with command and commit under the table; empty for
            none.
        rows: Rows of the run's result.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    command: str
    commit: str
    columns: tuple[str, ...]
    over_rooms: bool = False
    date: str = ""
    rows: tuple[dict[str, Any], ...]

    @classmethod
    def of_run(
        cls, folder: Path, columns: Sequence[str], is_over_rooms: bool = False, part: str = "rows"
    ) -> "StoredRows":
        """Return the rows of a finished run.

        Args:
            folder: Folder of the run, as ``--out`` of ``evaluate`` names it.
            columns: Keys of the table's columns.
            is_over_rooms: True to add up the counts of all rooms.
            part: List of rows in the run's result: ``rows``, ``differences`` or ``failures``.

        Raises:
            RunFolderError: If the folder holds no finished run.
            ValueError: If the run's code is of no commit: what made its figures is unknown.
        """
        description = read_about(folder)
        if not description.get("commit") or description["commit"].endswith("+"):
            raise ValueError(
                f"{folder}: expected a run of committed code, got commit "
                f"{description.get('commit')}; commit, and run its command again with another --out"
            )
        rows = read_result(folder, EVALUATION, (part,))[part]
        return cls.model_validate(
            {
                "command": published(description["command"]),
                "commit": description["commit"],
                "columns": columns,
                "over_rooms": is_over_rooms,
                "date": description.get("date", ""),
                "rows": rows,
            }
        )

    def to_bytes(self) -> bytes:
        """Return a JSON file of few lines, a row on each."""
        left_out = {"rows"} if self.date else {"rows", "date"}
        head = self.model_dump(mode="json", exclude=left_out)
        lines = [f"{dumps(key)}: {dumps(value)}," for key, value in head.items()]
        rows = ",\n".join(dumps(row, sort_keys=True) for row in self.rows)
        return "\n".join(["{", *lines, f'"rows": [\n{rows}\n]', "}\n"]).encode()

    def table(self) -> str:
        """Return the table in Markdown: words for keys, intervals in the cell of their figure."""
        rows = over_rooms(self.rows) if self.over_rooms else self.rows
        if "reached" in self.columns:
            # Rows of BARN call their drives runs.
            whole = "runs" if any("runs" in row for row in rows) else "trials"
            rows = with_reached(rows, whole)
        table = markdown_table([spoken(_named_laser(row), self.columns) for row in rows])
        made = f"\n`{self.command}`, commit {self.commit}, {self.date}.\n"
        return table + made if self.date else table


def published(command: str) -> str:
    """Return a run's command as a page prints it: without its folder, and paths by their names.

    Args:
        command: Command line of the run.
    """
    words = shlex.split(command)
    while "--out" in words:
        at = words.index("--out")
        del words[at : at + 2]
    kept = [word for word in words if not word.startswith("--out=")]
    return shlex.join(Path(word).name if Path(word).is_absolute() else word for word in kept)


def laser_words(label: str) -> str:
    """Return field of view, resolution and range of a planar laser in words.

    Args:
        label: Name of the laser, ``fov|resolution|range``, or ``trained`` for each policy's own.

    Raises:
        ValueError: If there is no such laser.
    """
    if label == TRAINED:
        return "that of its training"
    laser = PlanarLidarConfig.parse(label)
    words = f"{laser.fov_deg:g} degrees, {laser.resolution_deg:g}, {laser.max_range:g} m"
    return words + (f", {100 * laser.x:g} cm forward" if laser.x else "")


def tables(folder: Path) -> dict[str, str]:
    """Return the tables of all stored rows by their names, and that of the ledger.

    Args:
        folder: Folder of the pages, with ``data`` in it.

    Raises:
        ValueError: If a file holds no such rows, or the ledger is damaged.
    """
    found = {LEDGER_TABLE: ledger_table(folder / Path(LEDGER).name)}
    for path in sorted((folder / "data").glob("*.json")):
        try:
            found[path.stem] = StoredRows.model_validate_json(path.read_bytes()).table()
        except ValidationError as error:
            raise ValueError(f"{path}: {explain(error)}; store it again with --keep") from error
    return found


def ledger_table(path: Path) -> str:
    """Return the table of the ledger in Markdown, empty without a ledger.

    Raises:
        LedgerError: If it is damaged.
    """
    return markdown_table(ledger_rows(read_ledger(path))) if path.is_file() else ""


def rewritten(text: str, known: dict[str, str]) -> str:
    """Return a page with its tables made anew.

    Args:
        text: Page.
        known: Tables by their names.

    Raises:
        ValueError: If the page has a table whose rows are not stored.
    """

    def table(match: re.Match[str]) -> str:
        name = match[2]
        if name not in known:
            raise ValueError(f"table {name}: expected data/{name}.json, got none; see --keep")
        return f"{match[1]}{known[name]}{match[4]}"

    return _MARKED.sub(table, text)


def pages_of(folder: Path) -> list[Path]:
    """Return the pages with tables: those of results, and that of reliability beside them.

    Args:
        folder: Folder of the results pages.
    """
    beside = folder.parent / RELIABILITY
    return [*sorted(folder.glob("*.md")), *([beside] if beside.is_file() else [])]


def write_tables(folder: Path) -> Iterator[Path]:
    """Write the tables of all pages anew, and yield the pages that changed.

    Args:
        folder: Folder of the pages.

    Raises:
        ValueError: If a page has a table whose rows are not stored, or a file holds no rows.
    """
    known = tables(folder)
    for page in pages_of(folder):
        text = page.read_text(encoding="utf-8")
        if (found := rewritten(text, known)) != text:
            atomic_io.write(page, found.encode())
            yield page


def _named_laser(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with its laser in words."""
    return row | {"lidar": laser_words(row["lidar"])} if "lidar" in row else row


def main(argv: Sequence[str] | None = None) -> None:
    """Store the rows of a run if one is given, and write all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pages", type=Path, default=PAGES, help="Folder of the results pages.")
    parser.add_argument("--keep", type=Path, help="Folder of a run whose rows are stored.")
    parser.add_argument("--name", help="Name of the table of these rows.")
    parser.add_argument("--columns", default="", help="Keys of its columns, with commas.")
    parser.add_argument("--part", default="rows", help="List of rows, as differences or failures.")
    parser.add_argument("--over-rooms", action="store_true", help="Add up the counts of all rooms.")
    options = parser.parse_args(argv)
    if options.keep is not None:
        if not options.name or not options.columns:
            parser.error("--keep: expected --name and --columns beside it, got none")
        columns = options.columns.split(",")
        stored = StoredRows.of_run(options.keep, columns, options.over_rooms, options.part)
        atomic_io.write(options.pages / "data" / f"{options.name}.json", stored.to_bytes())
    for page in write_tables(options.pages):
        sys.stdout.write(f"{page}\n")


if __name__ == "__main__":
    main()
