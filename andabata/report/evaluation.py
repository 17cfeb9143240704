"""Report of evaluations off-road and of suites, with Table 4 and Figure 24 of Sanchez et al."""

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from PIL import Image

from andabata.evaluation.offroad_table import success_text
from andabata.report.blocks import Block, Fact, Folded, Picture, Plot, Table, Text
from andabata.report.columns import HITS, interval, several, with_reached, word
from andabata.report.folder import read_result, read_rows
from andabata.report.page import Page, Section
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
    "strict_successes",
    "spl",
    "collisions",
    "tipovers",
    "timeouts",
    "stuck",
    "false_arrivals",
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

_SUCCESS_TEXT = (
    "A goal counts as tried in every trial, so that the figures are those of goals in a row. "
    "Brackets hold 95 % intervals (Wilson); SPL is success weighted by path length."
)

_PAIRS = (
    *("controller", "difference", "mcnemar_gained", "mcnemar_lost", "mcnemar_p"),
    *("spl_difference", "time_difference_s", "both"),
)

_PAIRS_TEXT = (
    "Each controller less {against}, in the same {trials} trials. A trial counts as a success if "
    "it reached all of its goals. Times are compared where both have finished. Brackets hold 95 % "
    "intervals: of success after Agresti and Min, of SPL and time by resampled worlds."
)

_FAULTS = (
    *("fault", "faulty", "flagged", "flagged_within_2_s", "flagged_after_s", "contacts"),
    *("contacts_after_flag", "bad_commands", "position_error_m", "successes", "difference"),
)

_FAULTS_TEXT = (
    "Each fault alone, in the same {trials} trials; the first row is the robot without any. "
    "Flagged are drives whose health got worse after the onset; contacts include tip-overs. Times "
    "are medians, from the onset. Differences are those of trials that reached all of their goals."
)

_PAPER_TEXT = "The paper's Table 4, in its own test world, beside those of natural-test:"

_PATHS_TEXT = (
    "Each trial has a world of its own: paths begin at the origin, the first goal lies ahead. "
    "The paper's Fig. 24 shows those of one world."
)


def report_evaluation(folder: Path) -> tuple[Page, Row]:
    """Return a page about an evaluation off-road, and its figures.

    Args:
        folder: Folder of the evaluation.

    Raises:
        RunFolderError: If it is not finished, or of another version.
    """
    data = read_result(folder, EVALUATION, _KEYS, _ROW_KEYS)
    rows: list[Row] = data["rows"]
    attempts = read_attempts(folder / TRIALS) if (folder / TRIALS).is_file() else []
    suite, controllers = data["config"].get("suite"), _names(rows, "controller")
    worlds = _names(rows, "world")
    title = f"Suite {suite}" if suite else f"{several(len(controllers), 'controller')} side by side"
    page = Page(
        title,
        f"{', '.join(controllers)}; the same worlds, starts and noise for each.",
        [_fact(row) for row in with_reached(rows) if row["goal"] == "all"],
        [
            _success(rows, worlds, data.get("success_within")),
            _pairs(data.get("differences", ())),
            _faults(data.get("faults", ())),
            _by_difficulty(attempts, controllers),
            _paths(attempts, worlds),
            _failures(folder, data["failures"], attempts),
        ],
    )
    shown = ("rows", "failures", "success_within", "faults")
    return page, {key: data[key] for key in shown if key in data}


def read_attempts(path: Path) -> list[Row]:
    """Return the attempts of an evaluation's journal, which begins with its description.

    Raises:
        RunFolderError: If it is damaged.
    """
    return [row for entry in read_rows(path)[1:] for row in entry["rows"]]


def _success(rows: Sequence[Row], worlds: Sequence[str], within: Row | None) -> Section:
    """Return success by goal, a table a world, and how near a goal counts as reached."""
    there = PAPER_WORLD in worlds
    beside = "; hollow: the paper's Table 4, of one world" if there else ""
    figure = goals_figure(rows, {PAPER_WORLD: PAPER_GOALS} if there else {})
    tables = (
        goals_table([row for row in rows if row["world"] == name], f"All columns of {name}", name)
        for name in worlds
    )
    plot = Plot(figure, "success", f"Goals reached in a row{beside}", drawn=True)
    paper = [Text(_PAPER_TEXT), Table(_paper_rows())] if there else ()
    text = _SUCCESS_TEXT if within is None else f"{_SUCCESS_TEXT} {_capital(within)}"
    return Section("Success", text, plot, *tables, *paper)


def _capital(within: Row) -> str:
    """Return how near a goal counts as reached as a sentence."""
    text = success_text(within)
    return f"{text[0].upper()}{text[1:]}."


def goals_table(rows: Sequence[Row], every: str, caption: str = "") -> Table:
    """Return the table of one world: goals reached in a row, ends and measures.

    Args:
        rows: Rows of ``andabata.evaluation.offroad_table.summarise``.
        every: Title under which all columns are folded.
        caption: Text above the table.
    """
    several_goals = len({row["goal"] for row in rows}) > 2  # Two are the only goal and "all".
    shown = [row for row in with_reached(rows) if several_goals or row["goal"] != "all"]
    # Where nothing moves, three columns of noughts would say nothing.
    hits = HITS if any(row.get(key) for row in rows for key in HITS) else ()
    after = _SHOWN.index("collisions") + 1
    return Table(shown, (*_SHOWN[:after], *hits, *_SHOWN[after:]), caption, every)


