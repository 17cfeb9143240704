"""Tables of an evaluation off-road for people: worlds, pairs, costs of disturbances and faults."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group

from andabata.app.console import table_of
from andabata.app.fault_tables import fault_tables, points
from andabata.app.tables import evaluation_tables

if TYPE_CHECKING:
    from rich.table import Table

Data = Mapping[str, Any]


def offroad_tables(data: Data) -> Group:
    """Return a table for each world, one of the pairs, and those of disturbances and faults.

    The first have the undisturbed controllers alone; ``--json`` has the rows of all.
    """
    faults: Sequence[Data] = data.get("faults", ())
    compared: Sequence[Data] = data.get("perturbations", ())
    pairs: Sequence[Data] = data.get("differences", ())
    names = list(dict.fromkeys(row["controller"] for row in (*compared, *faults)))
    rows = [row for row in data["rows"] if not names or row["controller"] in names]
    tables = [_pairs_table(pairs)] if pairs else []
    disturbed = dict.fromkeys(row["controller"] for row in compared)
    tables += [_table([row for row in compared if row["controller"] == name]) for name in disturbed]
    return Group(evaluation_tables({**data, "rows": rows}), *tables, fault_tables(faults))


def _pairs_table(rows: Sequence[Data]) -> "Table":
    """Return the table of the differences from the first controller, for 80 columns.

    Of a trial's success in points, of its SPL, and of its time in seconds.
    """
    shown = [
        {
            "controller": row["controller"],
            "success": _interval(_in_points(row), "difference", "+.0f"),
            "p": f"{row['mcnemar_p']:.1g}",
            "spl": _interval(row, "spl_difference", "+.2f"),
            "s": _interval(row, "time_difference_s", "+.0f"),
        }
        for row in rows
    ]
    first = rows[0]
    title = f"in pairs with {first['against']}, {first['trials']} trials each; s: both finished"
    return table_of(shown, title)


def _in_points(row: Data) -> Data:
    """Return a row with its difference of shares in points."""
    return {name: 100 * row[name] for name in ("difference", "difference_low", "difference_high")}


def _interval(row: Data, name: str, form: str) -> str | None:
    """Return a difference with its interval, None without one."""
    if row[name] is None:
        return None
    mean, low, high = (format(row[f"{name}{end}"], form) for end in ("", "_low", "_high"))
    return f"{mean} [{low}, {high}]"


def _table(rows: Sequence[Data]) -> "Table":
    """Return the table of one controller, the costliest disturbance first, for 80 columns.

    Differences are in points of the share of trials that reach all of their goals.
    """
    shown = [
        {
            "disturbance": f"{row['disturbance']}={row['strength']:g}",
            "reached": f"{row['successes']}/{row['trials']}",
            "difference": points(row),
            "worse": row["mcnemar_lost"],
            "better": row["mcnemar_gained"],
            "p": f"{row['mcnemar_p']:.2g}",
        }
        for row in sorted(rows, key=lambda row: row["difference"])
    ]
    first = rows[0]
    undisturbed = f"{first['undisturbed']}/{first['trials']} without any"
    return table_of(shown, f"{first['controller']}, each disturbance alone; {undisturbed}")
