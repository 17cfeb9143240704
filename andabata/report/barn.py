"""Report of evaluations by the rules of the BARN benchmark."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from andabata.evaluation.barn import BarnEvaluationConfig, drive_path, load_world
from andabata.evaluation.barn_table import run_of
from andabata.report.columns import counted, interval, word
from andabata.report.folder import check_keys, read_about, read_result, read_rows, settings_of
from andabata.report.page import Fact, Report
from andabata.report.plots.evaluation import barn_figure, fields_figure, scores_figure
from andabata.report.run_folders import EVALUATION

Row = dict[str, Any]

WORLDS = "worlds.jsonl"
"""Journal of an evaluation."""

_KEYS = ("rows", "differences", "failures", "worlds", "about", "config")

_ROW_KEYS = ("controller", "worlds", "runs", "successes", "score", "uncapped", "success_low")

_SCORES = ("controller", "score", "uncapped", "success_rate", "mean_time_s", "mean_speed_ratio")

_ENDS = ("controller", "reached", "collisions", "timeouts", "never_left")

_DIFFERENCES = ("controller", "against", "score", "uncapped", "success")

_FAILED = ("controller", "world", "trial", "failure", "time_s", "left_m", "speed_m_s")

_SHOWN_FAILURES = 6
"""Largest number of failed runs that are driven anew for their pictures."""

PAPER_SCORES = (
    "For comparison, others' published figures: DWA 0.16, a learned planner 0.489 on the public 50 "
    "worlds, the best entry of 2026 0.4975 on hidden worlds. They are of the benchmark's own "
    "simulator; before 2024 scores ended at 0.25."
)


def report_barn(folder: Path) -> tuple[Report, Row]:
    """Return a page about an evaluation in fields of cylinders, and its figures.

    Args:
        folder: Folder of the evaluation.

    Raises:
        RunFolderError: If it is not finished, or of another version.
    """
    data = read_result(folder, EVALUATION, _KEYS)
    rows: list[Row] = data["rows"]
    for row in rows:
        check_keys(row, _ROW_KEYS, folder / EVALUATION, folder)
    page = Report(
        f"BARN: {rows[0]['worlds']} fields of cylinders",
        f"{rows[0]['runs']} runs of each navigator; worlds: {data['worlds']}; {data['about']}.",
    )
    page.facts(
        [
            Fact(row["controller"], interval(row, "score"), counted(row, whole="runs"))
            for row in rows
        ]
    )
    page.section(
        "Scores",
        "Success x optimal time / time, at most 0.5 by the official rule. Brackets hold 95 % "
        "intervals for other worlds of the kind.",
    )
    page.figure(scores_figure(rows), "scores", "Scores with 95 % intervals", drawn=True)
    page.table([_with_reached(row) for row in rows], _SCORES)
    page.note(PAPER_SCORES)
    _times(page, folder)
    page.section("Ends", "How the runs ended.")
    page.table([_with_reached(row) for row in rows], _ENDS)
    if data["differences"]:
        page.section(
            "Differences", f"From {data['differences'][0]['against']}, same worlds and noise."
        )
        page.table(data["differences"], _DIFFERENCES)
    _failures(page, folder, data["failures"])
    return page, {key: data[key] for key in ("rows", "differences", "failures", "about")}


def _with_reached(row: Mapping[str, Any]) -> Row:
    """Return a row with the count of the runs that reached the goal."""
    return {**row, "reached": counted(row, whole="runs")}


def _times(page: Report, folder: Path) -> None:
    """Add the times of all runs, where the journal is there."""
    if not (folder / WORLDS).is_file():
        return
    runs = [run_of(run) for entry in read_rows(folder / WORLDS)[1:] for run in entry["runs"]]
    ratios: dict[str, list[Row]] = {}
    for run in runs:
        ratio = run.time / run.detail.optimal_time if run.is_success else None
        ratios.setdefault(run.contender, []).append({"ratio": ratio})
    page.figure(barn_figure(ratios), "times", "Share of runs at the goal by their time", drawn=True)


def _failures(page: Report, folder: Path, failures: Sequence[Row]) -> None:
    """Add failed runs: their kinds, some of their paths, and each of them."""
    page.section("Failures", "" if failures else "None.")
    if not failures:
        return
    counts: dict[tuple[str, str], int] = {}
    for row in failures:
        key = row["controller"], row["failure"]
        counts[key] = counts.get(key, 0) + 1
    page.table(
        [{"controller": name, "failure": kind, "count": n} for (name, kind), n in counts.items()]
    )
    config = settings_of(BarnEvaluationConfig, read_about(folder)["config"], folder)
    # The first of each kind: later keys replace earlier ones.
    kinds = {(row["controller"], row["failure"]): row for row in reversed(failures)}
    chosen = list(kinds.values())[::-1]
    try:
        driven = dict(_driven(config, row) for row in chosen[:_SHOWN_FAILURES])
    except (OSError, ValueError) as error:
        page.note(f"The runs cannot be driven anew for a picture: {error}")
    else:
        text = "One run of each kind, driven anew with the same noise: where it ended"
        page.figure(fields_figure(driven), "failures", text, drawn=True)
    with page.folded(f"All {len(failures)} failed runs"):
        page.table(failures, _FAILED)


def _driven(config: BarnEvaluationConfig, row: Row) -> tuple[str, tuple[Any, Any, str]]:
    """Return title, and room, path and end of a run that is driven anew."""
    name, controller = row["world"], row["controller"]
    world = load_world(config, name)
    result = drive_path(config, world, name, controller, row["trial"])
    end = str(result.outcome)
    # A time-out that never left its start has a name of its own in the table.
    changed = end not in (row["failure"], "timeout")
    now = f"\n(by this code: {word(end)})" if changed else ""
    return _title(row) + now, (world.room, result.path, end)


def _title(row: Row) -> str:
    """Return what a failed run is called in the figure."""
    return (
        f"{row['controller']}, {row['world']}\n{word(row['failure'])}, {row['left_m']:.1f} m left, "
        f"{row['speed_m_s']:.2f} m/s"
    )
