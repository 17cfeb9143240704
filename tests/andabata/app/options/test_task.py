"""Option ``--task``: tasks off-road and in rooms, each kind with options of its own."""

import pytest

from andabata.app.options.evaluation import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
)
from andabata.app.options.shared import ClassifierOptions
from andabata.app.options.task import OFFROAD, ROOM_TASK_NAMES, check_task, refuse_options
from andabata.configuration.usage import UsageError
from andabata.tasks.rooms import catalogue
from andabata.training.plans import TASKS


def test_options_of_another_task_are_refused():
    """Each option that is not its default is named; those of a wider group are not looked at."""
    given = OffroadEvaluationOptions(world="maze", goals=1)
    with pytest.raises(UsageError, match=r"^--world, --goals: expected options of --task spn"):
        refuse_options("spn", [(given, OffroadEvaluationOptions)])
    models = EvaluationModelOptions(ground_classifier="x", policy=["a"])
    with pytest.raises(UsageError, match=r"^--ground-classifier: .*or give --task offroad$"):
        refuse_options("spn", [(models, ClassifierOptions)])
    refuse_options("offroad", [(RoomEvaluationOptions(), RoomEvaluationOptions)])


def test_an_unknown_task_is_refused():
    """The error says which tasks there are."""
    for task in ("offroad", "spn", "td3"):
        check_task(task)
    with pytest.raises(UsageError, match="--task: expected offroad, spn or td3, got 'moon'"):
        check_task("moon")


def test_tasks_in_rooms_are_those_that_there_are_plans_for():
    """The option knows the tasks of the plans and of the settings."""
    assert (OFFROAD, *ROOM_TASK_NAMES) == TASKS
    assert tuple(catalogue.ROOM_TASKS) == ROOM_TASK_NAMES
    given = RoomEvaluationOptions(memory="map")
    with pytest.raises(UsageError, match=r"^--memory: .* leave it out or give --task spn or td3$"):
        refuse_options("offroad", [(given, RoomEvaluationOptions)])
