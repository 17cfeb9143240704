"""Privileged information: what is counted, what is told, and a short drive with each."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.studies import privileged
from andabata.bench.studies.privileged import (
    KNOWLEDGE,
    PrivilegedComparison,
    _ground_layer,
    knowledge_row,
    robot_that_knows,
    tell,
    true_layer_update,
)
from andabata.bench.studies.true_movers import TrueMovers
from andabata.evaluation.comparison import run_comparison
from andabata.evaluation.offroad import EvaluationConfig
from andabata.models import Models
from tests.support.offroad_attempts import attempt, trial
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import MAX_RANGE, MIN_RANGE
from worlds.scenes import SceneCache
from worlds.traversability_map import Reason


def study(world, knowledge, trials=1, seconds=6.0):
    """Return a study of short drives with the kinematic plant."""
    config = EvaluationConfig(
        world=world,
        controllers=("planner",),
        trials=trials,
        seed=7300,
        simulated_robot=SimulatedRobotConfig(plant="kinematic"),
    )
    short = config.terminations.model_copy(update={"time_limit": seconds})
    config = config.model_copy(update={"terminations": short})
    return replace(PrivilegedComparison.of(config, Models()), knowledge=knowledge)


def test_goals_are_counted_in_a_row_and_contacts_for_a_hundred_that_were_tried():
    """Four goals tried in two drives, one of which ends by the robot's own motion."""
    attempts = [
        attempt(0, 1, "goal", "tracks", spl=0.8),
        attempt(0, 2, "collision", "tracks", contact="mover", cause="walker"),
        attempt(1, 1, "goal", "tracks", spl=0.6),
        attempt(1, 2, "timeout", "tracks"),
        *trial(0, "as-it-is", 3),
    ]

    row = knowledge_row("tracks", attempts, 3)

    assert (row["knows"], row["drives"], row["goals tried"]) == ("tracks", 2, 4)
    assert [row[f"goal {k}"] for k in (1, 2, 3)] == [2, 0, 0]
    assert (row["into mover a 100"], row["hit by mover a 100"]) == (25.0, 0.0)
    assert (row["hit at rest a 100"], row["obstacle a 100"]) == (0.0, 0.0)
    assert row["ended by"] == "walker 1, timeout 1"
    assert (row["SPL"], row["time [s]"]) == (pytest.approx(0.7), 10.0)
    none = knowledge_row("true-pose", attempts, 3)
    assert (none["drives"], none["ended by"], none["SPL"]) == (0, "none", None)


def test_knowledge_without_a_name_is_refused():
    """The message lists what there is."""
    with pytest.raises(ValueError, match=r"expected some of as-it-is, true-pose.*got true-sky"):
        study("maze", ("as-it-is", "true-sky"))


def test_a_robot_is_told_one_thing_and_is_else_what_it_was():
    """As it is it knows nothing more; all other knowledge changes its own settings alone."""
    robot = SimulatedRobotConfig(plant="kinematic")
    told = {name: robot_that_knows(name, robot).model_dump() for name in KNOWLEDGE}
    own = robot.model_dump()
    changed = {name: {key for key in own if told[name][key] != own[key]} for name in KNOWLEDGE}
    assert changed["true-pose"] == {"localizer", "errors"}
    assert changed["true-way"] == {"prior_map"}
    assert changed["tracks"] == changed["true-movers"] == {"movers"}
    assert not changed["as-it-is"] | changed["true-cells"] | changed["true-map"]


def test_true_movers_stand_in_the_place_of_the_perceived_ones():
    """Those of the settings are replaced; a robot with its own tracks keeps them."""
    scene, config = SceneCache().get("maze", 3), SimulatedRobotConfig(plant="kinematic")
    for name in ("tracks", "true-movers"):
        robot = make_robot("planner", scene, robot_that_knows(name, config))
        tell(name, robot)
        assert isinstance(robot.perception.movers, TrueMovers) == (name == "true-movers")
        robot.close()


def test_without_movers_all_that_is_known_of_them_drives_the_same():
    """Nobody is there: the rows are those of a robot that looks for nobody."""
    about_movers = study("plain", ("as-it-is", "tracks", "true-movers"))
    attempts = run_comparison(about_movers)
    ends = {each.detail.end for each in attempts}
    assert [each.contender for each in attempts] == list(about_movers.knowledge)
    assert len(ends) == 1


