"""Report of evaluations by the rules of the BARN benchmark."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from andabata.evaluation.barn import BarnEvaluationConfig, drive_in_field, load_world, world_names
from andabata.evaluation.barn_table import run_of
from andabata.evaluation.room_drives import room_attempt
from andabata.report.blocks import Block, Fact, Folded, Picture, Plot, Table, Text
from andabata.report.columns import interval, with_reached, word
from andabata.report.folder import read_about, read_result, read_rows, settings_of
from andabata.report.page import Page, Section
from andabata.report.plots.evaluation import barn_figure, fields_figure, scores_figure
from andabata.report.plots.film import film
from andabata.report.plots.room_clip import RATE, room_film
from andabata.report.run_folders import EVALUATION

Row = dict[str, Any]

WORLDS = "worlds.jsonl"
"""Journal of an evaluation."""

_KEYS = ("rows", "differences", "failures", "worlds", "about", "config")

_ROW_KEYS = ("controller", "worlds", "runs", "successes", "score", "ot_over_t", "success_low")

_SCORES = ("controller", "score", "ot_over_t", "success_rate", "mean_time_s")

_ENDS = ("controller", "reached", "collisions", "timeouts", "never_left")

_HITS = ("hit_mover", "hit_by_mover", "hit_at_rest")
"""Columns of the collisions with movers, shown where there was one."""

_DIFFERENCES = ("controller", "against", "score", "ot_over_t", "success")

_FAILED = ("controller", "world", "trial", "failure", "time_s", "left_m", "speed_m_s")

_SHOWN_FAILURES = 6
"""Largest number of failed runs that are driven anew for their pictures."""

_FILMED = 3
"""Largest number of navigators in a film."""

_SCORE_TEXT = (
    "Success x optimal time / time, at most 0.5 by the official rule, and without a limit beside "
    "it. Brackets hold 95 % intervals for other worlds of the kind."
)

PAPER_SCORES = (
    "For comparison, others' published figures: DWA 0.16, a learned planner 0.489 on the public 50 "
    "worlds, the best entry of 2026 0.4975 on hidden worlds. They are of the benchmark's own "
    "simulator; before 2024 scores ended at 0.25."
)


def report_barn(folder: Path) -> tuple[Page, Row]:
    """Return a page about an evaluation in fields of cylinders, and its figures.

    Args:
        folder: Folder of the evaluation.

    Raises:
        RunFolderError: If it is not finished, or of another version.
    """
    data = read_result(folder, EVALUATION, _KEYS, _ROW_KEYS)
    rows, differences = with_reached(data["rows"], "runs"), data["differences"]
    page = Page(
        f"BARN: {rows[0]['worlds']} fields of cylinders",
        f"{rows[0]['runs']} runs of each navigator; worlds: {data['worlds']}; {data['about']}.",
        [Fact(row["controller"], interval(row, "score"), row["reached"]) for row in rows],
        [
            _scores(rows, folder),
            Section("Ends", "How the runs ended.", Table(rows, (*_ENDS, *_hits(rows)))),
            _differences(differences) if differences else None,
            _film(folder, rows),
            _failures(folder, data["failures"]),
        ],
    )
    return page, {key: data[key] for key in ("rows", "differences", "failures", "about")}


def _hits(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the columns of hits of which there was one; tables before they were told have none."""
    return _HITS if any(row.get(name) for row in rows for name in _HITS) else ()


def _scores(rows: Sequence[Row], folder: Path) -> Section:
    """Return the scores, and the times of all runs."""
    plot = Plot(scores_figure(rows), "scores", "Scores with 95 % intervals", drawn=True)
    table = Table(rows, _SCORES)
    return Section("Scores", _SCORE_TEXT, plot, table, Text(PAPER_SCORES), _times(folder))


def _times(folder: Path) -> Plot | None:
    """Return the times of all runs, where the journal is there."""
    if not (folder / WORLDS).is_file():
        return None
    runs = [run_of(run) for entry in read_rows(folder / WORLDS)[1:] for run in entry["runs"]]
    ratios: dict[str, list[Row]] = {}
    for run in runs:
        ratio = run.time / run.detail.optimal_time if run.is_success else None
        ratios.setdefault(run.contender, []).append({"ratio": ratio})
    text = "Share of runs at the goal by their time"
    return Plot(barn_figure(ratios), "times", text, drawn=True)


def _differences(rows: Sequence[Row]) -> Section:
    """Return the differences from one of the controllers."""
    text = f"From {rows[0]['against']}, same worlds and noise."
    return Section("Differences", text, Table(rows, _DIFFERENCES))


def _film(folder: Path, rows: Sequence[Row]) -> Section | None:
    """Return the first run of a field with movers, driven anew by each of the best navigators."""
    config = settings_of(BarnEvaluationConfig, read_about(folder)["config"], folder)
    best = sorted(rows, key=lambda row: -row["score"])[:_FILMED]
    try:
        (name, *_) = world_names(config)
        world = load_world(config, name)
        if not world.room.movers:
            return None
        names = [row["controller"] for row in best]
        driven = {each: drive_in_field(config, world, name, each, 0) for each in names}
    except (OSError, ValueError) as error:
        return Section("Drives", f"They cannot be driven anew for a picture: {error}")
    (task,) = world.room.tasks
    drives = {each: [room_attempt(task, r.outcome, r.path)] for each, r in driven.items()}
    movers = {each: result.movers for each, result in driven.items()}
    radius = max(abs(y) for _, y in config.vehicle.footprint)
    pictures = film(room_film(drives, world.room, radius, movers), RATE, ".gif")
    text = f"The first run in {name}, driven anew with the same noise; they begin together"
    return Section("Drives", "", Picture(pictures, text, "gif", "drives"))


def _failures(folder: Path, failures: Sequence[Row]) -> Section:
    """Return failed runs: their kinds, some of their paths, and each of them."""
    if not failures:
        return Section("Failures", "None.")
    kinds = Counter((row["controller"], row["failure"]) for row in failures)
    counts = [
        {"controller": name, "failure": kind, "count": n} for (name, kind), n in kinds.items()
    ]
    every = Folded(f"All {len(failures)} failed runs", [Table(failures, _FAILED)])
    return Section("Failures", "", Table(counts), _failed_paths(folder, failures), every)


def _failed_paths(folder: Path, failures: Sequence[Row]) -> Block:
    """Return the paths of one failed run of each kind, or why they cannot be driven anew."""
    config = settings_of(BarnEvaluationConfig, read_about(folder)["config"], folder)
    # The first of each kind: later keys replace earlier ones.
    kinds = {(row["controller"], row["failure"]): row for row in reversed(failures)}
    chosen = list(kinds.values())[::-1]
    try:
        driven = dict(_driven(config, row) for row in chosen[:_SHOWN_FAILURES])
    except (OSError, ValueError) as error:
        return Text(f"The runs cannot be driven anew for a picture: {error}")
    text = "One run of each kind, driven anew with the same noise: where it ended"
    return Plot(fields_figure(driven), "failures", text, drawn=True)


def _driven(config: BarnEvaluationConfig, row: Row) -> tuple[str, tuple[Any, Any, str]]:
    """Return title, and room, path and end of a run that is driven anew."""
    name, controller = row["world"], row["controller"]
    world = load_world(config, name)
    result = drive_in_field(config, world, name, controller, row["trial"])
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
