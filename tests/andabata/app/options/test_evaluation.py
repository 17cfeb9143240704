"""Options of evaluations: two tasks, each with its own."""

import pytest

from andabata.app.options.evaluation import (
    EvaluationModelOptions,
    RoomEvaluationOptions,
)
from andabata.configuration.usage import UsageError
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.models import shipped_policy
from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK
from andabata.tasks.rooms.td3_config import GDAE_RADIUS


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


def test_each_task_has_a_comparison_of_its_own():
    """TD3's is in its rooms and scenes, by each policy's laser, with room for GDAE's robot."""
    found = RoomEvaluationOptions().base("td3", 0)
    assert found.rooms == JUDGES_BY_TASK["td3"]
    assert (found.lidars, found.task.task) == (("trained",), "td3")
    assert found.task.clearance > GDAE_RADIUS
    named = RoomEvaluationOptions("env1,gates", "ten-beams").base("td3", 0)
    assert named.rooms == ("td3-env1", "td3-gate-060", "td3-gate-080", "td3-gate-100")
    assert named.lidars == ("ten-beams",)
    assert RoomEvaluationConfig.model_validate(found.model_dump(mode="json")) == found
