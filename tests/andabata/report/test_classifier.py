"""Reports of classifiers whose scores are not all known."""

from andabata.report.classifier import report_ground
from andabata.runs.folder import write_json

NAN = float("nan")


def test_a_share_of_no_cell_is_shown_as_unknown(tmp_path):
    """It is null in the file; the page is made all the same."""
    scores = {"balanced_accuracy": 0.9, "f1_red": 0.8, "precision": NAN, "recall": 0.7}
    scores["specificity"] = 0.9
    counts = {"tp": 0, "tn": 5, "fp": 0, "fn": 1}
    data = {**scores, "ground_cells": 6, "confusion": counts, "recall_low": None}
    write_json(tmp_path / "scores.json", data | {"bands": {"near": scores, "far": scores}})
    page, found = report_ground(tmp_path)
    assert found["precision"] != found["precision"]
    assert found["bands"]["far"]["precision"] != found["bands"]["far"]["precision"]
    assert found["recall_low"] is None
    assert "none there" in page.to_bytes().decode()
