"""Option ``--task``, and the refusal of options that belong to the other task."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Annotated, Any

import typer

from andabata.app.usage import UsageError

OFFROAD, SPN, BARN = "offroad", "spn", "barn"
"""Tasks of ``--task``."""

TaskName = Annotated[
    str, typer.Option("--task", help="offroad, or spn: navigation in rooms by a planar laser.")
]
EvaluationTaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad; spn: navigation in rooms by a planar laser; or barn: the BARN benchmark.",
    ),
]


def check_task(task: str, known: Sequence[str] = (OFFROAD, SPN)) -> None:
    """Refuse a task that does not exist.

    Args:
        task: Value of the option.
        known: Tasks of the command.

    Raises:
        UsageError: If there is no such task.
    """
    if task not in known:
        *first, last = known
        raise UsageError(f"--task: expected {', '.join(first)} or {last}, got {task!r}")


def refuse_options(task: str, groups: Sequence[tuple[Any, type]], other: str | None = None) -> None:
    """Refuse options of another task that were given by mistake.

    Args:
        task: Task of the command.
        groups: Settings given, each with the group of options whose fields must be the defaults.
        other: Task that the options belong to; None for the other one of off-road and ``spn``.

    Raises:
        UsageError: If an option is given.
    """
    given = [
        f"--{option.name.replace('_', '-')}"
        for values, group in groups
        for option in fields(group)
        if getattr(values, option.name) != option.default
    ]
    if given:
        other = other or (OFFROAD if task == SPN else SPN)
        raise UsageError(
            f"{', '.join(given)}: expected options of --task {task} alone, got what belongs to "
            f"--task {other}; leave it out or give --task {other}"
        )
