"""Evaluations by BARN's rules: same worlds and noise for all, journals, folders."""

import json

import numpy as np
import pytest

from andabata.evaluation import barn
from andabata.evaluation.barn import (
    FIRST_JUDGING,
    BarnEvaluationConfig,
    drive_barn_run,
    evaluate_barn,
    load_world,
    world_names,
)
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS
from andabata.navigation.planar.null_navigators import StraightNavigator
from tests.support.barn_folders import write_world
from worlds.rooms.barn import NARROW, barn_world
from worlds.sdf.barn import BarnFileError

BLIND = BarnEvaluationConfig(count=3, trials=2, controllers=("straight", "random"))


def test_every_controller_drives_every_world_as_often():
    """By world, controller and trial; trials of a world differ in their noise."""
    runs = evaluate_barn(BLIND)
    seen = [(run.world, run.controller, run.trial) for run in runs]
    names = [f"barn-{FIRST_JUDGING + k}" for k in range(3)]
    assert seen == [(w, c, t) for w in names for c in ("straight", "random") for t in (0, 1)]
    assert len({run.left for run in runs}) == len(runs)
    assert evaluate_barn(BLIND) == runs


def test_a_controller_alone_drives_as_beside_others():
    """Worlds and noise depend on neither the list of controllers nor the number of worlds."""
    runs = [run for run in evaluate_barn(BLIND) if run.controller == "random"]
    alone = BLIND.model_copy(update={"controllers": ("random",), "count": 2, "trials": 1})
    assert evaluate_barn(alone) == [run for run in runs if run.trial == 0][:2]


def test_a_killed_evaluation_goes_on(tmp_path):
    """Worlds of the journal are not driven again, and the result is the same."""
    whole, journal = evaluate_barn(BLIND, journal=tmp_path / "a"), tmp_path / "b"
    lines = (tmp_path / "a").read_text().splitlines()
    assert len(lines) == 1 + 3
    journal.write_text("\n".join([*lines[:2], lines[2][:40]]))
    seen = []
    again = evaluate_barn(BLIND, journal=journal, on_world=lambda *each: seen.append(each))
    assert again == whole
    assert [runs is None for _, runs in seen] == [True, False, False]
    assert journal.read_text() == (tmp_path / "a").read_text()
    with pytest.raises(ValueError, match="journal of this run, got one that differs in con"):
        evaluate_barn(BLIND.model_copy(update={"seed": 1}), journal=journal)


def test_worlds_of_a_folder_and_their_changes(tmp_path):
    """Names, and a journal that does not outlive its files."""
    folder = write_world(tmp_path / "worlds", 7)
    config = BLIND.model_copy(update={"worlds": str(folder), "controllers": ("straight",)})
    assert world_names(config) == ("world_7",)
    first = evaluate_barn(config, journal=tmp_path / "journal")
    assert [run.world for run in first] == ["world_7", "world_7"]
    write_world(folder, 7, path=((1, 0), (29, 29)))
    with pytest.raises(ValueError, match="differs in files"):
        evaluate_barn(config, journal=tmp_path / "journal")
    with pytest.raises(BarnFileError, match="expected a folder"):
        world_names(config.model_copy(update={"worlds": str(tmp_path / "none")}))


def test_official_worlds_are_every_sixth_of_all(tmp_path, monkeypatch):
    """Of a full set; of fewer all are driven."""
    folder = tmp_path
    for number in range(12):
        write_world(folder, number, places=())
    config = BarnEvaluationConfig(worlds=str(folder), official=True)
    assert len(world_names(config)) == 12
    monkeypatch.setattr(barn, "ALL_WORLDS", 12)
    assert world_names(config) == ("world_0", "world_6")


def test_generated_worlds_are_those_of_their_seeds():
    """Published and narrow rules by name."""
    for fields, rules in (("published", barn.PUBLISHED), ("narrow", NARROW)):
        config = BarnEvaluationConfig(fields=fields, count=1, first_seed=4)
        (name,) = world_names(config)
        found = load_world(config, name).room.circles
        np.testing.assert_array_equal(found, barn_world(4, rules).room.circles)


@pytest.mark.parametrize("is_told", [True, False])
def test_controllers_are_told_the_outline_and_the_dynamics_if_asked(monkeypatch, is_told):
    """The outline always; delay, lag and acceleration are those of barn unless told."""
    given = []

    def make(vehicle, rng):
        given.append(vehicle)
        return StraightNavigator()

    monkeypatch.setitem(PLANAR_NAVIGATORS, "straight", make)
    slow = PLANAR_VEHICLES["barn-slow"].model_copy(
        update={"footprint": PLANAR_VEHICLES["barn-hull"].footprint}
    )
    update = {"vehicle": slow} | ({"believed": None} if is_told else {})
    config = BLIND.model_copy(update=update)
    drive_barn_run(config, barn_world(0), "w", "straight", 0)
    assert given[0].footprint == slow.footprint
    assert given[0].delay == (0.15 if is_told else 0.05)


def test_settings_go_through_json():
    """What a journal keeps is what was given."""
    config = BarnEvaluationConfig(vehicle=PLANAR_VEHICLES["barn-drawn"])
    again = BarnEvaluationConfig.model_validate(json.loads(config.model_dump_json()))
    assert again == config
