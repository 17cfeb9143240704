"""One self-contained HTML page from typed sections, for light and dark and for paper."""

import html
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.resources import files
from pathlib import Path
from typing import Self

from andabata.printable import printable
from andabata.report.blocks import Block, Fact, Shown, Text, plain
from andabata.report.plots.axes import png
from andabata.report.plots.svg import svg
from andabata.runs import atomic_io


class Section:
    """Part of a page with a heading."""

    def __init__(self, title: str, text: str = "", *blocks: Block | None) -> None:
        """Take what the section shows.

        Args:
            title: Heading.
            text: Paragraph below it; none if empty.
            *blocks: Tables, plots, texts and films in their order; None is left out.
        """
        self.title = title
        self._blocks = [Text(text) if text else None, *blocks]

    def to_html(self, shown: Shown) -> str:
        """Return the section; its figures are added to those of the page."""
        head = f'<h2 id="{plain(self.title)}">{html.escape(self.title)}</h2>'
        return head + "".join(block.to_html(shown) for block in self._blocks if block is not None)


@dataclass(frozen=True)
class Page:
    """Page about one or several runs.

    Attributes:
        title: Title.
        lead: Sentence below it; none if empty.
        facts: Figures that people look for first.
        sections: Sections in their order; None is left out.
    """

    title: str
    lead: str = ""
    facts: Sequence[Fact] = ()
    sections: Sequence[Section | None] = ()

    def with_section(self, section: Section) -> Self:
        """Return the page with another section at its end."""
        return replace(self, sections=(*self.sections, section))

    def to_bytes(self) -> bytes:
        """Return the page, UTF-8."""
        body, _ = self._rendered
        style, script = _asset("page.css"), _asset("page.js")
        page = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width,initial-scale=1">'
            f"<title>{html.escape(self.title)}</title><style>{style}</style></head>"
            f"<body>{body}<script>{script}</script></body>"
            "</html>"
        )
        return printable(page).encode()

    def write_figures(self, folder: Path) -> list[str]:
        """Write each figure as PNG and SVG, and each film, into a folder and return the paths."""
        _, shown = self._rendered
        data = dict(shown.films)
        for name, figure in shown.figures.items():
            data |= {f"{name}.png": png(figure), f"{name}.svg": svg(figure, name)}
        for name, content in data.items():
            atomic_io.write(folder / name, content)
        return [str(folder / name) for name in data]

    @cached_property
    def _rendered(self) -> tuple[str, Shown]:
        """Title, contents, facts and sections as HTML, with their figures and films."""
        sections, shown = [one for one in self.sections if one is not None], Shown()
        lead = f'<p class="lead">{html.escape(self.lead)}</p>' if self.lead else ""
        links = "".join(
            f'<a href="#{plain(one.title)}">{html.escape(one.title)}</a>' for one in sections
        )
        facts = "".join(
            f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)}"
            f"<small>{html.escape(more)}</small></dd></div>"
            for name, value, more in self.facts
        )
        parts = [
            f"<h1>{html.escape(self.title)}</h1>{lead}",
            f"<nav>{links}</nav>" if len(sections) > 1 else "",
            f'<dl class="facts">{facts}</dl>' if facts else "",
            *(section.to_html(shown) for section in sections),
        ]
        return "".join(parts), shown


def _asset(name: str) -> str:
    """Return a file of the page that comes with the package."""
    return files("andabata.report").joinpath(name).read_text(encoding="utf-8")
