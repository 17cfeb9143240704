"""Blocks of a page's sections: figures, tables, plots, texts, films; each returns its own HTML."""

import html
import json
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from matplotlib.figure import Figure

from andabata.report.columns import heading, interval, shown_keys
from andabata.report.plots.axes import png
from andabata.report.plots.svg import inline_figure

Rows = Sequence[Mapping[str, Any]]

_WIDTH = 100
"""Largest width of an inch of a drawn figure [pixels]."""

_NUMBER = re.compile(r"[+-]?\d[\d.,]*%?( of \d+)?( \[.*\])?")
"""Texts that stand right in their column."""

_LONG = 40
"""Length of texts that are wrapped in their column."""

MOST_COLUMNS = 8
"""Largest number of columns of a table side by side; a wider one is told in several."""

_TYPES = {"png": "image/png", "gif": "image/gif", "webp": "image/webp", "mp4": "video/mp4"}
"""Media types by the end of a file's name."""


@dataclass(frozen=True)
class Shown:
    """Figures and films of a page, which its blocks add themselves to in their order.

    Attributes:
        figures: Figures by their names, which are the same for every run of a kind.
        films: Bytes of moving pictures by the names of their files.
    """

    figures: dict[str, Figure] = field(default_factory=dict)
    films: dict[str, bytes] = field(default_factory=dict)

    def add(self, figure: Figure, name: str) -> str:
        """Add a figure and return its name; a second one of a name gets a number."""
        name, known = plain(name), self.figures
        numbers = (f"{name}-{k}" for k in range(2, len(known) + 3))
        free = name if name not in known else next(n for n in numbers if n not in known)
        known[free] = figure
        return free


class Block(Protocol):
    """Part of a section."""

    def to_html(self, shown: Shown) -> str:
        """Return the block's HTML.

        Args:
            shown: Figures and films of the page so far; those of the block are added.
        """


class Fact(NamedTuple):
    """Figure at the top of a page.

    Attributes:
        name: Name of the figure.
        value: Text of the figure.
        more: Interval, count or paper's figure beside it.
    """

    name: str
    value: str
    more: str = ""


class Text(NamedTuple):
    """Paragraph."""

    text: str

    def to_html(self, _: Shown) -> str:
        """Return the paragraph."""
        return f"<p>{html.escape(self.text)}</p>"


class Code(NamedTuple):
    """Lines of code or settings."""

    text: str

    def to_html(self, _: Shown) -> str:
        """Return the lines as they are."""
        return f"<pre>{html.escape(self.text)}</pre>"


class Folded(NamedTuple):
    """Blocks that a click on their title shows; pictures among them side by side if ``is_grid``."""

    title: str
    blocks: Sequence[Block]
    is_grid: bool = False

    def to_html(self, shown: Shown) -> str:
        """Return the blocks, folded."""
        inside = "".join(block.to_html(shown) for block in self.blocks)
        inside = f'<div class="grid">{inside}</div>' if self.is_grid else inside
        return f"<details><summary>{html.escape(self.title)}</summary>{inside}</details>"


@dataclass(frozen=True)
class Plot:
    """Figure with its caption.

    Attributes:
        figure: Figure.
        name: Name of the figure: letters, digits and hyphens.
        caption: Text below the figure.
        drawn: True for lines that people zoom into and read values from; False for a picture.
        light: True if drawn lines lie on a map, which is light on a dark page, too.
    """

    figure: Figure
    name: str
    caption: str
    drawn: bool = False
    light: bool = False

    def to_html(self, shown: Shown) -> str:
        """Return the figure as a picture, or as lines with their axes."""
        name = shown.add(self.figure, self.name)
        if not self.drawn:
            return Picture(png(self.figure), self.caption).to_html(shown)
        inline, text = inline_figure(self.figure, name, self.light), html.escape(self.caption)
        axes = html.escape(json.dumps(inline.axes))
        markup = inline.markup.replace("<svg", f'<svg role="img" aria-label="{text}"', 1)
        kind = ' class="light"' if self.light else ""
        width = round(self.figure.get_figwidth() * _WIDTH)
        return (
            f'<figure id="{name}"{kind} style="max-width:{width}px" data-axes="{axes}">{markup}'
            f"<figcaption>{text}</figcaption></figure>"
        )


