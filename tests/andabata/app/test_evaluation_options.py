"""Options of evaluations: two tasks, each with its own."""

import pytest

from andabata.app.evaluation_options import (
    EvaluationModelOptions,
    RoomEvaluationOptions,
)
from andabata.app.usage import UsageError
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.models import shipped_policy
from andabata.tasks.room_tasks import JUDGES_BY_TASK


def test_the_default_in_rooms_is_the_papers_comparison():
    """Four rooms, seven lasers, both memories, 100 pairs."""
    assert RoomEvaluationOptions().base("spn", 0) == RoomEvaluationConfig()
    changed = RoomEvaluationOptions("env0", "ten-beams", "map", 7).base("spn", 3)
    assert (changed.rooms, changed.lidars, changed.memories) == (
        *(("spn-env0",), ("ten-beams",), ("map",)),
    )
    assert (changed.pairs, changed.seed) == (7, 3)
    assert RoomEvaluationConfig().rooms == JUDGES_BY_TASK["spn"]


def test_off_road_there_is_one_policy():
    """The shipped one by default or by name; several are refused."""
    for policy in (None, ["shipped"]):
        assert EvaluationModelOptions(policy=policy).load().policy is shipped_policy()
    with pytest.raises(UsageError, match="--policy: expected one off-road, got 2"):
        EvaluationModelOptions(policy=["a", "b"]).load()
