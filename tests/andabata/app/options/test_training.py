"""Options of training: the plan that they make, and the stages that they choose."""

import pytest

from andabata.app.options.shared import RobotOptions, SettingsOptions
from andabata.app.options.training import TrainingOptions
from andabata.configuration.usage import UsageError


def plan(task="offroad", settings=(), **options):
    """Return the plan of a task with some options."""
    return TrainingOptions(**options).plan(task, RobotOptions(), SettingsOptions(None, settings))


def test_the_algorithm_and_the_settings_make_the_plan():
    """Settings come on top of the named plan, and ``--k`` on top of its actor."""
    assert plan().learner.algorithm == "sac"
    assert plan(algorithm="actor-critic").learner.algorithm == "actor-critic"
    assert plan(settings=["learner.tau=0.25"]).learner.tau == 0.25
    assert plan("spn", k=7).learner.actor.features == 7
    with pytest.raises(UsageError, match="--k: expected a plan whose actor reads points"):
        plan(k=7)


def test_the_reality_is_that_of_all_stages_with_senses():
    """Stage 1 drives by the true pose with errors of its own, and stays ideal."""
    found = TrainingOptions().plan("offroad", RobotOptions(reality="field"), SettingsOptions())
    levels = [stage.environment.simulated_robot.reality for stage in found.stages.values()]
    assert [reality.name for reality in levels] == ["ideal", "field", "field"]
    with pytest.raises(UsageError, match=r"^--reality: expected one of ideal, field, harsh"):
        TrainingOptions().plan("offroad", RobotOptions(reality="mud"), SettingsOptions())


@pytest.mark.parametrize(
    ("text", "chosen"), [(None, range(3)), ("1", range(1)), ("2-3", range(1, 3))]
)
def test_stages_are_counted_from_one(text, chosen):
    """All by default."""
    assert TrainingOptions(stages=text).chosen(plan()) == chosen


def test_stages_that_the_plan_has_not_are_refused():
    """With the option that named them."""
    with pytest.raises(UsageError, match="--stages"):
        TrainingOptions(stages="9").chosen(plan())
