"""Adaptation of a cell classifier to recorded drives."""

import json
from dataclasses import replace

import numpy as np
import pytest

from andabata.datasets.drive_labeller import DriveSamples
from andabata.training.forest_adaptation import (
    OWN,
    SYNTHETIC,
    Adaptation,
    DriveAdaptationConfig,
    RecallLostError,
    adapt_to_drives,
    adaptation_text,
    split_in_time,
)
from tests.support.cell_samples import GRID, SMALL, cells
from traversability.forest_adaptation import AdaptationConfig
from traversability.forest_training import train_forest
from traversability.scores import CellScores

CONFIG = DriveAdaptationConfig(forest=AdaptationConfig(trees=5, cells=1000), gap=10.0)


def drive(seconds=100, seed=6):
    """Return a drive with a cloud of ten labelled cells a second."""
    samples = cells(10 * seconds, seed=seed)
    cloud = np.repeat(np.arange(seconds), 10).astype(np.int32)
    return DriveSamples(replace(samples, cloud=cloud), np.arange(seconds) + 3.0, {}, seconds)


def test_a_drive_is_split_in_time_with_a_gap():
    """The first part is learned from, the gap belongs to none, and the rest is held out."""
    first, last = split_in_time(drive(), CONFIG)
    assert set(first.cloud) == set(range(60))  # 60 % of 99 s, counted from the first cloud.
    assert set(last.cloud) == set(range(70, 100))


def test_scores_before_and_after_are_of_held_out_cells():
    """Scores are those of the two forests on clouds and on the last part of all drives."""
    forest = train_forest(cells(), GRID, SMALL, seed=1)
    drives, validation = [drive(), drive(seed=7)], cells(seed=9)
    found = adapt_to_drives(forest, drives, cells(seed=2), validation, CONFIG, 0)
    data = json.loads(json.dumps(found.as_dict()))
    held = np.concatenate([split_in_time(each, CONFIG)[1].blocked for each in drives])
    assert data[OWN]["before"]["blocked_cells"] == held.sum()
    assert data[SYNTHETIC]["after"]["free_cells"] == (~validation.blocked).sum()
    assert data["learned_cells"] == 1200
    assert "held out drive" in adaptation_text(data)


@pytest.mark.parametrize("part", [SYNTHETIC, OWN])
def test_a_loss_of_recall_on_either_part_is_refused(part):
    """A loss beyond the limit is an error with the numbers; at the limit it is none."""
    good, bad = CellScores(tp=995, tn=1, fp=1, fn=5), CellScores(tp=989, tn=1, fp=1, fn=11)
    before = {SYNTHETIC: good, OWN: good}
    forest = train_forest(cells(), GRID, SMALL, seed=1)
    Adaptation(forest, before, before, 1).check(CONFIG)
    lost = Adaptation(forest, before, before | {part: bad}, 1)
    with pytest.raises(RecallLostError, match=rf"{part}: .* got 0\.0060 \(0\.9950 to 0\.9890\)"):
        lost.check(CONFIG)
    lost.check(CONFIG.model_copy(update={"recall_loss": 0.007}))


def test_no_blocked_cells_are_no_loss():
    """Without blocked cells there is no recall to lose, and none in the result."""
    none = CellScores(tp=0, tn=9, fp=1, fn=0)
    forest = train_forest(cells(), GRID, SMALL, seed=1)
    found = Adaptation(forest, {SYNTHETIC: none, OWN: none}, {SYNTHETIC: none, OWN: none}, 1)
    found.check(CONFIG)
    assert found.as_dict()[OWN]["after"]["recall"] is None
    assert found.as_dict()[OWN]["after"]["false_alarms"] == 0.1
    assert "none -> none" in adaptation_text(found.as_dict())


def test_a_drive_without_a_held_out_part_is_refused():
    """A gap as long as the drive leaves nothing to score on."""
    forest = train_forest(cells(), GRID, SMALL, seed=1)
    config = CONFIG.model_copy(update={"gap": 90.0})
    with pytest.raises(ValueError, match="in the held-out part, got none"):
        adapt_to_drives(forest, [drive()], cells(seed=2), cells(seed=9), config, 0)
