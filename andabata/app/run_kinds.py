"""Registry of the kinds of run: one line has the options, comparison, report, table and view.

Functions stand as ``module:name``, so that the help answers before anything heavy is imported.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

from andabata.app.command import Given
from andabata.app.console import table_of
from andabata.app.options.evaluation import (
    BarnEvaluationOptions,
    JudgedRobotOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
    TrialOptions,
)
from andabata.app.options.models import ClassifierOptions
from andabata.app.options.release import ReleaseOptions
from andabata.app.options.shared import RobotOptions, SettingsOptions
from andabata.configuration.usage import UsageError
from andabata.report.columns import spoken
from andabata.tasks.registration import ROOM_TASK_NAMES

if TYPE_CHECKING:
    from rich.console import RenderableType

    from andabata.app.jobs.evaluation import Evaluation

OFFROAD, BARN = "offroad", "barn"
"""Tasks of ``--task`` that are not driven in rooms."""


@dataclass(frozen=True)
class EvaluationRequest:
    """What a command was asked to evaluate.

    Attributes:
        task: Value of ``--task``.
        given: Groups of options.
        settings: Settings over those of the options.
        seed: Seed of the command.
        has_folder: True if the run has a folder.
        typed: Names of the options that were typed, at their defaults or not.
    """

    task: str
    given: Given
    settings: SettingsOptions
    seed: int
    has_folder: bool
    typed: frozenset[str] = frozenset()


@dataclass(frozen=True)
class RunKind:
    """Kind of run.

    Attributes:
        name: Command that makes it, as people are told.
        verbs: Commands as ``run.json`` has them.
        report: Function that returns the page and its figures from the folder of a run, or, if it
            takes several, from their folders and ``ReportOptions``.
        table: Function that returns the table for people from the figures or the result; or the key
            of the figures whose rows are the table.
        columns: Columns of such rows that a terminal has room for; none for all.
        tasks: Values of ``--task``; none for a verb without.
        options: Groups of options that belong to its task, and to those that name them too.
        shared: Groups of options of the verb that other tasks of it refuse.
        evaluation: Function that returns the ``Evaluation`` of an ``EvaluationRequest``; empty for
            what ``evaluate`` does not run.
        view: Function that returns the view of a folder; empty for none.
        takes_several: True if several runs go into one report.
    """

    name: str
    verbs: tuple[str, ...]
    report: str
    table: str
    columns: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    options: tuple[type, ...] = ()
    shared: tuple[type, ...] = ()
    evaluation: str = ""
    view: str = ""
    takes_several: bool = False

    @property
    def task_words(self) -> str:
        """Its tasks in words."""
        return " or ".join(self.tasks)

    def function(self, part: str) -> Callable[..., Any]:
        """Return a function of the registry: ``report``, ``table``, ``evaluation`` or ``view``."""
        found: Callable[..., Any] = resolve_name(getattr(self, part))
        return found

    def shown(self, data: Mapping[str, Any]) -> "RenderableType":
        """Return the table for people of a report's figures."""
        if ":" not in self.table:
            return table_of([spoken(row, self.columns or None) for row in data[self.table]])
        table: RenderableType = self.function("table")(data)
        return table

    def start(self, request: EvaluationRequest) -> "Evaluation":
        """Return the evaluation of a request, after a check that no other task's options are there.

        Raises:
            UsageError: If an option belongs to another task, or has a value that there is not.
            SettingsError: If a setting is unknown or out of bounds.
        """
        refuse_foreign(self, request.task, request.given)
        evaluation: Evaluation = self.function("evaluation")(request)
        return evaluation


_APP, _REPORT = "andabata.app.", "andabata.report."

_ATTEMPT = ("drive", "goal", "outcome", "time_s", "distance_m", "spl")
"""Columns of an attempt that a terminal has room for."""

_ACTOR = (
    *("actor", "seeds", "best_score_hardest_room", "best_score", "seeds_with_all_tasks"),
    *("last_reached", "best_steps_to_oracle"),
)
"""Columns of an actor that a terminal has room for."""

