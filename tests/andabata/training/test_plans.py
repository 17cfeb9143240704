"""Curricula as data: what is learnt in which order, and what each suite judges."""

import pytest

from andabata.app.cli import main
from andabata.evaluation.scenarios import scenarios
from andabata.training.plans import algorithms, load_plan
from worlds.catalogue import preset_names
from worlds.splits import EVALUATION_START, TRAINING_SEEDS, VALIDATION_SEEDS


def test_the_papers_scheme_is_the_papers():
    plan = load_plan("actor-critic")
    assert [stage.episodes for stage in plan.stages.values()] == [200, 200, 200]
    assert list(plan.stages) == ["Maze2D", "Maze3D", "Natural"]
    assert plan.learner.hidden == (200, 200)
    assert plan.learner.critic == "reward-input"
    for stage in plan.stages.values():
        environment = stage.environment
        assert environment.heading == "goal"
        assert environment.reward.collision == environment.reward.tipover == 0.0
        assert environment.reward.attraction == 200.0
        assert stage.promote_at is None
        assert stage.difficulty is None
    limits = [stage.environment.terminations.time_limit for stage in plan.stages.values()]
    assert limits == [180.0, 180.0, 300.0]
    scanners = [stage.environment.simulated_robot.sensing.scanner for stage in plan.stages.values()]
    assert scanners == ["horizontal", "rotating", "rotating"]


@pytest.mark.parametrize("algorithm", algorithms())
def test_nothing_is_tried_where_it_was_learnt(algorithm):
    for stage in load_plan(algorithm).stages.values():
        assert set(stage.environment.seeds) <= set(TRAINING_SEEDS)
        assert set(stage.unseen.seeds) == set(VALIDATION_SEEDS)
        elsewhere = stage.environment.model_copy(update={"seeds": VALIDATION_SEEDS})
        assert stage.unseen == elsewhere  # Driven, seen and judged as while it learns.
    assert not set(TRAINING_SEEDS) & set(VALIDATION_SEEDS)
    assert max(VALIDATION_SEEDS) < EVALUATION_START


def test_the_body_and_the_laser_are_chosen():
    plan = load_plan("sac", "os1-64", "jackal")
    rigs = [stage.environment.simulated_robot for stage in plan.stages.values()]
    assert {simulated_robot.robot.name for simulated_robot in rigs} == {"jackal"}
    assert rigs[0].sensing.scanner == "horizontal"
    assert rigs[1].sensing.lidar == rigs[2].sensing.lidar != rigs[0].sensing.lidar


def test_an_unknown_algorithm_is_named(capsys):
    assert main(["train", "--algorithm", "magic", "--quiet"]) != 0
    assert "--algorithm: expected actor-critic, sac, got 'magic'" in capsys.readouterr().err


def test_no_decision_is_made_on_what_was_seen_before(capsys):
    wanted = ["--set", "stages.Natural.environment.look_every=3", "--quiet"]
    assert main(["train", *wanted]) != 0
    assert "Natural.environment.look_every: expected a divisor" in capsys.readouterr().err


def test_the_suite_is_wide_and_unseen():
    found = scenarios("generalisation", "maze", 3, 0)
    assert len(found) == len(set(found)) == 160
    assert {scenario.world for scenario in found} <= set(preset_names())
    assert all(scenario.seed >= EVALUATION_START for scenario in found)
    natural = [scenario.difficulty for scenario in found if scenario.world == "natural-far"]
    assert natural == sorted(natural)
    assert (natural[0], natural[-1]) == (0.0, 0.8)
    assert not set(found) & set(scenarios("generalisation", "maze", 3, 1))
    with pytest.raises(ValueError, match="--suite: expected one of generalisation, got 'x'"):
        scenarios("x", "maze", 3, 0)
