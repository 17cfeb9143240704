"""Training runs of several seeds: the summary, and the note of an update."""

from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from andabata.app.console import Console
from andabata.app.jobs import training
from andabata.app.jobs.training import runs_summary, train_seeds, with_features, with_reward
from andabata.configuration.settings import resolve
from andabata.configuration.usage import UsageError
from andabata.engine import SerialEngine
from andabata.models import Models
from andabata.own_code import OwnCodeError
from andabata.training.event_files import FOLDER, read_scalars
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import HISTORY, read_history


def test_the_rate_of_a_run_is_that_of_validation():
    """Without validation the rate is that of exploring; the worst run is named."""
    validated = {"stage": "B", "success_rate": 0.9, "validation": {"A": {}, "B": {"B": 0.25}}}
    explored = {"stage": "B", "success_rate": 0.75, "validation": {"B": {"A": 0.1}}}
    data = runs_summary([validated, explored])
    assert data == {
        "runs": [validated, explored],
        "stage": "B",
        "rates": [0.25, 0.75],
        "worst": 0.25,
    }


def test_a_reward_of_ones_own_is_that_of_every_stage_off_road(tmp_path):
    """Other constants stay; in rooms, and for what is no code of one's own, it is refused."""
    name = f"{tmp_path / 'own.py'}:near"
    plan = load_plan()
    assert with_reward(plan, None) is plan
    with pytest.raises(OwnCodeError, match="expected a Python file"):
        with_reward(plan, name)
    (tmp_path / "own.py").write_text("def near(step):\n    return {'near': -step.distance}\n")
    stages = with_reward(plan, name).stages
    assert list(stages) == list(plan.stages)
    for stage in stages.values():
        before = plan.stages[stage.name].environment.reward
        assert stage.environment.reward == before.model_copy(update={"function": name})
    with pytest.raises(UsageError, match=r"--reward: expected FILE\.py:NAME, got 'near'"):
        with_reward(plan, "near")
    with pytest.raises(UsageError, match="--reward: expected an off-road task, got spn"):
        with_reward(load_plan(task="spn"), name)


def test_several_runs_have_folders_of_their_own_and_resume_if_begun(tmp_path, monkeypatch):
    """Each seed has its folder; a run that has not begun is not resumed."""
    calls = []

    def learn(folder, plan, stages, seed, **options):
        calls.append((folder, seed, options["resume"]))
        return {"stage": "A", "success_rate": 0, "validation": {}, "steps": 1, "wall_s": 1.0}

    monkeypatch.setattr(training, "learn", learn)
    plan = SimpleNamespace(stages={"A": SimpleNamespace(episodes=4, steps=None)})
    begun = tmp_path / "seed-3" / training.CHECKPOINT
    begun.parent.mkdir()
    begun.touch()
    console = Console(quiet=True)
    train_seeds(tmp_path, plan, range(1), (3, 4), None, None, console, resume=True)
    train_seeds(tmp_path, plan, range(1), (5,), None, None, console, resume=True)
    assert calls == [
        (tmp_path / "seed-3", 3, True),
        (tmp_path / "seed-4", 4, False),
        (tmp_path, 5, True),
    ]


def test_event_files_hold_what_the_history_holds(tmp_path):
    """``tensorboard`` writes each iteration once; the live table is for terminals alone."""
    console = Console(quiet=True)
    assert not console.shows_live
    overrides = ["validation=0", "learner.hidden=[8, 8]", "learner.episodes_per_iteration=2"]
    overrides += ["stages.Maze2D.episodes=4", "stages.Maze2D.environment.seeds=[0, 1]"]
    overrides += ["stages.Maze2D.environment.terminations.time_limit=2.0"]
    plan = resolve(TrainingPlan, overrides=overrides, base=load_plan("actor-critic"))
    train_seeds(tmp_path, plan, range(1), (3,), SerialEngine(), Models(), console, tensorboard=True)
    (path,) = (tmp_path / FOLDER).iterdir()
    steps = [row["steps"] for row in read_history(tmp_path / HISTORY)]
    assert len(steps) == 2
    assert [step for step, _ in read_scalars(path)] == steps


@pytest.mark.parametrize(
    ("steps", "advances"), [((20, 40), [("steps", 60), 15, 45]), ((20, None), [("episodes", 12)])]
)
def test_progress_counts_what_limits_the_run(monkeypatch, steps, advances):
    """Steps where every stage limits them, of the whole run; else episodes."""
    shown = []

    class Bar(Console):
        @contextmanager
        def progress(self, what, total):
            shown.append((what.split(",")[0], total))
            yield lambda count, note: shown.append(count)

    def learn(folder, plan, stages, seed, *, on_iteration, **_):
        for done in (15, 60) if steps[1] else ():
            figures = {"steps": done, "played": 2, "difficulty": None, "circling": 0}
            on_iteration(SimpleNamespace(**figures, name="A", recent_success=0.5))
        return {"stage": "A", "success_rate": 0, "validation": {}, "steps": 1, "wall_s": 1.0}

    monkeypatch.setattr(training, "learn", learn)
    stages = [SimpleNamespace(episodes=6, steps=limit) for limit in steps]
    plan = SimpleNamespace(stages=dict(zip("AB", stages, strict=True)))
    train_seeds(None, plan, range(2), (3,), None, None, Bar(quiet=True))
    assert shown == advances


def test_the_number_of_features_is_that_of_an_actor_on_points():
    """K goes to the actor; a plan whose actor reads no points refuses it."""
    plan = load_plan(task="spn")
    assert with_features(plan, 5).learner.actor.features == 5
    changed = with_features(plan, 5).model_dump()
    changed["learner"]["actor"]["features"] = plan.learner.actor.features
    assert changed == plan.model_dump()
    assert with_features(plan, None) is plan
    for algorithm in ("sac", "actor-critic"):
        with pytest.raises(UsageError, match="--k: expected a plan whose actor reads points"):
            with_features(load_plan(algorithm), 5)
