"""Report of the classifiers of polar cells and of ground cells (Sanchez et al., Tables 1 and 2)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from andabata.report.blocks import Fact, Plot, Table, Text
from andabata.report.columns import heading
from andabata.report.folder import read_result
from andabata.report.page import Page, Section
from andabata.report.plots.perception import bands_figure, confusions_figure, importance_figure
from traversability.scores import FIGURES, PAPER

Row = dict[str, Any]

SCORES = "scores.json"
"""Scores of a classifier."""

_KEYS = ("confusion", "balanced_accuracy", "n_cells", "beyond_doubt", "within_5_m", "worlds")

_GROUND_KEYS = ("bands", "ground_cells", "balanced_accuracy", "confusion")

SCORE_COLUMNS = ("balanced_accuracy", "f1_red", "precision", "recall", "specificity")
"""Columns of scores that are not folded."""

_SCORES_TEXT = (
    "Blocked cells are the positive class. The paper prints its accuracy as precision; here "
    "each score of the paper follows from its counts (Tables 1 and 2)."
)


def report_classifier(folder: Path) -> tuple[Page, Row]:
    """Return a page about a classifier of polar cells, and its figures.

    Args:
        folder: Folder of ``classifier train`` or ``classifier evaluate --out``.

    Raises:
        RunFolderError: If it holds no scores, or those of another version.
    """
    data, paper = _scored(read_result(folder, SCORES, _KEYS)), PAPER.as_dict()
    figure = confusions_figure({"ours": data["confusion"], "the paper's": paper["confusion"]})
    rows = [{"score": heading(n), "ours": data[n], "the paper's": paper[n]} for n in FIGURES]
    confusion = Plot(figure, "confusion", "Cells by truth and answer (Table 1)")
    sections = [
        Section("Scores", _SCORES_TEXT, Table(rows), confusion),
        _errors(data),
        _features(data["importances"]) if data.get("importances") else None,
    ]
    page = Page(
        "A classifier of cells",
        f"Scored on {data['clouds']} labelled clouds.",
        [
            Fact(heading(name), f"{data[name]:.3f}", f"the paper: {paper[name]:.3f}")
            for name in ("balanced_accuracy", "f1_red", "recall", "precision")
        ],
        sections,
    )
    return page, data


def report_ground(folder: Path) -> tuple[Page, Row]:
    """Return a page about a classifier of ground cells, and its figures.

    Args:
        folder: Folder of ``classifier ground``.

    Raises:
        RunFolderError: If it holds no scores, or those of another version.
    """
    data = _scored(read_result(folder, SCORES, _GROUND_KEYS))
    low = data.get("recall_low")
    bands = {name.replace("_", " "): band for name, band in data["bands"].items()}
    figure = confusions_figure({"ground cells": data["confusion"]})
    section = Section(
        "Scores by range",
        "",
        _scores_of({"all": data} | bands),
        Plot(bands_figure(bands), "bands", "Scores by distance from the robot", drawn=True),
        Plot(figure, "confusion", "Cells by truth and answer"),
    )
    facts = [
        Fact("balanced accuracy", f"{data['balanced_accuracy']:.3f}"),
        Fact("recall of low objects", "none there" if low is None else f"{low:.3f}"),
    ]
    lead = f"Scored on {data['ground_cells']} cells of 0.2 m."
    return Page("A classifier of ground cells", lead, facts, [section]), data


def _errors(data: Row) -> Section:
    """Return the scores of parts of the cells, and how often ranges are wrong."""
    parts = {"all cells": data, "beyond doubt": data["beyond_doubt"]}
    table = _scores_of(parts | {"within 5 m": data["within_5_m"], **data["worlds"]})
    text = "Cells beyond doubt keep their label if the limits move a little."
    if "ranges" not in data:
        return Section("Where it errs", text, table)
    long, short = (100 * data["ranges"][name] for name in ("too_long", "too_short"))
    wrong = f"{long:.2f} % too long, {short:.2f} % too short"
    ranges = Text(f"Sectors whose range is wrong by more than a ring: {wrong}.")
    return Section("Where it errs", text, table, ranges)


def _scores_of(parts: Mapping[str, Row]) -> Table:
    """Return the table of the scores of several parts of the cells."""
    rows = [{"cells": name, **part} for name, part in parts.items()]
    return Table(rows, ("cells", *SCORE_COLUMNS))


def _features(importances: Mapping[str, Any]) -> Section:
    """Return what each feature is worth."""
    plot = Plot(importance_figure(importances), "importances", "Most important first")
    return Section("Features", "What is lost when a feature is shuffled.", plot)


def _scored(data: Row) -> Row:
    """Return scores with NaN for those that are null: shares of no cell at all."""
    found: Row = {}
    for name, value in data.items():
        if isinstance(value, dict):
            found[name] = _scored(value)
        else:
            found[name] = float("nan") if value is None and name in SCORE_COLUMNS else value
    return found
