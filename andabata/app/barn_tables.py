"""Tables of the BARN benchmark for people, from the data that ``--json`` prints."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group

from andabata.app.console import table_of

if TYPE_CHECKING:
    from rich.table import Table

Data = Mapping[str, Any]

_HITS = {
    "hit_mover": "into a mover",
    "hit_by_mover": "by a mover",
    "hit_at_rest": "by one, standing",
}
"""Columns of the hits with movers, which are shown where there was one."""


def barn_tables(data: Data) -> Group:
    """Return the scores of controllers in fields of cylinders, their ends, and differences.

    Args:
        data: Rows of the controllers and of their differences; see ``run_barn_evaluation``.
    """
    rows = data["rows"]
    shows_movers = any(row.get(key) for row in rows for key in _HITS)
    scores = [
        {
            "controller": row["controller"],
            "score": _spread(row, "score"),
            "OT / t": _spread(row, "ot_over_t"),
            "success": f"{row['success_rate']:.3f}",
            "95 %": f"{row['success_low']:.3f}-{row['success_high']:.3f}",
        }
        for row in rows
    ]
    ends = [
        {
            "controller": row["controller"],
            "reached": f"{row['successes']}/{row['runs']}",
            "hit": row["collisions"],
            **{name: row[key] for key, name in _HITS.items() if shows_movers},
            "late": row["timeouts"],
            "never left": row["never_left"],
            "time [s]": row["mean_time_s"],
        }
        for row in rows
    ]
    return Group(
        table_of(scores, f"{rows[0]['worlds']} worlds, {data['about']}"),
        table_of(ends, "How the runs ended"),
        *([_difference_table(data["differences"])] if data["differences"] else []),
        *_notes(data.get("notes", ())),
    )


def _notes(lines: Sequence[str]) -> list[str]:
    """Return what was read past in files of worlds: how often, and where first."""
    more = f" (the first of {len(lines)} such faults)" if len(lines) > 1 else ""
    return [f"Note: {line}{more}" for line in lines[:1]]


def _difference_table(rows: Sequence[Data]) -> "Table":
    """Return the table of differences between controllers on the same worlds and noise."""
    shown = [
        {
            "controller": row["controller"],
            "score": _spread(row, "score", "+"),
            "OT / t": _spread(row, "ot_over_t", "+"),
            "success": _spread(row, "success", "+"),
        }
        for row in rows
    ]
    return table_of(shown, f"Differences from {rows[0]['against']} on the same worlds and noise")


def _spread(row: Data, name: str, sign: str = "") -> str:
    """Return a figure with its interval, where there is one."""
    low, high = row[f"{name}_low"], row[f"{name}_high"]
    text = f"{row[name]:{sign}.3f}"
    return text if low is None else f"{text} [{low:{sign}.2f}, {high:{sign}.2f}]"
