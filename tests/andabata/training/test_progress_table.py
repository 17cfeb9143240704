"""Live table of a training run: figures by hand, remaining time, warnings with their cause."""

import io

import pytest
from rich.console import Console

from andabata.training.progress_table import EPISODES, StageProgress, TrainingView, warnings_of
from rl.curriculum import TrainingIteration
from rl.curriculum_config import Stage


def update(**changes):
    """Return an iteration of 25 episodes of 100 steps."""
    base = {
        "stage": 0,
        "name": "A",
        "played": 25,
        "episodes": 25,
        "budget": 100,
        "is_last": False,
        "steps": 2500,
        "success_rate": 0.4,
        "recent_success": 0.4,
        "difficulty": None,
        "outcomes": {"goal": 10, "collision": 15},
        "mean_steps": 100.0,
        "mean_return": -50.0,
        "terms": {"attraction": 50.0, "repulsion": -100.0},
        "circling": 0.0,
        "losses": {},
        "validation": {},
    }
    return TrainingIteration(**base | changes)


def progress(*updates):
    """Return the progress of a stage after iterations."""
    found = StageProgress()
    for one in updates:
        found.add(one)
    return found


def test_success_is_that_of_the_last_fifty_episodes():
    """Iterations that the last fifty do not reach count no more."""
    found = progress(update(success_rate=0.0), update(success_rate=0.4), update(success_rate=0.8))
    assert found.episodes == EPISODES
    assert found.success == pytest.approx(0.6)
    assert found.rewards == pytest.approx({"whole": -0.5, "attraction": 0.5, "repulsion": -1.0})


def text_of(view):
    """Return what a terminal of 100 columns shows."""
    console = Console(file=io.StringIO(), width=100)
    console.print(view)
    return console.file.getvalue()


def test_the_table_has_speed_and_remaining_time():
    """Ten seconds for a quarter of the budget leave twenty for the other two."""
    times = iter((100.0, 110.0))
    stages = {name: Stage(name=name, episodes=50) for name in ("A", "B")}
    view = TrainingView(stages, "seed 3", lambda: next(times))
    assert "starting" in text_of(view)
    view(update())
    view(update(episodes=50, steps=7500, validation={"A": 0.75}))
    text = text_of(view)
    assert "seed 3" in text
    assert "50/50" in text
    assert "0.75" in text
    assert "attraction +0.50, repulsion -1.00" in text
    assert "7,500 steps (50% of the budget), 500 steps a second, ETA 0:00:20" in text


def test_a_stage_that_ends_early_counts_as_a_whole():
    """Steps are the budget where every stage has some."""
    times = iter((0.0, 10.0))
    stages = {name: Stage(name=name, episodes=50, steps=1000) for name in ("A", "B")}
    view = TrainingView(stages, "", lambda: next(times))
    view(update(stage_steps=500))
    view(update(is_last=True, stage_steps=700))
    assert "50% of the budget" in text_of(view)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, []),
        ({"circling": 0.3}, ["30% of the last episodes circle: repulsion costs 1.00 a step"]),
        (
            {"circling": 0.3, "terms": {"progress": 10.0, "step": -1.0}},
            ["30% of the last episodes circle: a time-out costs next to nothing"],
        ),
        (
            {"outcomes": {"timeout": 20, "goal": 5}},
            ["80% of the last episodes stand or run out of time: repulsion costs"],
        ),
    ],
)
def test_warnings_name_their_cause(changes, words):
    """Circling comes first; the cause is a term that outweighs the others, or no cost at all."""
    found = warnings_of(progress(update(**changes), update(**changes)))
    assert len(found) == len(words)
    for text, begin in zip(found, words, strict=True):
        assert text.startswith(begin)


def test_few_episodes_make_no_warning():
    """Before fifty episodes nothing is said."""
    assert warnings_of(progress(update(circling=1.0))) == []
