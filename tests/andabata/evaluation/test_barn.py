"""Evaluations by BARN's rules: same worlds and noise for all, journals, folders."""

import json

import numpy as np
import pytest

from andabata.evaluation import barn
from andabata.evaluation.barn import (
    FIRST_JUDGING,
    BarnComparison,
    BarnEvaluationConfig,
    drive_barn_run,
    load_world,
    world_names,
    world_notes,
)
from andabata.evaluation.comparison import run_comparison
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS
from andabata.navigation.planar.null_navigators import StraightNavigator
from tests.support.barn_folders import write_world
from tests.support.moving_barn_folders import source_text, write_moving_world
from worlds.rooms.barn import NARROW, barn_world
from worlds.rooms.crowds import SIZES
from worlds.rooms.moving_fields import moving_field
from worlds.sdf.barn import BarnFileError

BLIND = BarnEvaluationConfig(count=3, trials=2, controllers=("straight", "random"))


def drive_all(config, **settings):
    """Return the runs of an evaluation."""
    return run_comparison(BarnComparison(config), **settings)


def test_every_controller_drives_every_world_as_often():
    """By world, controller and trial; trials of a world differ in their noise."""
    runs = drive_all(BLIND)
    seen = [(run.scenario, run.contender, run.repetition) for run in runs]
    names = [f"barn-{FIRST_JUDGING + k}" for k in range(3)]
    assert seen == [(w, c, t) for w in names for c in ("straight", "random") for t in (0, 1)]
    assert len({run.detail.goal_distance for run in runs}) == len(runs)
    assert drive_all(BLIND) == runs


def test_a_controller_alone_drives_as_beside_others():
    """Worlds and noise depend on neither the list of controllers nor the number of worlds."""
    runs = [run for run in drive_all(BLIND) if run.contender == "random"]
    alone = BLIND.model_copy(update={"controllers": ("random",), "count": 2, "trials": 1})
    assert drive_all(alone) == [run for run in runs if run.repetition == 0][:2]


def test_a_killed_evaluation_goes_on(tmp_path):
    """Worlds of the journal are not driven again, and the result is the same."""
    whole, journal = drive_all(BLIND, folder=tmp_path), tmp_path / "worlds.jsonl"
    text = journal.read_text()
    lines = text.splitlines()
    assert len(lines) == 1 + 3
    journal.write_text("\n".join([*lines[:2], lines[2][:40]]))
    assert drive_all(BLIND, folder=tmp_path) == whole
    assert journal.read_text() == text
    with pytest.raises(ValueError, match="journal of this run, got one that differs in con"):
        drive_all(BLIND.model_copy(update={"seed": 1}), folder=tmp_path)


def test_worlds_of_a_folder_and_their_changes(tmp_path):
    """Names, and a journal that does not outlive its files."""
    folder = write_world(tmp_path / "worlds", 7)
    config = BLIND.model_copy(update={"worlds": str(folder), "controllers": ("straight",)})
    assert world_names(config) == ("world_7",)
    first = drive_all(config, folder=tmp_path)
    assert [run.scenario for run in first] == ["world_7", "world_7"]
    write_world(folder, 7, path=((1, 0), (29, 29)))
    with pytest.raises(ValueError, match="differs in files"):
        drive_all(config, folder=tmp_path)
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


def test_fields_with_movers_are_driven_and_told(tmp_path):
    """Three levels by name; a blind robot is hit or hits, and a folder of such worlds is read."""
    for level in ("easy", "medium", "hard"):
        config = BLIND.model_copy(update={"fields": f"moving-{level}", "first_seed": 7300})
        name = f"barn-moving-{level}-7300"
        assert world_names(config)[0] == name
        assert load_world(config, name).room.movers == moving_field(7300, level).room.movers
    for people in SIZES:
        crowd = config.model_copy(update={"fields": f"crowd-{people}"})
        assert world_names(crowd)[0] == f"crowd-{people}-7300"
        assert len(load_world(crowd, f"crowd-{people}-7300").room.movers) == people
    blind = config.model_copy(update={"controllers": ("straight",), "trials": 1})
    contacts = {run.contact for run in drive_all(blind)}
    assert contacts
    assert contacts <= {Contact.MOVER, Contact.HIT}
    folder = write_moving_world(tmp_path, 4)
    config = blind.model_copy(update={"worlds": str(folder)})
    assert world_names(config) == ("world_4",)
    (run,) = drive_all(config)
    assert run.detail.optimal_time == 10.0
    notes = world_notes(config)
    assert len(notes) == 4
    assert "world_4.world:" in notes[0]
    assert world_notes(blind) == ()
    digest = BarnComparison(config).about["files"]
    (folder / "plugins" / "obs_0.cc").write_text(source_text(length=10.01))
    assert BarnComparison(config).about["files"] != digest


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


def test_a_run_has_its_path_and_what_it_touched():
    """The robot that goes straight ahead ends at a cylinder; its distance is that of its path."""
    run = drive_barn_run(BLIND, barn_world(FIRST_JUDGING), "w", "straight", 1)
    assert (run.contender, run.scenario, run.repetition) == ("straight", "w", 1)
    assert run.contact is (Contact.NONE if run.is_success else Contact.OBSTACLE)
    assert run.path.shape == (len(run.path), 3)
    ends = np.hypot(*(run.path[-1, :2] - run.path[0, :2]))
    assert run.distance == pytest.approx(ends, rel=0.05)
