"""Report of the classifiers of polar cells and of ground cells (Sanchez et al., Tables 1 and 2)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from andabata.report.columns import heading
from andabata.report.folder import read_result
from andabata.report.page import Fact, Report
from andabata.report.plots.perception import bands_figure, confusions_figure, importance_figure
from traversability.scores import FIGURES, PAPER

Row = dict[str, Any]

SCORES = "scores.json"
"""Scores of a classifier."""

_KEYS = ("confusion", "balanced_accuracy", "n_cells", "beyond_doubt", "within_5_m", "worlds")

_GROUND_KEYS = ("bands", "ground_cells", "balanced_accuracy", "confusion")

SCORE_COLUMNS = ("balanced_accuracy", "f1_red", "precision", "recall", "specificity")
"""Columns of scores that are not folded."""


def report_classifier(folder: Path) -> tuple[Report, Row]:
    """Return a page about a classifier of polar cells, and its figures.

    Args:
        folder: Folder of ``classifier train`` or ``classifier evaluate --out``.

    Raises:
        RunFolderError: If it holds no scores, or those of another version.
    """
    data = _scored(read_result(folder, SCORES, _KEYS))
    page = Report("A classifier of cells", f"Scored on {data['clouds']} labelled clouds.")
    paper = PAPER.as_dict()
    _facts(page, data, paper)
    page.section(
        "Scores",
        "Blocked cells are the positive class. The paper prints its accuracy as precision; here "
        "each score of the paper follows from its counts (Tables 1 and 2).",
    )
    page.table(
        [
            {
                "score": heading(name),
                "ours": data[name],
                "the paper's": paper[name],
            }
            for name in FIGURES
        ]
    )
    figure = confusions_figure({"ours": data["confusion"], "the paper's": paper["confusion"]})
    page.figure(figure, "confusion", "Cells by truth and answer (Table 1)")
    page.section(
        "Where it errs", "Cells beyond doubt keep their label if the limits move a little."
    )
    parts = {
        "all cells": data,
        "beyond doubt": data["beyond_doubt"],
        "within 5 m": data["within_5_m"],
        **data["worlds"],
    }
    rows = [{"cells": name, **part} for name, part in parts.items()]
    page.table(rows, ("cells", *SCORE_COLUMNS))
    if "ranges" in data:
        long, short = (100 * data["ranges"][name] for name in ("too_long", "too_short"))
        page.note(
            f"Sectors whose range is wrong by more than a ring: {long:.2f} % too long, "
            f"{short:.2f} % too short."
        )
    if data.get("importances"):
        page.section("Features", "What is lost when a feature is shuffled.")
        page.figure(importance_figure(data["importances"]), "importances", "Most important first")
    return page, data


def report_ground(folder: Path) -> tuple[Report, Row]:
    """Return a page about a classifier of ground cells, and its figures.

    Args:
        folder: Folder of ``classifier ground``.

    Raises:
        RunFolderError: If it holds no scores, or those of another version.
    """
    data = _scored(read_result(folder, SCORES, _GROUND_KEYS))
    page = Report(
        "A classifier of ground cells", f"Scored on {data['ground_cells']} cells of 0.2 m."
    )
    low = data.get("recall_low")
    page.facts(
        [
            Fact("balanced accuracy", f"{data['balanced_accuracy']:.3f}"),
            Fact("recall of low objects", "none there" if low is None else f"{low:.3f}"),
        ]
    )
    page.section("Scores by range")
    bands = {name.replace("_", " "): band for name, band in data["bands"].items()}
    page.table(
        [{"cells": name, **band} for name, band in ({"all": data} | bands).items()],
        ("cells", *SCORE_COLUMNS),
    )
    page.figure(bands_figure(bands), "bands", "Scores by distance from the robot", drawn=True)
    figure = confusions_figure({"ground cells": data["confusion"]})
    page.figure(figure, "confusion", "Cells by truth and answer")
    return page, data


def _scored(data: Row) -> Row:
    """Return scores with NaN for those that are null: shares of no cell at all."""
    found: Row = {}
    for name, value in data.items():
        if isinstance(value, dict):
            found[name] = _scored(value)
        else:
            found[name] = float("nan") if value is None and name in SCORE_COLUMNS else value
    return found


def _facts(page: Report, data: Mapping[str, Any], paper: Mapping[str, Any]) -> None:
    """Add the figures that are looked for first, with the paper's beside."""
    page.facts(
        [
            Fact(heading(name), f"{data[name]:.3f}", f"the paper: {paper[name]:.3f}")
            for name in ("balanced_accuracy", "f1_red", "recall", "precision")
        ]
    )