class Picture(NamedTuple):
    """Picture or film with its caption.

    Attributes:
        data: Bytes of the file.
        caption: Text below it.
        kind: End of the file's name: png, gif, webp or mp4.
        name: Name of the file among the page's figures; it is none of them if empty.
    """

    data: bytes
    caption: str
    kind: str = "png"
    name: str = ""

    def to_html(self, shown: Shown) -> str:
        """Return the picture with its bytes inside."""
        if self.name:
            shown.films[f"{plain(self.name)}.{self.kind}"] = self.data
        text, inside = html.escape(self.caption), b64encode(self.data).decode("ascii")
        source = f'src="data:{_TYPES[self.kind]};base64,{inside}"'
        film = f'<video controls loop muted playsinline {source} title="{text}"></video>'
        picture = film if self.kind == "mp4" else f'<img alt="{text}" {source}>'
        return f"<figure>{picture}<figcaption>{text}</figcaption></figure>"


class Table(NamedTuple):
    """Table in words: headings with units, an interval in the cell of its figure.

    Attributes:
        rows: Rows with raw keys, or with headings; nothing is shown without any.
        columns: Keys of the columns in their order; none for all of the first row.
        caption: Text above the table.
        every: Title under which all columns are folded, where not all are shown; none if empty.
    """

    rows: Rows
    columns: Sequence[str] = ()
    caption: str = ""
    every: str = ""

    def to_html(self, shown: Shown) -> str:
        """Return the table, in several if it is wider than a page."""
        if not self.rows:
            return ""
        everything = shown_keys(self.rows[0])
        keys = [key for key in self.columns or everything if key in self.rows[0]]
        if not self.columns and len(keys) > MOST_COLUMNS:
            return "".join(_part(self.rows, part) for part in _parts(self.rows, keys))
        found = _part(self.rows, keys, self.caption)
        if self.every and set(everything) - set(keys):
            found += Folded(self.every, [Table(self.rows)]).to_html(shown)
        return found


def _parts(rows: Rows, keys: Sequence[str]) -> Iterator[list[str]]:
    """Yield the columns of a wide table in parts, each with those that say what a row is about."""
    names = [key for key in keys if _is_name(rows, key)][:3]
    others = [key for key in keys if key not in names]
    step = MOST_COLUMNS - len(names)
    for begin in range(0, len(others), step):
        yield [*names, *others[begin : begin + step]]


def _part(rows: Rows, keys: Sequence[str], caption: str = "") -> str:
    """Return a table of texts; columns of names stand left, those of numbers right."""
    texts = [{key: interval(row, key) for key in keys} for row in rows]
    left = {
        key: ' class="t"'
        if _is_name(rows, key) or any(len(row[key]) > _LONG for row in texts)
        else ""
        for key in keys
    }
    head = "".join(f"<th{left[key]}>{html.escape(heading(key))}</th>" for key in keys)
    body = "".join(
        "<tr>" + "".join(f"<td{left[key]}>{html.escape(row[key])}</td>" for key in keys) + "</tr>"
        for row in texts
    )
    above = f"<caption>{html.escape(caption)}</caption>" if caption else ""
    return f'<div class="wide"><table>{above}<tr>{head}</tr>{body}</table></div>'


def _is_name(rows: Rows, key: str) -> bool:
    """Return True if a column holds words rather than numbers."""
    known = [row[key] for row in rows if row.get(key) is not None]
    return any(isinstance(value, str) and not _NUMBER.fullmatch(value) for value in known)


def plain(text: str) -> str:
    """Return a text as letters, digits and hyphens, for ids and names of files."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "part"
