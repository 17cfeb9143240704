"""Tables of an evaluation off-road for people, with what each disturbance costs."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group

from andabata.app.console import table_of
from andabata.app.tables import evaluation_tables

if TYPE_CHECKING:
    from rich.table import Table

Data = Mapping[str, Any]


def offroad_tables(data: Data) -> Group:
    """Return a table for each world, and one of the disturbances, where there are any.

    The first have the undisturbed controllers alone; ``--json`` has the rows of all.
    """
    compared: Sequence[Data] = data.get("perturbations", ())
    if not compared:
        return evaluation_tables(data)
    names = list(dict.fromkeys(row["controller"] for row in compared))
    undisturbed = [row for row in data["rows"] if row["controller"] in names]
    tables = (_table([row for row in compared if row["controller"] == name]) for name in names)
    return Group(evaluation_tables({**data, "rows": undisturbed}), *tables)


def _table(rows: Sequence[Data]) -> "Table":
    """Return the table of one controller, the costliest disturbance first, for 80 columns.

    Differences are in points of the share of trials that reach all of their goals.
    """
    shown = [
        {
            "disturbance": f"{row['disturbance']}={row['strength']:g}",
            "reached": f"{row['successes']}/{row['trials']}",
            "difference": _points(row),
            "worse": row["mcnemar_lost"],
            "better": row["mcnemar_gained"],
            "p": f"{row['mcnemar_p']:.2g}",
        }
        for row in sorted(rows, key=lambda row: row["difference"])
    ]
    first = rows[0]
    undisturbed = f"{first['undisturbed']}/{first['trials']} without any"
    return table_of(shown, f"{first['controller']}, each disturbance alone; {undisturbed}")


def _points(row: Data) -> str:
    """Return a difference of shares with its interval, in points."""
    mean, low, high = (100 * row[f"difference{end}"] for end in ("", "_low", "_high"))
    return f"{mean:+.0f} ({low:+.0f} to {high:+.0f})"
