"""Markdown tables."""

import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table that ends with a line break.

    Args:
        head: Texts of the first row.
        rows: Texts of the others, as many each.
    """
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(_cell(text) for text in line)} |\n" for line in lines)


def prose(text: str) -> str:
    """Return a text of a docstring as Markdown: code in single backticks, nothing else marked."""
    text = " ".join(text.split()).replace("``", "`")
    parts = re.split(r"(`[^`]*`)", text)
    # What is not code must not become emphasis, a link or a tag.
    return "".join(
        part if part.startswith("`") else re.sub(r"([*_<\[])", r"\\\1", part) for part in parts
    )


def code(value: object) -> str:
    """Return a value as code."""
    return f"`{value}`"


def _cell(text: str) -> str:
    """Return a text without what would end a cell."""
    return text.replace("|", r"\|").replace("\n", " ")
