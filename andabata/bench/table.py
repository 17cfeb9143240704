"""Rows of benchmark results, and Markdown tables of them."""

from collections.abc import Mapping, Sequence
from typing import Any

Row = dict[str, Any]
"""One line of a table: values by column name, ready for JSON."""


def benchmark_row(
    name: str,
    subject: str,
    value: float,
    unit: str,
    runs: int,
    ratio_to_ours: float | None = None,
) -> Row:
    """Return one row of ``andabata bench --json``.

    Args:
        name: Name of the quantity or of the work.
        subject: Name of the implementation or configuration that was measured.
        value: Measured value.
        unit: Unit of the value; ``1`` if it has none.
        runs: Number of runs or samples behind the value.
        ratio_to_ours: Value divided by andabata's own; None if there is nothing to compare with.
    """
    return {
        "name": name,
        "subject": subject,
        "value": value,
        "unit": unit,
        "ratio_to_ours": ratio_to_ours,
        "runs": runs,
    }


def markdown_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows as a Markdown table; the columns are the keys of the first row.

    Floats are written with four significant digits, missing values as a dash.
    """
    if not rows:
        return ""
    columns = list(rows[0])
    lines = [columns, ["---"] * len(columns)]
    lines += [[_text(row.get(column)) for column in columns] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _text(value: object) -> str:
    """Return the text of one table cell."""
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
