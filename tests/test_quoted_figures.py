"""A figure that a page quotes from a results page stands there."""

import re
from functools import cache
from pathlib import Path

import pytest

from tests.support.documents import ROOT, documents

_LINK = re.compile(r"\[([^\]]*)\]\(([^)#\s]*results/[^)#\s]+\.md)(#[^)\s]*)?\)")
_ANY_LINK = re.compile(r"\[([^\]]*)\]\([^)\s]*\)")
_NUMBER = re.compile(r"(?<![\w.#/-])\d[\d,]*(?:\.\d+)?")
_INDEX = ("results/README.md", "/history/")
"""Pages of links, of which nothing is quoted."""

_SCALES = (1.0, 100.0, 0.01, 1000.0, 0.001)
"""Percent for shares, and thousandths for units."""


def section(page: Path, anchor: str) -> str:
    """Return the text under a heading, or the whole page without an anchor."""
    text = page.read_text(encoding="utf-8")
    if not anchor:
        return text
    found: list[str] = []
    level = 0
    for line in text.splitlines():
        heading = re.match(r"(#+) (.*)", line)
        if heading:
            if level and len(heading[1]) <= level:
                break
            if slug(heading[2]) == anchor.removeprefix("#"):
                level = len(heading[1])
        if level:
            found.append(line)
    return "\n".join(found)


def slug(heading: str) -> str:
    """Return the anchor of a heading."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def numbers(text: str) -> list[str]:
    """Return the numbers of a text, without those in code."""
    plain = re.sub(r"`[^`]*`", " ", text)
    return [match.replace(",", "") for match in _NUMBER.findall(plain)]


def is_held(number: str, others: list[float]) -> bool:
    """Return whether a number is one of others, rounded; percents and thousandths count."""
    half = 0.5 * 10.0 ** -len(number.partition(".")[2]) * (1 + 1e-9)
    value = float(number)
    return any(abs(other * scale - value) <= half for other in others for scale in _SCALES)


@cache
def held(page: Path, anchor: str) -> list[float]:
    """Return the numbers of a section, also those in its code."""
    found = re.findall(r"\d[\d,]*(?:\.\d+)?", section(page, anchor))
    return sorted({float(number.replace(",", "")) for number in found})


def missing(document: str, line: str) -> list[str]:
    """Return the numbers of a line that stand in no section that it links to."""
    links = [m for m in _LINK.finditer(line) if not any(part in m[2] for part in _INDEX)]
    if not links:
        return []
    folder = (ROOT / document).parent
    there = [number for m in links for number in held((folder / m[2]).resolve(), m[3] or "")]
    text = _ANY_LINK.sub(lambda m: m[1], line)
    return [number for number in numbers(text) if not is_held(number, there)]


QUOTING = [
    each for each in documents() if "docs/results" not in each and "docs/reference" not in each
]


@pytest.mark.parametrize("document", QUOTING)
def test_quoted_figures_stand_where_the_link_leads(document):
    """In a row or a sentence with a link to results, each number is in the section of the link."""
    text = (ROOT / document).read_text(encoding="utf-8")
    wrong = {line: absent for line in text.splitlines() if (absent := missing(document, line))}
    assert not wrong


def test_a_stale_figure_is_noticed():
    """Numbers that the section has not, or has with other digits."""
    line = "| speed | 3.5 us, [filter](docs/results/localization.md#speed-of-the-filter) | 89 |"
    assert missing("README.md", line) == []
    assert missing("README.md", line.replace("3.5", "3.6")) == ["3.6"]
    assert missing("README.md", line.replace("89", "0.891")) == ["0.891"]
    assert missing("README.md", "3.6 us, as `x` says") == []


def test_shares_may_be_percents_and_digits_be_rounded():
    """A page quotes what it needs of a figure."""
    assert is_held("92", [0.9212])
    assert is_held("0.92", [0.9212])
    assert is_held("0.52", [521.0])
    assert not is_held("0.93", [0.9212])


def test_a_section_ends_with_the_next_heading_of_its_level(tmp_path):
    """What follows is not quoted."""
    page = tmp_path / "page.md"
    page.write_text("# A\n\n## B c\n\n1\n\n### D\n\n2\n\n## E\n\n3\n", encoding="utf-8")
    assert numbers(section(page, "#b-c")) == ["1", "2"]
    assert numbers(section(page, "")) == ["1", "2", "3"]
