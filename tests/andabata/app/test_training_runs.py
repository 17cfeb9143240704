"""Training runs of several seeds: the summary, and the note of an update."""

from types import SimpleNamespace

from andabata.app import training_runs
from andabata.app.console import Console
from andabata.app.training_runs import runs_summary, train_seeds


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


def test_several_runs_have_folders_of_their_own_and_resume_if_begun(tmp_path, monkeypatch):
    """Each seed has its folder; a run that has not begun is not resumed."""
    calls = []

    def learn(folder, plan, stages, seed, workers, **options):
        calls.append((folder, seed, options["resume"]))
        return {"stage": "A", "success_rate": 0, "validation": {}, "steps": 1, "wall_s": 1.0}

    monkeypatch.setattr(training_runs, "learn", learn)
    plan = SimpleNamespace(stages={"A": SimpleNamespace(episodes=4)})
    begun = tmp_path / "seed-3" / training_runs.CHECKPOINT
    begun.parent.mkdir()
    begun.touch()
    console = Console(quiet=True)
    train_seeds(tmp_path, plan, range(1), (3, 4), 1, None, console, resume=True)
    train_seeds(tmp_path, plan, range(1), (5,), 1, None, console, resume=True)
    assert calls == [
        (tmp_path / "seed-3", 3, True),
        (tmp_path / "seed-4", 4, False),
        (tmp_path, 5, True),
    ]
