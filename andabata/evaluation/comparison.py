"""Comparisons: contenders drive the same scenarios with the same noise, and a killed run goes on.

A kind of evaluation implements ``Comparison``; ``run_comparison`` is the loop of all kinds.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Protocol, TypeVar

from andabata.engine import Engine, SerialEngine
from andabata.evaluation.attempt import Attempt
from andabata.runs import atomic_io
from andabata.runs.folder import make_folder
from andabata.runs.journal import Entry, Journal

Cell = TypeVar("Cell", bound=Hashable)

Attempts = tuple[Attempt[Any], ...]
"""Attempts of a cell, in their order."""


class DrivenCell(NamedTuple):
    """Attempts of a cell, and the files that go with them.

    Attributes:
        attempts: Attempts.
        files: Bytes of files by their paths in the folder of the run, such as pictures of failures.
    """

    attempts: Attempts
    files: Mapping[str, bytes] = {}


class Comparison(Protocol[Cell]):
    """A kind of evaluation with its settings; processes import it with all that it needs to drive.

    Attributes:
        unit: Name of the cells, in the plural.
        journal: Name of the journal's file in the folder of a run.
    """

    unit: ClassVar[str]
    journal: ClassVar[str]

    @property
    def about(self) -> Entry:
        """Heading of the journal: all that the attempts depend on, ready for JSON.

        A journal with another heading is that of another run.
        """

    def cells(self) -> Sequence[Cell]:
        """Return the cells, each of which is one task of an engine and carries its own seed."""

    def label(self, cell: Cell) -> str:
        """Return what a cell is called while it is driven."""

    def drive(self, cell: Cell) -> DrivenCell:
        """Drive a cell, in any process."""

    def encode(self, cell: Cell, attempts: Attempts) -> Entry:
        """Return the entry of the journal for a cell, ready for JSON."""

    def decode(self, entry: Entry) -> tuple[Cell, Attempts]:
        """Return the cell of an entry and its attempts, as far as the entry keeps them."""


OnCell = Callable[[Cell], None]
"""Function that takes a cell before it counts as finished, or that stood in the journal."""


def run_comparison(
    comparison: Comparison[Cell],
    *,
    engine: Engine | None = None,
    folder: Path | None = None,
    on_cell: OnCell[Cell] | None = None,
) -> list[Attempt[Any]]:
    """Drive every cell that the journal lacks and return the attempts of all, by cell.

    Attempts are those that the journal keeps, so that an evaluation that was killed and goes on
    ends as one that was not.

    Args:
        comparison: Comparison that is driven.
        engine: Engine that runs the cells, on which the result does not depend; None for this
            process.
        folder: Folder for the journal and the files of the cells, or None. The files of a
            cell are written before the journal knows it: a kill in between drives it again.
        on_cell: Function that is called with each cell, at once for those of the journal.

    Raises:
        ValueError: If the journal belongs to another evaluation, or a comparison refuses a cell.
    """
    journal = Journal(folder / comparison.journal if folder else None, comparison.about)
    finished = dict(comparison.decode(entry) for entry in journal.entries)
    cells, report = comparison.cells(), on_cell or _ignore
    for cell in finished:
        report(cell)
    # A journal may hold cells of a longer run: they are shown, and left out of the result.
    missing = [cell for cell in cells if cell not in finished]
    for _, cell, driven in (engine or SerialEngine()).run(comparison.drive, missing):
        if folder is not None:
            _write(folder, driven.files)
        report(cell)
        entry = comparison.encode(cell, driven.attempts)
        # What the journal rounds or leaves out is missing here, too, as in a run that goes on.
        finished[cell] = comparison.decode(entry)[1]
        journal.append(entry)
    return [attempt for cell in cells for attempt in finished[cell]]


def _ignore(_: object) -> None:
    """Do nothing."""


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the files of a cell into the folder of a run."""
    for name, data in files.items():
        atomic_io.write(make_folder((folder / name).parent) / Path(name).name, data)
