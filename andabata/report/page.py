"""One self-contained HTML page with text, tables and figures, for light and dark and for paper."""

import html
import json
import re
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from andabata.printable import printable
from andabata.report.columns import heading, interval, shown_keys
from andabata.report.plots.axes import png
from andabata.report.plots.svg import inline_figure, svg
from andabata.runs import atomic_io

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


class Fact(NamedTuple):
    """A figure at the top of a page.

    Attributes:
        name: Name of the figure.
        value: Text of the figure.
        more: Interval, count or paper's figure beside it.
    """

    name: str
    value: str
    more: str = ""


class Report:
    """HTML page that is written from top to bottom.

    Attributes:
        figures: Figures of the page by their names, which are the same for every run of a kind.
        films: Moving pictures of the page by the names of their files.
    """

    def __init__(self, title: str, lead: str = "") -> None:
        """Begin a page.

        Args:
            title: Title of the page.
            lead: Sentence below it.
        """
        self._title = title
        self._parts: list[str] = []
        self._head = f"<h1>{html.escape(title)}</h1>"
        self._head += f'<p class="lead">{html.escape(lead)}</p>' if lead else ""
        self._sections: list[tuple[str, str]] = []
        self.figures: dict[str, Figure] = {}
        self.films: dict[str, bytes] = {}

    def section(self, title: str, text: str = "") -> None:
        """Begin a section with a title and a paragraph."""
        place = _plain(title)
        self._sections.append((place, title))
        self._parts.append(f'<h2 id="{place}">{html.escape(title)}</h2>')
        if text:
            self.note(text)

    def note(self, text: str) -> None:
        """Add a paragraph."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

    def code(self, text: str) -> None:
        """Add lines of code or settings."""
        self._parts.append(f"<pre>{html.escape(text)}</pre>")

    def facts(self, facts: Sequence[Fact]) -> None:
        """Add the figures that people look for first."""
        shown = "".join(
            f"<div><dt>{html.escape(one.name)}</dt><dd>{html.escape(one.value)}"
            f"<small>{html.escape(one.more)}</small></dd></div>"
            for one in facts
        )
        self._parts.append(f'<dl class="facts">{shown}</dl>')

    @contextmanager
    def folded(self, title: str) -> Iterator[None]:
        """Fold what is added inside; a click on the title shows it."""
        self._parts.append(f"<details><summary>{html.escape(title)}</summary>")
        yield
        self._parts.append("</details>")

    @contextmanager
    def grid(self) -> Iterator[None]:
        """Put the pictures that are added inside side by side."""
        self._parts.append('<div class="grid">')
        yield
        self._parts.append("</div>")

    def figure(
        self,
        figure: Figure,
        name: str,
        caption: str,
        *,
        drawn: bool = False,
        light: bool = False,
    ) -> None:
        """Add a figure with its caption.

        Args:
            figure: Figure.
            name: Name of the figure: letters, digits and hyphens; a second one of a name gets a
                number.
            caption: Text below the figure.
            drawn: True for lines that people zoom into and read values from; False for a picture.
            light: True if drawn lines lie on a map, which is light on a dark page, too.
        """
        name = self._free(name)
        self.figures[name] = figure
        if not drawn:
            self.picture(png(figure), caption)
            return
        inline, text = inline_figure(figure, name, light), html.escape(caption)
        axes = html.escape(json.dumps(inline.axes))
        markup = inline.markup.replace("<svg", f'<svg role="img" aria-label="{text}"', 1)
        kind = ' class="light"' if light else ""
        width = round(figure.get_figwidth() * _WIDTH)
        self._parts.append(
            f'<figure id="{name}"{kind} style="max-width:{width}px" data-axes="{axes}">{markup}'
            f"<figcaption>{text}</figcaption></figure>"
        )

    def film(self, data: bytes, name: str, caption: str, kind: str = "gif") -> None:
        """Add a moving picture with its caption.

        Args:
            data: Bytes of the file.
            name: Name of the film, as that of a figure.
            caption: Text below it.
            kind: End of the file's name: gif or mp4; png for a single picture.
        """
        self.films[f"{_plain(name)}.{kind}"] = data
        self.picture(data, caption, kind)

    def picture(self, data: bytes, caption: str, kind: str = "png") -> None:
        """Add a picture or film with its caption.

        Args:
            data: Bytes of the file.
            caption: Text below it.
            kind: End of the file's name: png, gif, webp or mp4.
        """
        text, inside = html.escape(caption), b64encode(data).decode("ascii")
        source = f'src="data:{_TYPES[kind]};base64,{inside}"'
        shown = f'<img alt="{text}" {source}>'
        if kind == "mp4":
            shown = f'<video controls loop muted playsinline {source} title="{text}"></video>'
        self._parts.append(f"<figure>{shown}<figcaption>{text}</figcaption></figure>")

    def table(
        self,
        rows: Sequence[Mapping[str, Any]],
        shown: Sequence[str] | None = None,
        *,
        caption: str = "",
        every: str = "",
    ) -> None:
        """Add a table in words: headings with units, an interval in the cell of its figure.

        Args:
            rows: Rows with raw keys, or with headings.
            shown: Keys of the columns in their order; None for all of the first row.
            caption: Text above the table.
            every: Title under which all columns are folded, where not all are shown; none if empty.
        """
        if not rows:
            return
        keys = [key for key in shown or shown_keys(rows[0]) if key in rows[0]]
        if shown is None and len(keys) > MOST_COLUMNS:
            self._in_parts(rows, keys)
            return
        self._part(rows, keys, caption)
        if every and set(shown_keys(rows[0])) - set(keys):
            with self.folded(every):
                self._in_parts(rows, shown_keys(rows[0]))

    def _in_parts(self, rows: Sequence[Mapping[str, Any]], keys: Sequence[str]) -> None:
        """Add a wide table in several, each with the columns that say what a row is about."""
        names = [key for key in keys if _is_name(rows, key)][:3]
        others = [key for key in keys if key not in names]
        step = MOST_COLUMNS - len(names)
        for begin in range(0, len(others), step):
            self._part(rows, [*names, *others[begin : begin + step]], "")

    def _part(self, rows: Sequence[Mapping[str, Any]], keys: Sequence[str], caption: str) -> None:
        """Add one table of texts; columns of names stand left, those of numbers right."""
        texts = [{key: interval(row, key) for key in keys} for row in rows]
        left = {
            key: ' class="t"'
            if _is_name(rows, key) or any(len(row[key]) > _LONG for row in texts)
            else ""
            for key in keys
        }
        head = "".join(f"<th{left[key]}>{html.escape(heading(key))}</th>" for key in keys)
        body = "".join(
            "<tr>"
            + "".join(f"<td{left[key]}>{html.escape(row[key])}</td>" for key in keys)
            + "</tr>"
            for row in texts
        )
        above = f"<caption>{html.escape(caption)}</caption>" if caption else ""
        self._parts.append(f'<div class="wide"><table>{above}<tr>{head}</tr>{body}</table></div>')

    def _free(self, name: str) -> str:
        """Return a name that no figure has yet."""
        name = _plain(name)
        numbers = (f"{name}-{k}" for k in range(2, len(self.figures) + 3))
        return (
            name if name not in self.figures else next(n for n in numbers if n not in self.figures)
        )

    def write_figures(self, folder: Path) -> list[str]:
        """Write each figure as PNG and SVG, and each film, into a folder and return the paths."""
        found = []
        for name, data in self.films.items():
            found.append(str(folder / name))
            atomic_io.write(folder / name, data)
        for name, figure in self.figures.items():
            for end, data in (("png", png(figure)), ("svg", svg(figure, name))):
                found.append(str(folder / f"{name}.{end}"))
                atomic_io.write(folder / f"{name}.{end}", data)
        return found

    def to_bytes(self) -> bytes:
        """Return the page, UTF-8."""
        style, script = _asset("page.css"), _asset("page.js")
        links = "".join(
            f'<a href="#{id_}">{html.escape(title)}</a>' for id_, title in self._sections
        )
        contents = f"<nav>{links}</nav>" if len(self._sections) > 1 else ""
        page = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width,initial-scale=1">'
            f"<title>{html.escape(self._title)}</title><style>{style}</style></head>"
            f"<body>{self._head}{contents}{''.join(self._parts)}<script>{script}</script></body>"
            "</html>"
        )
        return printable(page).encode()


def _plain(text: str) -> str:
    """Return a text as letters, digits and hyphens, for ids and names of files."""
    return re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-") or "part"


def _is_name(rows: Sequence[Mapping[str, Any]], key: str) -> bool:
    """Return True if a column holds words rather than numbers."""
    known = [row[key] for row in rows if row.get(key) is not None]
    return bool(known) and any(
        isinstance(value, str) and not _NUMBER.fullmatch(value) for value in known
    )


def _asset(name: str) -> str:
    """Return a file of the page that comes with the package."""
    return files("andabata.report").joinpath(name).read_text(encoding="utf-8")
