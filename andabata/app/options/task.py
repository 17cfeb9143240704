"""Option ``--task``, and the refusal of options that belong to other tasks."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Annotated, Any

import typer

from andabata.configuration.usage import UsageError
from andabata.tasks.registration import ROOM_TASK_NAMES

OFFROAD, BARN = "offroad", "barn"
"""Tasks of ``--task`` that are not driven in rooms."""

TaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad, or navigation in rooms by a planar laser: spn, which reads points, or td3, "
        "the task of the improved TD3 and of GDAE.",
    ),
]
EvaluationTaskName = Annotated[
    str,
    typer.Option(
        "--task",
        help="offroad; spn or td3: navigation in rooms by a planar laser; or barn: the BARN "
        "benchmark.",
    ),
]


def check_task(task: str, known: Sequence[str] = (OFFROAD, *ROOM_TASK_NAMES)) -> None:
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
        other: Task that the options belong to; None for off-road, or rooms from
            off-road.

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
        default = " or ".join(ROOM_TASK_NAMES) if task == OFFROAD else OFFROAD
        other = f"--task {other or default}"
        raise UsageError(
            f"{', '.join(given)}: expected options of --task {task} alone, got what belongs to "
            f"{other}; leave it out or give {other}"
        )
