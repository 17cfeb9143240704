"""Report of evaluations off-road and of suites, with Table 4 and Figure 24 of Sanchez et al."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from andabata.report.columns import counted, interval, several, word
from andabata.report.folder import check_keys, read_result, read_rows
from andabata.report.page import Fact, Report
from andabata.report.plots.evaluation import difficulty_figure, goals_figure, paths_figure
from andabata.report.run_folders import EVALUATION

Row = dict[str, Any]

TRIALS, FAILURES = "trials.jsonl", "failures"
"""Journal of an evaluation, and folder of the pictures of its failures."""

PAPER_WORLD = "natural-test"
"""World that is in the spirit of the paper's test world."""

PAPER_GOALS = {"Actor NN": (0.98, 0.90, 0.70), "reactive": (0.80, 0.733, 0.533)}
"""Success of the paper at goals 1, 2 and 3 in a row, in 50 trials of one world (Table 4)."""

_KEYS = ("rows", "failures", "config")

_ROW_KEYS = ("controller", "world", "goal", "trials", "successes", "wilson_low", "timeouts", "spl")

_SHOWN = (
    "controller",
    "goal",
    "reached",
    "success_rate",
    "spl",
    "collisions",
    "tipovers",
    "timeouts",
    "stuck",
    "trespass_share",
)

_FAILED = ("world", "world_seed", "controller", "goal", "outcome", "cause", "time_s", "distance_m")

_FEW = 12
"""Number of causes of failures that are not folded, the most frequent ones."""

_CAUSES = ("world", "controller", "outcome", "cause", "count")

MOST_BYTES = 7_000_000
"""Largest number of bytes of all pictures of failures on a page."""

_WIDTH, _QUALITY = 900, 62
"""Width of a picture of a failure [pixels], and its quality as WebP."""


def report_evaluation(folder: Path) -> tuple[Report, Row]:
    """Return a page about an evaluation off-road, and its figures.

    Args:
        folder: Folder of the evaluation.

    Raises:
        RunFolderError: If it is not finished, or of another version.
    """
    data = read_result(folder, EVALUATION, _KEYS)
    rows: list[Row] = data["rows"]
    for row in rows:
        check_keys(row, _ROW_KEYS, folder / EVALUATION, folder)
    attempts = read_attempts(folder / TRIALS) if (folder / TRIALS).is_file() else []
    suite, controllers = data["config"].get("suite"), _names(rows, "controller")
    worlds = _names(rows, "world")
    page = Report(
        f"Suite {suite}" if suite else f"{several(len(controllers), 'controller')} side by side",
        f"{', '.join(controllers)}; the same worlds, starts and noise for each.",
    )
    page.facts([_fact(row) for row in rows if row["goal"] == "all"])
    _success(page, rows, worlds)
    _by_difficulty(page, attempts, controllers)
    _paths(page, attempts, worlds)
    _failures(page, folder, data["failures"], attempts)
    return page, {key: data[key] for key in ("rows", "failures")}


def read_attempts(path: Path) -> list[Row]:
    """Return the attempts of an evaluation's journal, which begins with its description.

    Raises:
        RunFolderError: If it is damaged.
    """
    return [row for entry in read_rows(path)[1:] for row in entry["rows"]]


def _success(page: Report, rows: Sequence[Row], worlds: Sequence[str]) -> None:
    """Add success by goal, a table a world."""
    page.section(
        "Success",
        "A goal counts as tried in every trial, so that the figures are those of goals in a row. "
        "Brackets hold 95 % intervals (Wilson); SPL is success weighted by path length.",
    )
    there = PAPER_WORLD in worlds
    paper = {PAPER_WORLD: PAPER_GOALS} if there else {}
    beside = "; hollow: the paper's Table 4, of one world" if there else ""
    page.figure(goals_figure(rows, paper), "success", f"Goals reached in a row{beside}", drawn=True)
    for world in worlds:
        mine = [row for row in rows if row["world"] == world]
        add_goals_table(page, mine, f"All columns of {world}", world)
    if there:
        page.note("The paper's Table 4, in its own test world, beside those of natural-test:")
        page.table(_paper_rows())


def add_goals_table(page: Report, rows: Sequence[Row], every: str, caption: str = "") -> None:
    """Add the table of one world: goals reached in a row, ends and measures.

    Args:
        page: Page to add to.
        rows: Rows of ``andabata.evaluation.offroad_table.summarise``.
        every: Title under which all columns are folded.
        caption: Text above the table.
    """
    several_goals = len({row["goal"] for row in rows}) > 2  # Two are the only goal and "all".
    page.table(
        [row | {"reached": counted(row)} for row in rows if several_goals or row["goal"] != "all"],
        _SHOWN,
        caption=caption,
        every=every,
    )


def _paper_rows() -> list[Row]:
    """Return the rows of the paper's Table 4."""
    return [
        {"paper's controller": name} | {f"goal {k}": f"{r:.1%}" for k, r in enumerate(rates, 1)}
        for name, rates in PAPER_GOALS.items()
    ]