RUN_KINDS: list[RunKind] = [
    RunKind(
        "clouds generate",
        ("clouds generate",),
        report=f"{_REPORT}clouds:report_clouds",
        table="splits",
    ),
    RunKind(
        "classifier train or evaluate",
        ("classifier train", "classifier evaluate"),
        report=f"{_REPORT}classifier:report_classifier",
        table="andabata.evaluation.classifier:tables",
    ),
    RunKind(
        "classifier ground",
        ("classifier ground",),
        report=f"{_REPORT}classifier:report_ground",
        table="andabata.evaluation.classifier:ground_classifier_table",
    ),
    RunKind(
        "train",
        ("train",),
        tasks=(OFFROAD,),
        shared=(RobotOptions, ClassifierOptions),
        report=f"{_REPORT}training:report_training",
        table="tests",
        takes_several=True,
    ),
    RunKind(
        "train --task spn",
        ("train",),
        tasks=("spn",),
        report=f"{_REPORT}training:report_training",
        table="groups",
        columns=_ACTOR,
        takes_several=True,
    ),
    RunKind(
        "train --task td3",
        ("train",),
        tasks=("td3",),
        report=f"{_REPORT}training:report_training",
        table="groups",
        takes_several=True,
    ),
    RunKind(
        "drive",
        ("drive",),
        report=f"{_REPORT}drive:report_drives",
        table="goals",
        columns=_ATTEMPT,
        view=f"{_APP}viewing:drive_view",
        takes_several=True,
    ),
    RunKind(
        "evaluate",
        ("evaluate",),
        tasks=(OFFROAD,),
        options=(TrialOptions, OffroadEvaluationOptions, ReleaseOptions),
        shared=(JudgedRobotOptions, ClassifierOptions),
        evaluation=f"{_APP}jobs.offroad:offroad_evaluation",
        report=f"{_REPORT}evaluation:report_evaluation",
        table=f"{_APP}perturbation_tables:offroad_tables",
    ),
    RunKind(
        "evaluate in rooms",
        ("evaluate",),
        tasks=ROOM_TASK_NAMES,
        options=(RoomEvaluationOptions, ReleaseOptions),
        evaluation=f"{_APP}jobs.rooms:room_evaluation",
        report=f"{_REPORT}rooms:report_rooms",
        table=f"{_APP}tables:room_tables",
        view=f"{_APP}viewing:room_view",
    ),
    RunKind(
        "evaluate --task barn",
        ("evaluate",),
        tasks=(BARN,),
        options=(TrialOptions, BarnEvaluationOptions),
        evaluation=f"{_APP}jobs.barn:barn_evaluation",
        report=f"{_REPORT}barn:report_barn",
        table=f"{_APP}barn_tables:barn_tables",
        view=f"{_APP}viewing:barn_view",
    ),
    RunKind(
        "lidar-study",
        ("lidar-study",),
        report=f"{_REPORT}rooms:report_study",
        table=f"{_APP}tables:study_table",
        view=f"{_APP}viewing:room_view",
    ),
]
"""All kinds of run, in the order in which people are told of them."""


def kinds_of(verb: str) -> list[RunKind]:
    """Return the kinds of a verb, one or more for its tasks."""
    return [kind for kind in RUN_KINDS if verb in kind.verbs]


def option_groups(verb: str) -> tuple[type, ...]:
    """Return the groups of options that belong to the tasks of a verb, each once."""
    return tuple(dict.fromkeys(group for kind in kinds_of(verb) for group in kind.options))


def kind_of_task(verb: str, task: str) -> RunKind:
    """Return the kind of a task of a verb.

    Raises:
        UsageError: If there is no such task.
    """
    found = next((kind for kind in kinds_of(verb) if task in kind.tasks), None)
    if found is None:
        *first, last = (name for kind in kinds_of(verb) for name in kind.tasks)
        raise UsageError(f"--task: expected {', '.join(first)} or {last}, got {task!r}")
    return found


def refuse_foreign(kind: RunKind, task: str, given: Given) -> None:
    """Refuse options of other tasks that were given by mistake.

    Args:
        kind: Kind of the run.
        task: Task of the command.
        given: Groups of options.

    Raises:
        UsageError: If an option of another task is given.
    """
    # Ignored without a word, such an option would seem to be what the figures are of.
    seen = {*kind.options, *kind.shared}
    for other in kinds_of(kind.verbs[0]):
        groups = [group for group in (*other.options, *other.shared) if group not in seen]
        # A group that several tasks share is named once, with the first of them.
        seen.update(groups)
        names = [name for group in groups for name in _changed(group, given)]
        if names:
            owner = f"--task {other.task_words}"
            raise UsageError(
                f"{', '.join(names)}: expected options of --task {task} alone, got what belongs to "
                f"{owner}; leave it out or give {owner}"
            )


def _changed(group: type, given: Given) -> list[str]:
    """Return the options of a group that are not at their defaults."""
    values: Any = given(group)
    return [
        f"--{option.name.replace('_', '-')}"
        for option in fields(group)
        if getattr(values, option.name) != option.default
    ]


def known_kind(about: Mapping[str, Any]) -> RunKind | None:
    """Return the kind of a run by its description, or None for no known one."""
    kinds = kinds_of(str(about.get("verb")))
    task = _task_of(about)
    return next((kind for kind in kinds if not kind.tasks or task in kind.tasks), None)


def _task_of(about: Mapping[str, Any]) -> str:
    """Return the task of a run; folders of earlier versions do not name it."""
    config: Mapping[str, Any] = about.get("config") or {}
    stages: Sequence[Any] = tuple((config.get("stages") or {}).values())
    if stages:
        tasks = {str(stage["environment"].get("task")) for stage in stages}
        return tasks.pop() if tasks in ({name} for name in ROOM_TASK_NAMES) else OFFROAD
    return str(about.get("task") or (BARN if "vehicle" in config else OFFROAD))
