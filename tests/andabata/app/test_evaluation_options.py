"""Options of evaluations: two tasks, each with its own."""

import pytest

from andabata.app.evaluation_options import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
    check_task,
    refuse_options,
)
from andabata.app.options import ClassifierOptions
from andabata.app.usage import UsageError
from andabata.evaluation.rooms import JUDGES, RoomEvaluationConfig
from andabata.models import shipped_policy


def test_the_default_in_rooms_is_the_papers_comparison():
    """Four rooms, seven lasers, both memories, 100 pairs."""
    assert RoomEvaluationOptions().base(0) == RoomEvaluationConfig()
    changed = RoomEvaluationOptions("env0", "ten-beams", "map", 7).base(3)
    assert (changed.rooms, changed.lidars, changed.memories) == (
        *(("spn-env0",), ("ten-beams",), ("map",)),
    )
    assert (changed.pairs, changed.seed) == (7, 3)
    assert RoomEvaluationConfig().rooms == JUDGES


def test_options_of_another_task_are_refused():
    """Each option that is not its default is named; those of a wider group are not looked at."""
    given = OffroadEvaluationOptions(world="maze", goals=1)
    with pytest.raises(UsageError, match=r"^--world, --goals: expected options of --task spn"):
        refuse_options("spn", [(given, OffroadEvaluationOptions)])
    models = EvaluationModelOptions(ground_classifier="x", policy=["a"])
    with pytest.raises(UsageError, match=r"^--ground-classifier: .*or give --task offroad$"):
        refuse_options("spn", [(models, ClassifierOptions)])
    refuse_options("offroad", [(RoomEvaluationOptions(), RoomEvaluationOptions)])


def test_off_road_there_is_one_policy():
    """The shipped one by default or by name; several are refused."""
    for policy in (None, ["shipped"]):
        assert EvaluationModelOptions(policy=policy).load().policy is shipped_policy()
    with pytest.raises(UsageError, match="--policy: expected one off-road, got 2"):
        EvaluationModelOptions(policy=["a", "b"]).load()


def test_an_unknown_task_is_refused():
    """The error says which tasks there are."""
    check_task("spn")
    with pytest.raises(UsageError, match="--task: expected offroad or spn, got 'moon'"):
        check_task("moon")
