"""A command that drives says once that bullet is missing, or refuses it."""

import pytest

from andabata.app.cli import main
from andabata.app.console import Console
from andabata.app.driven_plant import announce_plant
from andabata.machine import plants


@pytest.fixture
def no_bullet(monkeypatch):
    monkeypatch.setattr(plants, "find_spec", lambda name: None)


def test_the_remark_is_one_line_beside_the_result(no_bullet, capsys):
    """It stands on stderr, and nowhere if the command is quiet."""
    announce_plant("wheels", Console(as_json=True))
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("note: plant wheels, since pybullet is not installed")
    assert err.count("\n") == 1
    announce_plant("wheels", Console(quiet=True))
    announce_plant("kinematic", Console())
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    "words",
    [
        ["drive", "--set", "plant=bullet", "--out", "drive"],
        ["evaluate", "--trials", "1", "--set", "simulated_robot.plant=bullet", "--out", "table"],
        ["bench", "vehicle", "--plant", "bullet"],
        ["bench", "chain", "--plants", "wheels,bullet"],
        ["bench", "localization", "--set", "plant=bullet"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_bullet_is_refused_in_one_line_before_any_work(
    no_bullet, capsys, tmp_path, monkeypatch, words
):
    """A wrong command line: exit code 2, and no folder is made."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: plant: expected wheels or kinematic, since pybullet is not")
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_drive_without_bullet_says_so_once(no_bullet, capsys, tmp_path):
    """And its folder has the plant that drove."""
    words = ["drive", "--controller", "straight", "--time-limit", "1", "--world", "maze"]
    assert main([*words, "--out", str(tmp_path / "drive")]) == 0
    assert capsys.readouterr().err.count("note: plant wheels") == 1
    assert '"plant": "wheels"' in (tmp_path / "drive" / "run.json").read_text()


def test_a_release_is_judged_in_bullet_alone(no_bullet, capsys, tmp_path, monkeypatch):
    """Judging seeds are not spent on another plant."""
    monkeypatch.setattr("andabata.app.jobs.evaluation.run_evaluation", pytest.fail)
    words = ["evaluate", "--release", "9.9.9", "--out", str(tmp_path / "table")]
    assert main(words) == 2
    assert "--release: expected pybullet" in capsys.readouterr().err
