"""Folders of training runs: whose runs stand together, and what they are called."""

import json

import pytest

from andabata.report.training_folder import TrainingRun, common_stages, plans_text, runs_by_plan
from andabata.tasks.offroad import OffroadConfig
from andabata.tasks.rooms.spn_config import SpnConfig
from tests.support.report_folders import written_spn_training


@pytest.fixture
def run(tmp_path):
    """Return a run of SPN's task."""
    return TrainingRun.read(written_spn_training(tmp_path / "spn"))


def other(run, seed, **changes):
    """Return a run of the same plan, or of one with changes, with another seed."""
    plan = run.plan.model_copy(update=changes)
    folder = run.folder.parent / f"{seed}{'-changed' if changes else ''}"
    return TrainingRun(folder, seed, plan, run.models, run.history)


def test_a_run_has_the_environment_of_its_last_stage(run):
    """One of another task is refused with the name of its own."""
    assert run.environment(SpnConfig).rooms == ("spn-env0",)
    with pytest.raises(ValueError, match="expected a run in rooms as the first, got spn"):
        run.environment(OffroadConfig)


def test_runs_of_one_plan_stand_together(run):
    """Plans of one name are told by their folders; a seed stands in a plan once."""
    runs = [run, other(run, 1), other(run, 0, test_every=9000)]
    groups = runs_by_plan(runs, lambda run: f"plan of {run.plan.test_every}")
    assert [[one.seed for one in some] for some in groups.values()] == [[0, 1], [0]]
    assert list(groups)[1] == "plan of 9000"
    same = runs_by_plan(runs, lambda _: "plan")
    assert list(same) == [f"plan, {runs[0].folder}", f"plan, {runs[2].folder}"]
    with pytest.raises(ValueError, match=r"runs of plan: expected another seed in each, got \[0"):
        runs_by_plan([run, run], lambda _: "plan")


def test_runs_and_plans_are_counted_in_words(run):
    """One is singular."""
    assert plans_text({"a": (run,)}, "actor") == "One run, one actor."
    assert plans_text({"a": (run, run), "b": (run,)}, "plan") == "Three runs, two plans."


def test_stages_that_are_over_in_every_run_are_common(run):
    """Without one the runs are named with theirs."""
    assert [stage.name for stage in common_stages([run, other(run, 1)])] == ["Rooms"]
    changed = json.loads(json.dumps(run.history))
    changed[-1]["is_last"] = False
    none = TrainingRun(run.folder, 1, run.plan, run.models, changed)
    with pytest.raises(ValueError, match="expected a stage that is over in all of them"):
        common_stages([run, none])
