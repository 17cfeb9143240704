"""What people see: messages and progress on stderr, so that stdout is for results alone."""

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console as RichConsole
from rich.console import JustifyMethod, RenderableType
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table


class Console:
    """Speaks to people on stderr and to programs on stdout."""

    def __init__(self, quiet: bool = False, as_json: bool = False) -> None:
        """Choose who listens.

        Args:
            quiet: Say nothing but results and errors.
            as_json: Results are one JSON object on stdout and nothing else.
        """
        self.as_json = as_json
        self._quiet = quiet
        self._console = RichConsole(stderr=True, quiet=quiet, highlight=False)

    def status(self, text: str) -> None:
        """Tell people something."""
        self._console.print(text, soft_wrap=True, markup=False)

    def result(self, data: Mapping[str, Any], table: RenderableType | None = None) -> None:
        """Give the result: the JSON object, or a table or text for people."""
        if self.as_json:
            sys.stdout.write(json.dumps(_finite(data)) + "\n")
        elif table is not None:
            RichConsole(highlight=False).print(
                table, markup=False, soft_wrap=isinstance(table, str)
            )

    @contextmanager
    def progress(self, what: str, total: int | None) -> Iterator["Step"]:
        """Show a bar with the time that is left; yields a function that moves it.

        Args:
            what: Is going on.
            total: Steps, None where nobody knows.
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
    """Moves a progress bar."""

    def __init__(self, bar: Progress, task: Any) -> None:  # noqa: ANN401 - rich's own id type.
        self._bar, self._task = bar, task

    def __call__(self, count: int = 1, note: str = "") -> None:
        """Move on by ``count`` and show a note."""
        self._bar.update(self._task, advance=count, note=note)


def table_of(rows: Sequence[Mapping[str, Any]], title: str = "") -> Table:
    """Return a table with one column a key of the first row."""
    table = Table(title=title or None, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for key in rows[0] if rows else ():
        side: JustifyMethod = "left" if isinstance(rows[0][key], str) else "right"
        table.add_column(key, justify=side, overflow="fold")
    for row in rows:
        table.add_row(*(_text(row.get(key)) for key in rows[0]))
    return table


def _text(value: object) -> str:
    """Return a table cell's text."""
    if value is None:
        return "-"
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def _finite(value: Any) -> Any:  # noqa: ANN401 - any JSON value.
    """Return data that strict JSON can hold: numbers that are not finite become null."""
    if isinstance(value, Mapping):
        return {str(key): _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value