def _by_difficulty(page: Report, attempts: Sequence[Row], controllers: Sequence[str]) -> None:
    """Add success over difficulty where worlds of several difficulties were driven."""
    trials = [
        {
            "controller": row["controller"],
            "difficulty": row["difficulty"],
            "success": row["outcome"] == "goal" and row["goal"] == row["goals"],
        }
        for row in _last_attempts(attempts)
        if row.get("difficulty") is not None
    ]
    if len({row["difficulty"] for row in trials}) < 2:
        return
    page.section("Difficulty", "Whole trials in worlds of rising difficulty, in five ranges.")
    figure = difficulty_figure(trials, controllers)
    page.figure(figure, "difficulty", "All goals reached, with 95 % intervals", drawn=True)


def _last_attempts(attempts: Sequence[Row]) -> list[Row]:
    """Return the last attempt of each trial."""
    return list({(row["trial"], row["controller"]): row for row in attempts}.values())


def _paths(page: Report, attempts: Sequence[Row], worlds: Sequence[str]) -> None:
    """Add the paths of all trials, a figure a world (Fig. 24)."""
    drawn = [row for row in attempts if row.get("path") and row.get("goal_xy")]
    if not drawn:
        return
    page.section(
        "Paths",
        "Each trial has a world of its own: paths begin at the origin, the first goal lies ahead. "
        "The paper's Fig. 24 shows those of one world.",
    )
    for world in worlds:
        by_controller: dict[str, list[Row]] = {}
        for row in drawn:
            if row["world"] == world:
                by_controller.setdefault(row["controller"], []).append(row)
        trials = {name: _joined(rows) for name, rows in by_controller.items()}
        if trials:
            figure = paths_figure(trials, f"{world}: paths of all trials")
            page.figure(
                figure, f"paths-{world}", f"Paths and ends in {world} (Fig. 24)", drawn=True
            )


def _joined(rows: Sequence[Row]) -> list[Row]:
    """Return one row a trial, whose path goes on from goal to goal, with its last outcome."""
    found: dict[int, Row] = {}
    for row in rows:
        before = found.get(row["trial"])
        if before is None:
            path = [*row["path"], row["end_xy"]]
            found[row["trial"]] = {"path": path, **{k: row[k] for k in ("goal_xy", "outcome")}}
        else:
            path = [*before["path"], *row["path"], row["end_xy"]]
            found[row["trial"]] = before | {"path": path, "outcome": row["outcome"]}
    return list(found.values())


def _failures(page: Report, folder: Path, causes: Sequence[Row], attempts: Sequence[Row]) -> None:
    """Add causes of failures, their pictures by cause, and each failed trial."""
    page.section("Failures", "" if causes else "None.")
    if not causes:
        return
    page.table(causes[:_FEW], _CAUSES)
    if len(causes) > _FEW:
        with page.folded(f"All {len(causes)} causes"):
            page.table(causes, _CAUSES)
    pictures = _pictures(folder / FAILURES, attempts)
    kept = _within(pictures, MOST_BYTES)
    left_out = sum(map(len, pictures.values())) - sum(map(len, kept.values()))
    if left_out:
        page.note(f"{left_out} more pictures are in {folder / FAILURES}.")
    for title, some in kept.items():
        with page.folded(f"{title} ({len(some)})"), page.grid():
            for name, data in some:
                page.picture(data, name, "webp")
    failed = [row for row in attempts if row["outcome"] != "goal"]
    if failed:
        with page.folded(f"All {len(failed)} failed drives"):
            page.table(failed, _FAILED)


def _pictures(folder: Path, attempts: Sequence[Row]) -> dict[str, list[tuple[str, bytes]]]:
    """Return the pictures of failures as WebP with their names, by controller, end and cause."""
    found: dict[str, list[tuple[str, bytes]]] = {}
    for row in attempts:
        name = f"{row['world']}_{row['world_seed']}_{row['controller']}_goal{row['goal']}"
        path = folder / f"{name}.png"
        if row["outcome"] != "goal" and path.is_file():
            title = f"{row['controller']}: {word(row['outcome'])}, {row['cause']}"
            text = f"{row['world']} {row['world_seed']}, goal {row['goal']}: {row['cause']}"
            found.setdefault(title, []).append((text, _small(path)))
    return found


def _small(path: Path) -> bytes:
    """Return a picture as WebP, narrow enough for a page with many."""
    stream = io.BytesIO()
    with Image.open(path) as image:
        image.thumbnail((_WIDTH, _WIDTH))
        image.convert("RGB").save(stream, "WEBP", quality=_QUALITY)
    return stream.getvalue()


def _within(
    pictures: Mapping[str, list[tuple[str, bytes]]], most: int
) -> dict[str, list[tuple[str, bytes]]]:
    """Return as many pictures as fit, one of each group after the other.

    Args:
        pictures: Names and bytes of pictures by group.
        most: Largest number of bytes.
    """
    found: dict[str, list[tuple[str, bytes]]] = {}
    rounds = max(map(len, pictures.values()), default=0)
    order = ((t, some[k]) for k in range(rounds) for t, some in pictures.items() if k < len(some))
    spent = 0
    for title, (name, data) in order:
        spent += len(data)
        if spent > most:
            break
        found.setdefault(title, []).append((name, data))
    return found


def _fact(row: Row) -> Fact:
    """Return how often a controller reached all goals of a world."""
    return Fact(f"{row['controller']}, {row['world']}", counted(row), interval(row, "success_rate"))


def _names(rows: Sequence[Row], key: str) -> list[str]:
    """Return the values of a column, each once."""
    return list(dict.fromkeys(row[key] for row in rows))