def test_the_truth_changes_a_drive_and_the_journal_goes_on(tmp_path):
    """Each truth steers otherwise; a second run drives nothing, others are refused."""
    truths = ("as-it-is", "true-pose", "true-cells", "true-map", "true-way")
    told = study("natural-test", truths, seconds=8.0)
    attempts = run_comparison(told, folder=tmp_path)
    assert len({each.detail.end for each in attempts}) == len(told.knowledge)

    done = (tmp_path / told.journal).read_text()
    again = run_comparison(told, folder=tmp_path)
    assert [each.detail.end for each in again] == [each.detail.end for each in attempts]
    assert (tmp_path / told.journal).read_text() == done
    with pytest.raises(ValueError, match="other"):
        run_comparison(replace(told, knowledge=("as-it-is",)), folder=tmp_path)


def test_the_command_prints_a_table_and_the_pairs(monkeypatch, capsys, tmp_path):
    """Knowledge by its name, settings by --set, and a folder in which it goes on."""
    drives = [*trial(0, "as-it-is", 2), *trial(0, "true-way", 3)]
    asked = []

    def run(comparison, **kwargs):
        asked.append((comparison, kwargs["folder"]))
        return drives

    monkeypatch.setattr(privileged, "run_comparison", run)
    out = tmp_path / "study"
    privileged.main(
        ["as-it-is", "true-way", "--trials", "1", "--set", "robot.speed=0.5", "--out", str(out)]
    )

    comparison, folder = asked[0]
    assert comparison.knowledge == ("as-it-is", "true-way")
    assert comparison.config.simulated_robot.robot.speed == 0.5
    assert comparison.config.simulated_robot.reality.name == "field"
    assert folder == out
    table, pairs = capsys.readouterr().out.split("\n\n")
    assert table.splitlines()[2].startswith("| as-it-is | 1 | 1 | 1 | 0 | 3 |")
    assert pairs.splitlines()[2].startswith("| true-way | as-it-is | 1 | 1 | 0 |")


def test_a_suite_has_its_own_worlds(monkeypatch):
    """That of development has 24, however many trials are asked for."""
    asked = []

    def run(comparison, **_):
        asked.append(comparison)
        return trial(0, "as-it-is", 3)

    monkeypatch.setattr(privileged, "run_comparison", run)
    privileged.main(["as-it-is", "--suite", "development", "--trials", "1"])
    assert len(asked[0].cells()) == 24


def test_a_controller_without_a_map_has_no_ground_layer():
    """A policy alone cannot be given true ground cells."""
    scene, config = SceneCache().get("maze", 3), SimulatedRobotConfig(plant="kinematic")
    robot = make_robot("policy", scene, config)
    with pytest.raises(TypeError, match="expected one with a planner and ground cells"):
        _ground_layer(robot)
    robot.close()


def make_robot(name, scene, config):
    models = Models()
    return SimulatedRobot(scene, config, models, make_steering(name, scene.world, config, models))


def test_the_true_map_blocks_what_it_forbids():
    """Within reach every cell is certain; it is blocked where the true map forbids its centre."""
    scene, config = SceneCache().get("maze", 3), SimulatedRobotConfig(plant="kinematic")
    robot = make_robot("policy+planner", scene, config)
    task = scene.world.tasks[0]
    robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))
    layer, odometry = _ground_layer(robot), robot.localizer.odometry
    true = robot.simulator.vehicle.state.pose
    true_layer_update(robot, layer, unseen=True)(ElevationGrid(), odometry.position[:2])
    robot.close()
    odds, certain = layer.log_odds, config.local_planner.ground.max_log_odds
    assert set(np.unique(odds)) == {-np.float32(certain), 0.0, np.float32(certain)}
    area = np.pi * (MAX_RANGE**2 - MIN_RANGE**2) / 0.2**2
    assert (odds != 0).sum() == pytest.approx(area, rel=0.01)
    # Offsets from the robot as complex numbers, which the frames' rotation multiplies.
    n = np.arange(-52, 53)
    cells = (layer.centre[0] + n)[:, None], (layer.centre[1] + n)[None, :]
    offset = sum(
        u * ((c + 0.5) * 0.2 - p)
        for u, c, p in zip((1, 1j), cells, odometry.position[:2], strict=True)
    )
    spot = offset * np.exp(1j * (true.yaw - odometry.yaw)) + complex(*true.position[:2])
    forbidden = scene.world.truth.reason_at(spot.real, spot.imag) != Reason.FREE
    found = odds[cells[0] & (len(odds) - 1), cells[1] & (len(odds) - 1)]
    known = found != 0
    assert (found[known & forbidden] > 0).all()
    assert (known & forbidden).sum() > 20
    assert (found[known] > 0).mean() < 0.5
