"""One self-contained HTML page with text, tables and pictures."""

import html
from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}
img{max-width:100%;border:1px solid #ccc}table{border-collapse:collapse;margin:1rem 0}
td,th{border:1px solid #ccc;padding:.25rem .6rem;text-align:right}th{background:#f2f2ee}
td:first-child,th:first-child{text-align:left}h2{margin-top:2.5rem}.note{color:#555}
"""


class Report:
    """HTML page that is written from top to bottom."""

    def __init__(self, title: str) -> None:
        """Begin a page with a title."""
        self._title = title
        self._parts: list[str] = [f"<h1>{html.escape(title)}</h1>"]

    def section(self, title: str, text: str = "") -> None:
        """Begin a section with a title and a paragraph."""
        self._parts.append(f"<h2>{html.escape(title)}</h2>")
        if text:
            self.note(text)

    def note(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def picture(self, png: bytes, caption: str) -> None:
        """Add a PNG picture with its caption."""
        data = b64encode(png).decode("ascii")
        text = html.escape(caption)
        self._parts.append(
            f'<figure><img alt="{text}" src="data:image/png;base64,{data}">'
            f'<figcaption class="note">{text}</figcaption></figure>'
        )

    def table(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Add a table with one column for each key of the first row."""
        if not rows:
            return
        head = "".join(f"<th>{html.escape(str(key))}</th>" for key in rows[0])
        body = "".join(
            "<tr>"
            + "".join(f"<td>{html.escape(_text(row.get(key)))}</td>" for key in rows[0])
            + "</tr>"
            for row in rows
        )
        self._parts.append(f"<table><tr>{head}</tr>{body}</table>")

    def to_bytes(self) -> bytes:
        """Return the page, UTF-8."""
        title = html.escape(self._title)
        page = (
            f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
            f"<style>{_STYLE}</style></head><body>{''.join(self._parts)}</body></html>"
        )
        return page.encode()


def _text(value: object) -> str:
    """Return a table cell's text."""
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