def _pairs(rows: Sequence[Row]) -> Section | None:
    """Return the differences from the first controller; None of one alone."""
    if not rows:
        return None
    first = rows[0]
    text = _PAIRS_TEXT.format(trials=first["trials"], against=first["against"])
    return Section("Pairs", text, Table(rows, _PAIRS))


def _faults(rows: Sequence[Row]) -> Section | None:
    """Return the response to faults of senses, a table a controller; None without faults."""
    if not rows:
        return None
    tables = (
        Table([row for row in rows if row["controller"] == name], _FAULTS, name)
        for name in _names(rows, "controller")
    )
    return Section("Faults", _FAULTS_TEXT.format(trials=rows[0]["trials"]), *tables)


def _paper_rows() -> list[Row]:
    """Return the rows of the paper's Table 4."""
    return [
        {"paper's controller": name} | {f"goal {k}": f"{r:.1%}" for k, r in enumerate(rates, 1)}
        for name, rates in PAPER_GOALS.items()
    ]


def _by_difficulty(attempts: Sequence[Row], controllers: Sequence[str]) -> Section | None:
    """Return success over difficulty where worlds of several difficulties were driven."""
    # The last attempt of each trial: later ones replace earlier ones.
    last = {(row["trial"], row["controller"]): row for row in attempts}.values()
    trials = [
        {
            "controller": row["controller"],
            "difficulty": row["difficulty"],
            "success": row["outcome"] == "goal" and row["goal"] == row["goals"],
        }
        for row in last
        if row.get("difficulty") is not None
    ]
    if len({row["difficulty"] for row in trials}) < 2:
        return None
    figure = difficulty_figure(trials, controllers)
    plot = Plot(figure, "difficulty", "All goals reached, with 95 % intervals", drawn=True)
    text = "Whole trials in worlds of rising difficulty, in five ranges."
    return Section("Difficulty", text, plot)


def _paths(attempts: Sequence[Row], worlds: Sequence[str]) -> Section | None:
    """Return the paths of all trials, a figure a world (Fig. 24)."""
    by_world: dict[str, dict[str, list[Row]]] = {world: {} for world in worlds}
    for row in attempts:
        if row.get("path") and row.get("goal_xy"):
            by_world[row["world"]].setdefault(row["controller"], []).append(row)
    plots = []
    for world, by_controller in by_world.items():
        trials = {name: _joined(rows) for name, rows in by_controller.items()}
        if trials:
            figure = paths_figure(trials, f"{world}: paths of all trials")
            caption = f"Paths and ends in {world} (Fig. 24)"
            plots.append(Plot(figure, f"paths-{world}", caption, drawn=True))
    return Section("Paths", _PATHS_TEXT, *plots) if plots else None


def _joined(rows: Sequence[Row]) -> list[Row]:
    """Return one row a trial, whose path goes on from goal to goal, with its last outcome."""
    found: dict[int, Row] = {}
    for row in rows:
        first = found.setdefault(row["trial"], {"path": [], "goal_xy": row["goal_xy"]})
        path = [*first["path"], *row["path"], row["end_xy"]]
        found[row["trial"]] = first | {"path": path, "outcome": row["outcome"]}
    return list(found.values())


def _failures(folder: Path, causes: Sequence[Row], attempts: Sequence[Row]) -> Section:
    """Return causes of failures, their pictures by cause, and each failed trial."""
    if not causes:
        return Section("Failures", "None.")
    failed = [row for row in attempts if row["outcome"] != "goal"]
    causes_table = Folded(f"All {len(causes)} causes", [Table(causes, _CAUSES)])
    failed_table = Folded(f"All {len(failed)} failed drives", [Table(failed, _FAILED)])
    return Section(
        "Failures",
        "",
        Table(causes[:_FEW], _CAUSES),
        causes_table if len(causes) > _FEW else None,
        *_shown_pictures(folder / FAILURES, failed),
        failed_table if failed else None,
    )


def _shown_pictures(folder: Path, failed: Sequence[Row]) -> Iterator[Block]:
    """Yield the pictures of failures that a page has room for, by controller, end and cause."""
    pictures = _pictures(folder, failed)
    kept = _within(pictures, MOST_BYTES)
    left_out = sum(map(len, pictures.values())) - sum(map(len, kept.values()))
    if left_out:
        yield Text(f"{left_out} more pictures are in {folder}.")
    for title, some in kept.items():
        shown = [Picture(data, name, "webp") for name, data in some]
        yield Folded(f"{title} ({len(some)})", shown, is_grid=True)


def _pictures(folder: Path, failed: Sequence[Row]) -> dict[str, list[tuple[str, bytes]]]:
    """Return the pictures of failures as WebP with their names, by controller, end and cause."""
    found: dict[str, list[tuple[str, bytes]]] = {}
    for row in failed:
        name = f"{row['world']}_{row['world_seed']}_{row['controller']}_goal{row['goal']}"
        path = folder / f"{name}.png"
        if path.is_file():
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
    name = f"{row['controller']}, {row['world']}"
    return Fact(name, row["reached"], interval(row, "success_rate"))


def _names(rows: Sequence[Row], key: str) -> list[str]:
    """Return the values of a column, each once."""
    return list(dict.fromkeys(row[key] for row in rows))
