"""Option ``--task``: two tasks, each with options of its own."""

import pytest

from andabata.app.evaluation_options import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
)
from andabata.app.options import ClassifierOptions
from andabata.app.task_options import check_task, refuse_options
from andabata.app.usage import UsageError


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
    check_task("spn")
    with pytest.raises(UsageError, match="--task: expected offroad or spn, got 'moon'"):
        check_task("moon")
