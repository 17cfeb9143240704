"""HTML page: self-contained, facts and sections in their order, figures as files."""

import io
import re

from matplotlib.figure import Figure
from PIL import Image

from andabata.report.blocks import Fact, Picture, Plot, Table, Text
from andabata.report.page import Page, Section


def drawn():
    """Return a figure with a line."""
    figure = Figure(figsize=(4, 2), layout="constrained")
    figure.subplots().plot([0.0, 1.0, 2.0], [5.0, 7.0, 5.0])
    return figure


def test_a_page_holds_its_parts_in_order():
    """Title, contents, facts, then sections with their blocks; what is None is left out."""
    one = Section("one & all", "x & y", Table([{"name": "r"}]), None, Text("last"))
    page = Page(
        "a < b", "lead <", [Fact("goals", "3 of 4", "[0.3, 0.9]"), Fact("<", "&")], [one, None]
    )
    text = page.with_section(Section("two")).to_bytes().decode()
    parts = [
        "<title>a &lt; b</title>",
        "<h1>a &lt; b</h1>",
        "lead &lt;</p>",
        '<nav><a href="#one-all">one &amp; all</a><a href="#two">two</a></nav>',
        '<dl class="facts"><div><dt>goals</dt><dd>3 of 4<small>[0.3, 0.9]</small></dd></div>',
        "<div><dt>&lt;</dt><dd>&amp;<small></small></dd></div></dl>",
        '<h2 id="one-all">one &amp; all</h2><p>x &amp; y</p>',
        '<td class="t">r</td>',
        "<p>last</p>",
        '<h2 id="two">two</h2>',
        "<script>",
    ]
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert text.startswith("<!doctype html>")
    short = page.to_bytes().decode()
    assert "two" not in short
    assert "<nav>" not in short
    assert "<p></p>" not in text
    empty = Page("a").to_bytes().decode()
    assert "<h1>a</h1><script>" in empty


def test_a_page_needs_no_network():
    """Nothing refers to another place: no addresses, no files beside the page."""
    curves = Plot(drawn(), "curves", "caption", drawn=True)
    film = Picture(b"film", "caption", "mp4")
    section = Section("a", "", curves, Plot(drawn(), "curves", "caption"), film)
    text = Page("a", sections=[section]).to_bytes().decode()
    assert "http" not in text
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources
    assert all(source.startswith(("data:", "#")) for source in sources)


def test_figures_are_written_as_png_and_svg_under_stable_names(tmp_path):
    """Each figure has two files, a film one; the same page writes the same bytes again."""
    files = []
    for folder in ("one", "two"):
        plots = [Plot(drawn(), "curves", "c", drawn=True), Plot(drawn(), "curves", "c")]
        clip = Picture(b"GIF", "c", "gif", "clip")
        sections = [Section("a", "", *plots), Section("b", "", clip)]
        (tmp_path / folder).mkdir()
        files.append(Page("a", sections=sections).write_figures(tmp_path / folder))
    names = ["clip.gif", "curves.png", "curves.svg", "curves-2.png", "curves-2.svg"]
    assert files[0] == [str(tmp_path / "one" / name) for name in names]
    for name in names:
        first, second = ((tmp_path / folder / name).read_bytes() for folder in ("one", "two"))
        assert first == second
    assert Image.open(io.BytesIO((tmp_path / "one/curves.png").read_bytes())).format == "PNG"
    assert b"<svg" in (tmp_path / "one/curves.svg").read_bytes()
    assert (tmp_path / "one/clip.gif").read_bytes() == b"GIF"
