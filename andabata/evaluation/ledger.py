"""Ledger of the splits: which table looked at which seeds, when, by which commit.

It is a file of JSON lines in the repository, an entry a line. A table judges a release once. Its
entry is written before the first drive, so that a run that was killed goes on in its folder and
nowhere else, and no figure of half a run is thrown away for a better one.
"""

import datetime
import secrets
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, ValidationError

from andabata.configuration.settings import explain
from andabata.configuration.usage import UsageError
from andabata.runs import atomic_io
from andabata.runs.folder import LEDGER, command_line, commit, versions
from andabata.runs.lock import LOCK, locked_file
from worlds.splits import Split

MARK = "judging.json"
"""File in the folder of a judging run: its entry, by which it is known again."""


class LedgerError(ValueError):
    """A ledger that is damaged or missing, or a table that has judged the release already."""


class LedgerEntry(BaseModel):
    """A table that looked at seeds.

    Attributes:
        table: Name of the table.
        split: Split of the seeds, as it is now.
        seeds: Seeds, in words.
        date: Day on which they were looked at first, or two days with ``to`` between them.
        commit: Commit of the code, or its version where no commit is known.
        command: Command that made the table.
        release: Release that is judged, None for none.
        state: ``begun`` until a judging run has its table, then ``finished``.
        run: Number of a judging run, which its folder knows, too.
        page: Page that has the table, under ``docs/results``.
        remark: Further remarks; empty for none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    table: str
    split: Split
    seeds: str
    date: str
    commit: str
    command: str
    release: str | None = None
    state: Literal["begun", "finished"] = "finished"
    run: str | None = None
    page: str | None = None
    remark: str = ""

    @property
    def identity(self) -> tuple[str | None, ...]:
        """What a run that goes on has in common with its beginning."""
        return self.table, self.release, self.seeds, self.commit, self.run


def find_ledger(given: Path | None, folder: Path | None = None) -> Path:
    """Return the path of the ledger.

    Args:
        given: Path that was given, None for the ledger of the checkout.
        folder: Folder in the checkout, None for the working directory.

    Raises:
        LedgerError: If there is none.
    """
    if given is not None:
        if given.is_file():
            return given
        raise LedgerError(
            f"--ledger: expected a file of JSON lines, got none at {given}; name the one of your "
            f"checkout, {LEDGER}, or begin one of your own with an empty file of that name"
        )
    here = (folder or Path.cwd()).absolute()
    path = next(
        (each / LEDGER for each in (here, *here.parents) if (each / LEDGER).is_file()), None
    )
    if path is None:
        raise LedgerError(
            f"--release: expected {LEDGER} in {here} or in a folder above it, got none; run it in "
            "a checkout of the release, or name a ledger with --ledger FILE"
        )
    return path


def read_ledger(path: Path) -> list[LedgerEntry]:
    """Return the entries of a ledger in their order.

    Raises:
        LedgerError: If a line is no entry.
        OSError: If the file cannot be read.
    """
    entries = []
    for number, line in enumerate(path.read_bytes().splitlines(), start=1):
        if not line.strip():
            continue
        try:
            entries.append(LedgerEntry.model_validate_json(line))
        except ValidationError as error:
            raise LedgerError(
                f"{path}, line {number}: expected an entry of the ledger, got {explain(error)}; "
                "restore the line, as by git checkout of the file"
            ) from error
    return entries


def write_ledger(path: Path, entries: Sequence[LedgerEntry]) -> None:
    """Write a ledger, an entry a line."""
    lines = (entry.model_dump_json(exclude_defaults=True) for entry in entries)
    atomic_io.write(path, "".join(f"{line}\n" for line in lines).encode())


@dataclass(frozen=True)
class JudgingRun:
    """A table that judges a release, with its place in the ledger.

    Attributes:
        ledger: Path of the ledger.
        entry: Entry of the run.
    """

    ledger: Path
    entry: LedgerEntry

    @classmethod
    def of(cls, table: str, release: str, seeds: str, ledger: Path) -> Self:
        """Return a run of today, of this code and this command.

        Args:
            table: Name of the table.
            release: Release that is judged.
            seeds: Seeds, in words.
            ledger: Path of the ledger.

        Raises:
            UsageError: If the code is of no commit: what judged would be unknown.
        """
        code = commit() or f"version {versions()['andabata']}"
        if code.endswith("+"):
            raise UsageError(
                f"--release: expected committed code, got changes after commit {code[:-1]}; "
                "commit them first: the ledger says which commit was judged"
            )
        entry = LedgerEntry(
            table=table,
            split="judging",
            seeds=seeds,
            date=datetime.datetime.now(datetime.UTC).date().isoformat(),
            commit=code,
            command=command_line(),
            release=release,
            state="begun",
            run=secrets.token_hex(4),
        )
        return cls(ledger, entry)

    def begin(self, folder: Path | None = None) -> Self:
        """Write the entry, or go on with the run that began in the folder.

        Args:
            folder: Folder of the run; None for one whose figures are seen at its end alone.

        Returns:
            The run with the entry that the ledger has.

        Raises:
            LedgerError: If the table has judged this release in another folder, or otherwise.
        """
        with locked_file(self.ledger):
            entries = read_ledger(self.ledger)
            before = [each for each in entries if self._is_of_same_table(each)]
            if before:
                return replace(self, entry=self._resumed(before[-1], folder))
            if folder is not None:
                _refuse_used(folder)
                atomic_io.write(folder / MARK, self.entry.model_dump_json().encode())
            write_ledger(self.ledger, [*entries, self.entry])
        return self

    def finish(self) -> LedgerEntry:
        """Return the entry after the ledger has it as finished."""
        done = self.entry.model_copy(update={"state": "finished"})
        with locked_file(self.ledger):
            entries = read_ledger(self.ledger)
            entries = [done if each.run == done.run else each for each in entries]
            write_ledger(self.ledger, entries)
        return done

    def _is_of_same_table(self, other: LedgerEntry) -> bool:
        """Return True for an entry of the same table and release."""
        return (other.table, other.release) == (self.entry.table, self.entry.release)

    def _resumed(self, before: LedgerEntry, folder: Path | None) -> LedgerEntry:
        """Return the entry of a run that goes on in its folder.

        Raises:
            LedgerError: If it is another run.
        """
        known = before.run if before.state == "begun" else None
        if folder is not None:
            known = _run_in(folder)
        # Without a folder nothing of a run that was interrupted was seen.
        mine = self.entry.model_copy(update={"run": known})
        if known is not None and mine.identity == before.identity:
            return before
        step = "develop on other seeds, and judge the next release"
        if before.state == "begun":
            step = f"go on with the same command at the same commit: {before.command}"
        raise LedgerError(
            f"--release: expected a release that {before.table} has not judged, got "
            f"{before.release}, judged on {before.date} at {before.commit} ({self.ledger}); {step}"
        )


def _run_in(folder: Path) -> str | None:
    """Return the number of the judging run that began in a folder, None for none."""
    try:
        return LedgerEntry.model_validate_json((folder / MARK).read_bytes()).run
    except (OSError, ValidationError):
        return None


def _refuse_used(folder: Path) -> None:
    """Refuse a folder that holds something: a judging run begins in one of its own.

    Raises:
        UsageError: If there is a file in it.
    """
    used = next((each for each in sorted(folder.iterdir()) if each.name != LOCK), None)
    if used is not None:
        raise UsageError(
            f"--out: expected a new or empty folder for a table that judges, got {folder} with "
            f"{used.name}; take another --out"
        )


def ledger_rows(entries: Sequence[LedgerEntry]) -> list[dict[str, str]]:
    """Return the rows of the table of a ledger, the latest first."""
    return [
        {
            "table": f"[{entry.table}]({entry.page})" if entry.page else entry.table,
            "split": entry.split,
            "seeds": entry.seeds,
            "date": entry.date,
            "commit": entry.commit,
            "release": entry.release or "",
            "command": f"`{entry.command}`" if entry.command else "",
            "remark": "; ".join(filter(None, (_unfinished(entry), entry.remark))),
        }
        for entry in reversed(entries)
    ]


def _unfinished(entry: LedgerEntry) -> str:
    """Return that a run has no table yet, or nothing."""
    return "" if entry.state == "finished" else "begun, not finished"
