"""Tables and texts of faults for people: kinds of faults, what each costs, one drive's response."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Group

from andabata.app.console import table_of
from andabata.machine.faults import FORM, JUMPS, KINDS, SENSES, typical_faults

if TYPE_CHECKING:
    from rich.table import Table

Data = Mapping[str, Any]


def fault_tables(rows: Sequence[Data]) -> Group:
    """Return two tables for each controller: the response to each fault, and what it costs.

    Args:
        rows: Rows of ``fault_rows``.
    """
    names = dict.fromkeys(row["controller"] for row in rows)
    groups = [[row for row in rows if row["controller"] == name] for name in names]
    return Group(*(table for some in groups for table in (_response_table(some), _costs(some))))


def _response_table(rows: Sequence[Data]) -> "Table":
    """Return the response of one controller's robot, for 80 columns.

    ``flagged`` are drives whose health got worse after the onset, ``after`` is their median time,
    ``hit`` counts contacts and tip-overs and in brackets those after the flag, ``bad`` commands out
    of range, ``off`` is the mean error of the estimate at the end, ``ok`` counts healths at the
    end.
    """
    onset = _common_onset(rows)
    shown = [
        {
            "fault": _label(row, onset),
            "flagged": f"{row['flagged']}/{row['faulty']}",
            "in 2 s": str(row["flagged_within_2_s"]),
            "after": _with_unit(row["flagged_after_s"], "s"),
            "hit": f"{row['contacts']} ({row['contacts_after_flag']})",
            "bad": row["bad_commands"],
            "off": _with_unit(row["position_error_m"], "m"),
            "end ok": row["health_at_end"].get("ok", 0),
        }
        for row in rows
    ]
    when = "" if onset is None else f" from {onset:g} s on"
    title = f"{rows[0]['controller']}, each fault alone{when}; hit: contacts (flagged before)"
    return table_of(shown, title)


def _costs(rows: Sequence[Data]) -> "Table":
    """Return what each fault costs one controller, the costliest first, for 80 columns.

    Differences are in points of the share of trials that reach all of their goals.
    """
    base, *faulty = rows
    onset = _common_onset(rows)
    shown = [
        {
            "fault": _label(row, onset),
            "reached": f"{row['successes']}/{row['trials']}",
            "difference": points(row),
            "worse": row["mcnemar_lost"],
            "better": row["mcnemar_gained"],
            "p": f"{row['mcnemar_p']:.2g}",
        }
        for row in sorted(faulty, key=lambda row: row["difference"])
    ]
    without = f"{base['successes']}/{base['trials']} without any"
    return table_of(shown, f"{base['controller']}, what each fault costs; {without}")


def points(row: Data) -> str:
    """Return a difference of shares with its interval, in points."""
    mean, low, high = (100 * row[f"difference{end}"] for end in ("", "_low", "_high"))
    return f"{mean:+.0f} ({low:+.0f} to {high:+.0f})"


def _common_onset(rows: Sequence[Data]) -> float | None:
    """Return the onset of all faults [s]; None if they differ."""
    onsets = {row["onset_s"] for row in rows if row["fault"]}
    return onsets.pop() if len(onsets) == 1 else None


def _label(row: Data, onset: float | None) -> str:
    """Return the text of a fault, without an onset that all faults have."""
    text: str = row["fault"] or "none"
    return text if onset is None else text.removesuffix(f"@{onset:g}")


def _with_unit(number: float | None, unit: str) -> str | None:
    """Return a number with its unit."""
    return None if number is None else f"{number:.1f} {unit}"


def fault_text(data: Data) -> str:
    """Return one drive's faults and the robot's response to them as a line.

    Args:
        data: Data of ``response_as_dict``.
    """
    names = f"faults: {', '.join(data['injected'])}"
    if not data["faulty_s"]:
        return f"{names}: the drive ended before the first onset"
    after = data["flagged_after_s"]
    said = "health never said so" if after is None else f"health said so after {after:.1f} s"
    bad = data["bad_commands"]
    commands = f"; {bad} commands not finite or beyond the limits" if bad else ""
    return f"{names}: {said}, {data['health_at_end']} at the end{commands}"


def catalogue() -> dict[str, Any]:
    """Return senses, kinds and a typical fault of each, ready for JSON."""
    kinds = [
        {"kind": name, "effect": kind.meaning, "number": kind.parameter or None}
        for name, kind in KINDS.items()
    ]
    senses = [{"sense": name, "offset_of_jump": JUMPS[name]} for name in SENSES]
    typical = [str(fault) for fault in typical_faults(SENSES, tuple(KINDS), 20.0)]
    return {"form": FORM, "kinds": kinds, "senses": senses, "typical": typical}


def catalogue_tables(data: Data) -> Group:
    """Return the tables of ``catalogue``."""
    kinds = [{**row, "number": row["number"] or "none"} for row in data["kinds"]]
    senses = [
        {"sense": row["sense"], "number of a jump": row["offset_of_jump"]} for row in data["senses"]
    ]
    return Group(
        table_of(kinds, "kinds"),
        table_of(senses, "senses"),
        f"{data['form']}, times in seconds from the start",
    )
