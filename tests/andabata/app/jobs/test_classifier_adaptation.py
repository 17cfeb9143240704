"""``classifier adapt``: a forest file, or an error and no file."""

import json

import pytest

from andabata.app.cli import main
from tests.support import computed_bags
from traversability.forest import Forest


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a recording, clouds and settings that fit their size."""
    folder = tmp_path_factory.mktemp("adapt")
    computed_bags.write(folder / "drive.bag", computed_bags.drive(12.0))
    words = ["clouds", "generate", "--out", str(folder / "clouds"), "--train", "2"]
    assert main([*words, "--validation", "1", "--seed", "7", "--workers", "1", "--quiet"]) == 0
    return folder


def adapt(capsys, folder, recall_loss):
    """Adapt with a limit of the loss of recall; return exit code, result and errors."""
    settings = folder / "settings.toml"
    settings.write_text(f"gap = 1.0\nrecall_loss = {recall_loss}\n[forest]\ntrees = 4\n")
    words = ["classifier", "adapt", str(folder / "drive.bag"), "--clouds", str(folder / "clouds")]
    words += ["--out", str(folder / "mine.npz"), "--adaptation", str(settings), "--json"]
    capsys.readouterr()
    code = main(words)
    out, err = capsys.readouterr()
    return code, json.loads(out), err


def test_a_recording_corrects_the_shipped_forest(capsys, folder):
    """The file is a forest that names the recording; the result has both parts before and after."""
    code, data, err = adapt(capsys, folder, 1.0)
    assert code == 0
    forest = Forest.load(folder / "mine.npz")
    assert forest.summary["adaptation"]["recordings"] == ["drive.bag"]
    assert data["drive_cells"]["free"] > 50
    assert data["troubles"] == {"stopped": 0, "slipped": 0, "tilted": 0}
    assert data["held_out_drive"]["before"]["recall"] is None
    assert 0.5 < data["validation_clouds"]["after"]["recall"] <= 1
    assert "its recall is unknown" in err


def test_a_loss_of_recall_writes_no_file(capsys, folder, monkeypatch):
    """The result is printed, the error says what was lost, the exit code is 1, no file is there."""
    (folder / "mine.npz").unlink(missing_ok=True)
    monkeypatch.setattr(
        "traversability.forest_adaptation._same_recall",
        lambda forest, *_: forest.thresholds.model_copy(update={"near": 0.999, "far": 0.999}),
    )
    code, data, err = adapt(capsys, folder, 0.005)
    assert code == 1
    assert "expected a loss of recall of at most 0.005" in err
    assert data["validation_clouds"]["after"]["recall"] < 0.9
    assert not (folder / "mine.npz").exists()
