"""Option ``--task``, and the refusal of options that belong to other tasks."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Annotated, Any

import typer

from andabata.app.usage import UsageError
from andabata.tasks.registration import ROOM_TASKS

OFFROAD = "offroad"
"""Task of ``--task`` on natural ground."""

TaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad, or navigation in rooms by a planar laser: spn, which reads points, or td3, "
        "the task of the improved TD3 and of GDAE.",
    ),
]


def check_task(task: str) -> None:
    """Refuse a task that does not exist.

    Raises:
        UsageError: If there is no such task.
    """
    if task not in (OFFROAD, *ROOM_TASKS):
        raise UsageError(f"--task: expected {OFFROAD}, {' or '.join(ROOM_TASKS)}, got {task!r}")


def refuse_options(task: str, groups: Sequence[tuple[Any, type]]) -> None:
    """Refuse options of another task that were given by mistake.

    Args:
        task: Task of the command.
        groups: Settings given, each with the group of options whose fields must be the defaults.

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
        other = f"--task {' or '.join(ROOM_TASKS) if task == OFFROAD else OFFROAD}"
        raise UsageError(
            f"{', '.join(given)}: expected options of --task {task} alone, got what belongs to "
            f"{other}; leave it out or give {other}"
        )
