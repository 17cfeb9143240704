"""A student's first hour: a drive, a training, another reward, and what it changes."""

import json

import pytest

from tests.support.walks import Walk

BRIEF = (
    "--workers 1 --set learner.hidden=[16,16] --set learner.episodes_per_iteration=4 "
    "--set validation=2 --set stages.Maze2D.episodes=8 "
    "--set stages.Maze2D.environment.seeds=[0,1] "
    "--set stages.Maze2D.environment.terminations.time_limit=6"
)
TRAIN = "docs/guides/train.md"


@pytest.fixture
def walk(tmp_path, capsys):
    """Return a walk in an empty folder."""
    return Walk(tmp_path, capsys)


def test_the_first_drive_leaves_a_clip_and_figures(walk):
    """README's first command: the clip, the picture, the figures, and where they are."""
    said = walk.type(walk.read("README.md", "drive"), "--time-limit 1 --set plant=kinematic")
    assert "goal 1: timeout after 1.0 s" in said
    assert "clip: hill.gif" in said
    assert "picture: data/runs/drive/drive.png" in said
    drive = json.loads((walk.folder / "data/runs/drive/drive.json").read_text())
    (goal,) = drive["attempts"]
    assert 0.0 <= goal["distance_m"] < 1.0
    clip = (walk.folder / "hill.gif").read_bytes()
    assert clip[:6] == b"GIF89a"


def test_a_goal_is_found_on_the_map_and_refused_where_none_can_be(walk):
    """The first drive's page: kinds of world, the map of this one, and the nearest place."""
    assert "hill" in walk.type(walk.read("docs/first-drive.md", "world list"))
    walk.type(walk.read("docs/first-drive.md", "world render"))
    assert (walk.folder / "hill.png").stat().st_size > 20_000
    line = walk.read("docs/first-drive.md", "drive")
    said = walk.type(line.replace("20,-9", "59.9,0"), code=2)
    assert "got the border of the world at 59.9,0; the nearest that would do is 58" in said


def test_another_reward_trains_and_its_effect_is_seen_on_one_page(walk):
    """The guide of training: stage 1 as shipped and with the example's reward, and both beside."""
    done = walk.type(walk.read(TRAIN, "train --stages 1 --out"), BRIEF)
    assert "policy: data/runs/maze/policy.safetensors" in done
    walk.type(walk.read(TRAIN, "train --stages 1 --reward"), BRIEF)
    for name, terms in (("maze", 4), ("smooth", 4)):
        rows = (walk.folder / f"data/runs/{name}/history.jsonl").read_text().splitlines()
        last = json.loads(rows[-1])
        assert last["episodes"] == 8
        assert len(last["terms"]) == terms
    data = walk.ask(walk.read(TRAIN, "report data/runs/maze"), "--tests 1 --workers 1")
    assert [row["run"] for row in data["tests"]] == ["maze, seed 0", "smooth, seed 0"]
    assert all(0.0 <= row["spl"] <= 1.0 for row in data["tests"])
    page = (walk.folder / "rewards.html").read_text()
    for word in ("maze, seed 0", "smooth, seed 0", "turning", "repulsion"):
        assert word in page, word


def test_what_a_student_types_wrong_is_answered_with_what_would_do(walk):
    """A reward that the file lacks, a setting in another place, a policy that is not there."""
    line = walk.read(TRAIN, "train --stages 1 --reward")
    said = walk.type(line.replace(":smooth", ":smoth"), BRIEF, code=1)
    assert "which has" in said
    assert "smooth" in said
    said = walk.type(line, f"{BRIEF} --set reward.collision=-1", code=2)
    assert "reward: expected a known field, got this one; known there: learner" in said
    assert ", stages" in said
    said = walk.type(f"{line.split()[0]} drive --policy data/runs/none.safetensors", code=1)
    assert "data/runs/none.safetensors: No such file" in said
