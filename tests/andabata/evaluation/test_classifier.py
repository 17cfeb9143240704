"""Scores of classifiers on labelled clouds: known answers, and the commands."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.evaluation import classifier as evaluation
from andabata.models import shipped_forest
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.dataset import DatasetError, read_manifest
from traversability.grid import PolarGrid


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clouds")
    words = ["clouds", "generate", "--out", str(folder), "--train", "2", "--validation", "1"]
    assert main([*words, "--seed", "7", "--workers", "1", "--quiet"]) == 0
    return folder


def result(capsys, *words):
    assert main([*words, "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1  # One JSON object and nothing else.
    return json.loads(out)


def test_a_forest_is_trained_and_evaluated(capsys, clouds, tmp_path):
    """Training and evaluation on the same clouds print the same confusion matrix."""
    out = tmp_path / "forest"
    words = ["--clouds", str(clouds), "--out", str(out), "--set", "trees=30"]
    # Two clouds have too few cells for the usual leaves, and for a screen before the trees.
    words += ["--set", "min_leaf=20", "--set", "screen_trees=0"]
    data = result(capsys, "classifier", "train", *words)
    names = ["accuracy", "precision", "recall", "specificity"]
    names += ["balanced_accuracy", "f1_red", "iou_red"]
    assert all(0 <= data[name] <= 1 for name in names)
    assert set(data["confusion"]) == {"tp", "tn", "fp", "fn"}
    assert sum(data["n_cells"].values()) == 320
    words = ["--clouds", str(clouds), "--forest", str(out / "forest.npz")]
    again = result(capsys, "classifier", "evaluate", *words)
    assert again["confusion"] == data["confusion"]
    assert json.loads((out / "run.json").read_text())["config"]["trees"] == 30


def test_a_classifier_of_ground_cells_is_trained_and_evaluated(capsys, clouds, tmp_path):
    """Two clouds teach something; the scores are those of all cells and by distance."""
    out = tmp_path / "ground"
    words = [
        "--clouds",
        str(clouds),
        "--out",
        str(out),
        "--set",
        "trees=30",
        "--set",
        "sample_share=1",
    ]
    data = result(capsys, "classifier", "ground", *words)
    assert data["ground_cells"] > 1000
    assert data["f1_red"] > 0.5  # Two clouds teach that much.
    assert list(data["bands"]) == ["0.7_to_1.8_m", "1.8_to_3.2_m", "3.2_to_5_m", "5_to_10_m"]
    learned = GroundClassifier.load(out / "ground_classifier.npz")
    assert learned.summary["config"]["trees"] == 30
    assert json.loads((out / "run.json").read_text())["config"]["sample_share"] == 1


@pytest.mark.parametrize("wrong", ["--set trees=0", "--set tree=3"])
def test_a_wrong_setting_writes_nothing(clouds, tmp_path, wrong):
    """A setting out of bounds or unknown is a usage error, before any file."""
    out = tmp_path / "forest"
    words = ["classifier", "train", "--clouds", str(clouds), "--out", str(out), *wrong.split()]
    assert main(words) == 2
    assert not out.exists()


class Answers:
    """A scanner whose cells are given beforehand."""

    def __init__(self, cells):
        self.grid = PolarGrid()
        self._cells = iter(cells)

    def cells(self, points):
        return next(self._cells)


def test_a_forest_is_scored_on_every_cell(monkeypatch, clouds):
    """Scores of all cells, of near ones and of each world are those of the confusion matrix."""
    manifest = read_manifest(clouds)
    entries = manifest.of("train")
    found = evaluation.read_clouds(clouds, manifest, "train")
    grid = PolarGrid()
    truth = [evaluation.label_cells(cloud.points, cloud.nontraversable, grid) for cloud in found]
    # Every blocked cell is missed in the first cloud, every free one is blocked in the second.
    known = [np.where(states == 2, 1, states).astype(np.uint8) for states in truth[:1]]
    known += [np.where(states == 1, 2, states).astype(np.uint8) for states in truth[1:]]
    monkeypatch.setattr(evaluation, "TraversabilityScanner", lambda _: Answers(known))
    scores = evaluation.score_forest(None, clouds, manifest, "train")
    count = [[int((states == k).sum()) for k in range(3)] for states in truth]
    assert scores["clouds"] == 2
    assert scores["n_cells"] == {
        "white": count[0][0] + count[1][0],
        "green": count[0][1] + count[1][1],
        "red": count[0][2] + count[1][2],
    }
    expected = {"fn": count[0][2], "tn": count[0][1], "fp": count[1][1], "tp": count[1][2]}
    assert scores["confusion"] == expected
    assert set(scores["worlds"]) == {entry.world for entry in entries}
    for entry, (_, free, blocked), first in zip(entries, count, (True, False), strict=True):
        one = scores["worlds"][entry.world]["confusion"]
        missed = {"tp": 0, "fn": blocked, "tn": free, "fp": 0}
        alarm = {"tp": blocked, "fn": 0, "tn": 0, "fp": free}
        assert one == (missed if first else alarm)
    near = np.stack(truth)[..., grid.ring_edges[:-1] < 5.0]
    assert sum(scores["within_5_m"]["confusion"].values()) == int((near > 0).sum())
    doubtless = sum(scores["beyond_doubt"]["confusion"].values())
    assert 0 < doubtless <= sum(expected.values())


def test_a_split_without_clouds_is_refused(clouds):
    """Nothing is scored on a split that has no clouds."""
    manifest = read_manifest(clouds)
    left = tuple(entry for entry in manifest.clouds if entry.split == "train")
    without = manifest.model_copy(update={"clouds": left})
    with pytest.raises(DatasetError, match="expected clouds of the validation split, got none"):
        evaluation.score_forest(shipped_forest(), clouds, without, "validation")


def test_ground_cells_are_scored_by_range():
    """A cell is blocked from even odds on; each band has the cells of its ranges."""
    far = np.array([1.0, 1.79, 1.8, 4.0, 6.0, 9.0], dtype=np.float32)
    features = np.zeros((6, len(CONTEXT_FEATURES)), dtype=np.float32)
    features[:, CONTEXT_FEATURES.index("range")] = far
    samples = SimpleNamespace(
        features=features,
        blocked=np.array([True, False, True, True, False, True]),
        low=np.array([True, False, False, True, False, True]),
    )
    odds = np.array([0.0, -0.1, -0.1, 3.0, 2.0, -1.0])
    forest = SimpleNamespace(second=SimpleNamespace(log_odds=lambda _: odds))
    scores = evaluation.score_ground_classifier(forest, samples)
    assert scores["confusion"] == {"tp": 2, "tn": 1, "fp": 1, "fn": 2}
    assert scores["ground_cells"] == 6
    assert scores["recall_low"] == pytest.approx(2 / 3)
    bands = [band["confusion"] for band in scores["bands"].values()]
    assert bands == [
        {"tp": 1, "tn": 1, "fp": 0, "fn": 0},
        {"tp": 0, "tn": 0, "fp": 0, "fn": 1},
        {"tp": 1, "tn": 0, "fp": 0, "fn": 0},
        {"tp": 0, "tn": 0, "fp": 1, "fn": 1},
    ]
    text = evaluation.ground_classifier_table(scores)
    assert "recall of blocked ones of low objects: 0.667" in text
    assert len(text.splitlines()) == 3 + 5


def test_tables_show_ours_beside_the_papers(clouds):
    """Both tables have our figures and the paper's, under the right names."""
    forest = shipped_forest()
    scores = evaluation.score_forest(forest, clouds, read_manifest(clouds), "validation")
    data = {**scores, "thresholds": forest.thresholds.model_dump()}
    text = evaluation.tables(data)
    for name in ("tp", "tn", "fp", "fn"):
        line = next(line for line in text.splitlines() if line.strip().startswith(name.upper()))
        numbers = line.split()[-2:]
        assert numbers == [
            str(data["confusion"][name]),
            str(evaluation.PAPER.as_dict()["confusion"][name]),
        ]
    assert f"{data['balanced_accuracy']:.3f}" in text
