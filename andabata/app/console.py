"""Output of commands: status and progress on stderr, so that stdout is for results alone."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console as RichConsole
from rich.console import JustifyMethod, RenderableType
from rich.live import Live
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from andabata.printable import printable
from andabata.runs.strict_json import dumps

COMPILES = "compiling kernels, once after an installation or an update: a minute or two ..."
"""Line before the silence of a first use."""


class Console:
    """Prints status and progress on stderr, and the result on stdout."""

    def __init__(self, quiet: bool = False, as_json: bool = False) -> None:
        """Make a console.

        Args:
            quiet: True to print nothing but results and errors.
            as_json: True to print the result as one JSON object and nothing else on stdout.
        """
        self.as_json = as_json
        self._quiet = quiet
        # stderr: stdout carries the result alone, which may go into a pipe or a file.
        self._console = RichConsole(stderr=True, quiet=quiet, highlight=False)

    @property
    def shows_live(self) -> bool:
        """True if people watch: stderr is a terminal, and nothing asks for quiet or for JSON."""
        return self._console.is_terminal and not self._quiet and not self.as_json

    @contextmanager
    def live(self, shown: RenderableType) -> Iterator[None]:
        """Show something that changes, until the block ends; its last state stays."""
        with Live(shown, console=self._console, refresh_per_second=4):
            yield

    def status(self, text: str) -> None:
        """Print a line on stderr, unless quiet."""
        self._console.print(printable(text), soft_wrap=True, markup=False)

    def result(self, data: Mapping[str, Any], *parts: RenderableType) -> None:
        """Print the result: the data as JSON, or its parts for people.

        Args:
            data: The whole result; numbers that are not finite become null.
            parts: Tables and texts; lines of a text are not wrapped.
        """
        if self.as_json:
            sys.stdout.write(dumps(_printable(data)) + "\n")
            return
        for part in parts:
            shown = printable(part) if isinstance(part, str) else part
            soft = isinstance(part, str)
            RichConsole(highlight=False).print(shown, markup=False, soft_wrap=soft)

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator["Step"]:
        """Show a progress bar with the remaining time; yields a function that advances it.

        Args:
            what: Name of the work.
            total: Number of steps; None if it is unknown.
        """
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("ETA"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[note]}"),
        )
        with Progress(*columns, console=self._console, disable=self._quiet) as bar:
            task = bar.add_task(what, total=total, note="")
            yield Step(bar, task)


class Step:
    """Function that advances a progress bar."""

    def __init__(self, bar: Progress, task: TaskID) -> None:
        """Take the bar and its task."""
        self._bar, self._task = bar, task

    def __call__(self, count: int = 1, note: str = "") -> None:
        """Advance by ``count`` steps and show a note."""
        self._bar.update(self._task, advance=count, note=note)


def table_of(rows: Sequence[Mapping[str, Any]], title: str = "") -> Table:
    """Return a table with one column for each key of the first row."""
    table = Table(
        title=printable(title) or None, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for key in rows[0] if rows else ():
        side: JustifyMethod = "left" if isinstance(rows[0][key], str) else "right"
        # Folded, not cut: a path or a name that ends in dots cannot be copied.
        table.add_column(key, justify=side, overflow="fold")
    for row in rows:
        table.add_row(*(_text(row.get(key)) for key in rows[0]))
    return table


def _text(value: object) -> str:
    """Return a table cell's text."""
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else printable(str(value))


def _printable(value: Any) -> Any:  # noqa: ANN401 - any JSON value.
    """Return data for JSON whose texts are Unicode."""
    if isinstance(value, Mapping):
        return {printable(str(key)): _printable(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_printable(item) for item in value]
    return printable(value) if isinstance(value, str) else value
