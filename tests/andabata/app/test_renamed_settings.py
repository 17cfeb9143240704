"""Fields that had another name: the message gives the new one, and each new name exists."""

import typing
from collections.abc import Iterator

import pytest
from pydantic import BaseModel

from andabata.app.renamed_settings import RENAMED_FIELDS, new_name
from andabata.app.settings import SettingsError, resolve
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.offroad import EvaluationConfig
from andabata.tasks.offroad import OffroadConfig
from andabata.training.plans import TrainingPlan
from rl.actor_critic import ActorCriticConfig
from rl.sac import SacConfig


def fields_of(model: type[BaseModel], path: str = "") -> Iterator[str]:
    """Yield the dotted paths of all fields of a model."""
    for name, field in model.model_fields.items():
        yield path + name
        todo = [field.annotation]
        while todo:
            kind = todo.pop()
            if isinstance(kind, type) and issubclass(kind, BaseModel):
                yield from fields_of(kind, f"{path}{name}.")
            todo += typing.get_args(kind)


FIELDS = {
    path
    for model in (
        SimulatedRobotConfig,
        OffroadConfig,
        EvaluationConfig,
        TrainingPlan,
        ActorCriticConfig,
        SacConfig,
    )
    for path in fields_of(model)
}


@pytest.mark.parametrize(
    ("group", "old", "new"),
    [(group, old, new) for group, names in RENAMED_FIELDS.items() for old, new in names.items()],
)
def test_every_new_name_is_a_field_and_no_old_one_is(group, old, new):
    """Each group has a field of the new name and none of the old one."""
    if group:
        homes = {path for path in FIELDS if path.rpartition(".")[2] == group}
        assert homes
        assert all(f"{home}.{new}" in FIELDS for home in homes)
        assert not any(f"{home}.{old}" in FIELDS for home in homes)
    else:
        assert any(path.rpartition(".")[2] == new for path in FIELDS)
        assert not any(path.rpartition(".")[2] == old for path in FIELDS)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("rig.local_map.bumps.rise", "simulated_robot.local_planner.low_obstacles.min_height"),
        ("local_map.shy", "local_planner.costs.inflation_radius"),
        ("rollouts.haste", "rollouts.max_speed_scale"),
        ("sensing.site.altitude", "sensing.geo_reference.altitude"),
    ],
)
def test_a_path_is_renamed_part_by_part(old, new):
    """All old words of a path are replaced."""
    assert new_name(old.split(".")) == new


def test_a_name_of_this_version_is_no_old_one():
    """A path without old words has no new name."""
    assert new_name(["rollouts", "margin"]) is None


def test_the_error_names_the_new_field():
    """A setting with an old name is refused, and the message gives the new name."""
    with pytest.raises(SettingsError, match=r"rollouts\.haste: .* rollouts\.max_speed_scale"):
        resolve(SimulatedRobotConfig, overrides=["rollouts.haste=1"])
    with pytest.raises(SettingsError, match=r"rig: .* simulated_robot"):
        resolve(EvaluationConfig, overrides=["rig.plant=bullet"])
