"""The page for users of 0.1.0: old names of settings are refused, new ones beside them known."""

import re

import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import SettingsError, resolve
from andabata.datasets.labelled_cloud import CloudsConfig
from andabata.evaluation.barn import BarnEvaluationConfig
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.navigation.planar.mover_shield import MoverShieldConfig
from andabata.tasks.rewards import ImprovedRewardConfig
from andabata.tasks.rooms.catalogue import ROOM_TASKS
from andabata.training.distillation import DistillationConfig
from andabata.training.forest_adaptation import DriveAdaptationConfig
from andabata.training.plans import load_plan
from tests.support.documents import ROOT
from traversability.cartesian.classifier import GroundClassifierConfig
from traversability.forest_training import ForestConfig

PAGE = (ROOT / "docs/upgrade-from-0.1.md").read_text(encoding="utf-8")


def room_evaluation():
    """Return an evaluation in rooms with a shield, and with the reward that has limits."""
    task = ROOM_TASKS["td3"](shield=MoverShieldConfig(), reward=ImprovedRewardConfig())
    return RoomEvaluationConfig(task=task)


BASES = {
    "Robot": SimulatedRobotConfig,
    "Labelled clouds": CloudsConfig,
    "Cell classifier": ForestConfig,
    "Ground classifier": GroundClassifierConfig,
    "Adaptation": DriveAdaptationConfig,
    "Training off-road": load_plan,
    "Training in rooms, TD3": lambda: load_plan("gdae", task="td3"),
    "Evaluation in rooms": room_evaluation,
    "BARN": BarnEvaluationConfig,
    "Distillation": DistillationConfig,
}


def renamed():
    """Return the group, the old and the new name of each row."""
    sections = re.split(r"^### (.+)$", PAGE.partition("## Files")[0], flags=re.M)[1:]
    return [
        (group, *row)
        for group, text in zip(sections[::2], sections[1::2], strict=True)
        for row in re.findall(r"^\| `([^`]+)` \| `([^`]+)`", text, re.M)
    ]


def is_known(base, path):
    """Return True if a configuration has the field, whatever the value."""
    try:
        resolve(type(base), None, [f"{path}=0.123"], base)
    except SettingsError as error:
        return "known field" not in str(error) and "group of fields" not in str(error)
    return True


def test_each_group_has_names():
    """The groups are those of configurations, and each has a row."""
    assert {group for group, _, _ in renamed()} == set(BASES)
    assert len(renamed()) > 45


@pytest.mark.parametrize("group", BASES)
def test_old_names_are_refused_and_new_ones_known(group):
    """By the configuration of their group."""
    base = BASES[group]()
    for _, old, new in [row for row in renamed() if row[0] == group]:
        assert not is_known(base, old), old
        assert is_known(base, new), new


def test_an_old_name_is_answered_with_the_new_one():
    """The error of an old name lists it, or means it."""
    for _, old, new in [row for row in renamed() if row[0] == "Labelled clouds"]:
        with pytest.raises(SettingsError, match=rf"\b{new}\b"):
            resolve(CloudsConfig, None, [f"{old}=0.1"])
