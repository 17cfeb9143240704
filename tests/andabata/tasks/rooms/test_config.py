"""Settings of drives in rooms: which rooms there are, what is observed, what is refused."""

import numpy as np
import pytest
from pydantic import ValidationError

from andabata.tasks.rewards import GdaeRewardConfig, ImprovedRewardConfig, RoomRewardConfig
from andabata.tasks.rooms.catalogue import JUDGES_BY_TASK
from andabata.tasks.rooms.config import (
    JudgingRoomError,
    named_parts,
    refuse_judging_rooms,
    room_actions,
)
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from worlds.rooms.catalogue import make_room, room_names


def test_a_pool_follows_the_named_rooms():
    """Random rooms of the kind asked for have the indices after the named ones."""
    config = SpnConfig(rooms=("spn-env1",), random_rooms=2, random_kind="clutter-movers")
    assert config.all_rooms == ("spn-env1", "clutter-movers-0", "clutter-movers-1")
    assert SpnConfig(random_rooms=1).all_rooms[-1] == "random-0"
    assert Td3TaskConfig(random_rooms=2).all_rooms == ("clutter-0", "clutter-1")


def test_snapshots_are_compared_in_rooms_that_no_pool_holds():
    """Named rooms come alike; without any, 32 random ones of the kind beyond every pool do."""
    assert SpnConfig(random_rooms=4).unseen.all_rooms == SpnConfig().rooms
    assert SpnConfig().unseen.main_room_share == 0.25
    config = Td3TaskConfig(random_rooms=1000, random_kind="clutter-movers")
    unseen = config.unseen.all_rooms
    assert len(unseen) == 32
    assert not set(unseen) & set(config.all_rooms)
    assert all(name.startswith("clutter-movers-") for name in unseen)
    assert Td3TaskConfig.model_validate(config.unseen.model_dump()) == config.unseen


JUDGES = [name for name in room_names() if make_room(name).judges]


def test_the_rooms_of_the_comparisons_are_those_that_judge():
    """No more and no fewer: a room that is compared in, and could be trained in, has no use."""
    assert sorted(JUDGES) == sorted(name for names in JUDGES_BY_TASK.values() for name in names)


@pytest.mark.parametrize("name", JUDGES)
def test_rooms_that_judge_are_refused_by_name(name):
    """In training and in validation, alone or beside others; the message says what to do."""
    for config in (SpnConfig(rooms=(name,)), Td3TaskConfig(rooms=("gdae", name), random_rooms=1)):
        for one in (config, config.unseen, config.fixed):
            with pytest.raises(JudgingRoomError, match=f"got {name}, for judging alone; name oth"):
                refuse_judging_rooms(one)


def test_a_judging_room_of_a_file_is_refused_too(tmp_path):
    """What counts is what the room says, not where it stands."""
    file = tmp_path / "mine.toml"
    file.write_text('about = "mine"\nhalf = [2, 2]\njudges = true\n')
    with pytest.raises(JudgingRoomError, match=r"mine\.toml"):
        refuse_judging_rooms(SpnConfig(rooms=(str(file),)))
    file.write_text('about = "mine"\nhalf = [2, 2]\n')
    refuse_judging_rooms(SpnConfig(rooms=(str(file),)))


def test_rooms_to_train_in_are_not_refused():
    """Defaults, and random rooms by the kind or by name."""
    for config in (SpnConfig(), Td3TaskConfig(), SpnConfig(rooms=("random-7300",))):
        for one in (config, config.unseen):
            refuse_judging_rooms(one)


def test_a_task_is_somewhere():
    """Neither a named nor a random room is an error."""
    with pytest.raises(ValidationError, match="rooms: expected a name or random_rooms"):
        Td3TaskConfig(random_rooms=0)


def test_drift_is_a_factor_of_that_of_barns_robot():
    """Scale and heading are those of the benchmark; slip averages over a longer period."""
    assert Td3TaskConfig().odometry_errors is None
    for factor in (1.0, 3.0):
        errors = Td3TaskConfig(drift=factor).odometry_errors
        expected = np.array([0.01, 0.005, 0.03 / np.sqrt(0.1 / 0.05)]) * factor
        np.testing.assert_allclose(errors, expected)
    assert SpnConfig(drift=1.0).odometry_errors.slip == pytest.approx(0.015)


def test_fixed_tasks_are_those_of_all_named_rooms():
    """Each has its room's index; a pool has none."""
    config = SpnConfig(rooms=("spn-env5", "spn-env1", "spn-crowded"))
    assert [index for index, _ in config.fixed_tasks] == [1] * 4 + [2] * 5
    assert config.fixed_tasks[4][1] == make_room("spn-crowded").tasks[0]
    assert Td3TaskConfig().fixed_tasks == []


def test_rewards_are_told_by_their_kind():
    """Constants without a kind are those of the reward by progress."""
    for data, expected in (
        ({"step": -0.01}, RoomRewardConfig(step=-0.01)),
        ({}, RoomRewardConfig()),
        ({"kind": "gdae", "goal": 80.0}, GdaeRewardConfig(goal=80.0)),
        ({"kind": "improved", "proportional": True}, ImprovedRewardConfig(proportional=True)),
    ):
        config = Td3TaskConfig.model_validate({"reward": data})
        assert config.reward == expected
        assert type(config.reward) is type(expected)
        assert Td3TaskConfig.model_validate(config.model_dump(mode="json")) == config
    with pytest.raises(ValidationError, match="reward"):
        Td3TaskConfig.model_validate({"reward": {"kind": "other"}})


def test_terms_are_in_radians_and_of_the_lasers_range():
    """Fields of view become radians, and ranges end at the laser's largest."""
    config = Td3TaskConfig(window_fov_deg=90.0, window_unit="ranges", earlier_scan=3, windows=9)
    assert config.terms.window_fov == pytest.approx(np.pi / 2)
    assert (config.terms.as_ranges, config.terms.earlier_scan) == (True, 3)
    spec = config.observations
    assert spec.term("ranges").high == config.lidar.max_range
    assert spec.size == 9 + 9 + 3 + 2
    assert room_actions(config.robot).high == (1.0, 1.0)


def test_tracked_movers_are_off_by_default():
    """No movers are observed but by a setting of their own, six numbers each."""
    assert Td3TaskConfig().terms.tracked_movers == SpnConfig().tracked_movers == 0
    config = Td3TaskConfig(tracked_movers=3)
    assert config.observations.size == Td3TaskConfig().observations.size + 3 * 6


def test_names_of_rooms_and_lasers_become_fields():
    """One name or several; what is not named is not a field; a wrong label is refused."""
    assert named_parts(None, None) == {}
    assert named_parts("spn-env1", None) == {"rooms": ("spn-env1",)}
    parts = named_parts(["a", "b"], "180|20|10|0.05")
    assert (parts["rooms"], parts["lidar"].x) == (("a", "b"), 0.05)
    with pytest.raises(ValueError, match="lidar: expected"):
        named_parts(None, "wide")
