"""HTML page: self-contained, in order, with escaped text, words for keys, and drawn figures."""

import io
import json
import re
from base64 import b64encode

import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from andabata.report.page import MOST_COLUMNS, Fact, Report


def drawn():
    """Return a figure of two axes with a line each."""
    figure = Figure(figsize=(4, 2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0.0, 1.0, 2.0], [5.0, 7.0, 5.0], label="seed 0", color="black")
    left.set_xlabel("episodes")
    right.plot([1.0, 10.0], [1.0, 2.0])
    right.set_xscale("log")
    return figure


def test_a_page_holds_its_parts_in_order():
    """Sections, tables and pictures come in the order in which they were added."""
    page = Report("a < b", "lead")
    page.facts([Fact("goals", "3 of 4", "[0.3, 0.9]")])
    page.section("one", "x & y")
    page.table([{"name": "r", "value": 0.12345}, {"name": "s", "value": None}])
    page.picture(b"PNG", 'a "caption"')
    with page.folded("more"):
        page.code("a < b")
    page.section("two")
    text = page.to_bytes().decode()
    parts = [
        "<h1>a &lt; b</h1>",
        "lead</p>",
        '<a href="#one">one</a>',
        "<dt>goals</dt><dd>3 of 4<small>[0.3, 0.9]</small></dd>",
        '<h2 id="one">one</h2><p>x &amp; y</p>',
        '<th class="t">name</th><th>value</th>',
        '<td class="t">r</td><td>0.12345</td>',
        f"data:image/png;base64,{b64encode(b'PNG').decode()}",
        "a &quot;caption&quot;</figcaption>",
        "<details><summary>more</summary><pre>a &lt; b</pre></details>",
        '<h2 id="two">two</h2>',
        "<script>",
    ]
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert text.startswith("<!doctype html>")


def test_a_page_needs_no_network():
    """Nothing refers to another place: no addresses, no files beside the page."""
    page = Report("a")
    page.figure(drawn(), "curves", "caption", drawn=True)
    page.figure(drawn(), "curves", "caption")
    page.picture(b"film", "caption", "mp4")
    text = page.to_bytes().decode()
    assert "http" not in text
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert sources
    assert all(source.startswith(("data:", "#")) for source in sources)


def test_keys_are_told_in_words_and_intervals_in_one_cell():
    """A chosen column has heading and unit; all others are folded."""
    row = {"controller": "gap", "success_rate": 0.5, "wilson_low": 0.25, "wilson_high": 0.75}
    page = Report("a")
    page.table([row | {"energy_j": 1234.0}], ("controller", "success_rate"), every="All columns")
    text = page.to_bytes().decode()
    table, folded = text.split("<details>")
    assert "<td>0.50 [0.25, 0.75]</td>" in table
    assert "energy" not in table
    assert "energy of the motors [kJ]</th>" in folded
    assert "<td>1.2</td>" in folded
    assert "wilson" not in text


def test_a_wide_table_is_told_in_several():
    """No table has more columns than fit; each part repeats the names."""
    row = {"controller": "gap"} | {f"n{k}": k for k in range(19)}
    page = Report("a")
    page.table([row])
    text = page.to_bytes().decode()
    heads = [re.findall(r"<th[^>]*>([^<]*)", head) for head in text.split("<table>")[1:]]
    assert [len(head) for head in heads] == [MOST_COLUMNS, MOST_COLUMNS, 6]
    assert [head[0] for head in heads] == ["controller"] * 3
    assert [name for head in heads for name in head[1:]] == [f"n{k}" for k in range(19)]


def test_an_empty_table_adds_nothing():
    """A table without rows leaves the page as it is."""
    page = Report("a")
    before = page.to_bytes()
    page.table([])
    assert page.to_bytes() == before


def test_a_drawn_figure_tells_its_axes_and_lines():
    """Linear axes are told with their box and lines; their ids are on the page."""
    page = Report("a")
    page.figure(drawn(), "Learning, seed 0", "caption", drawn=True)
    text = page.to_bytes().decode()
    (data,) = re.findall(r'data-axes="([^"]*)"', text)
    (axes,) = json.loads(data.replace("&quot;", '"'))
    assert (axes["xlabel"], axes["lines"][0]["label"]) == ("episodes", "seed 0")
    (line,) = axes["lines"]
    (d,) = re.findall(rf'id="{line["id"]}">\s*<path d="([^"]*)"', text)
    x, y = np.array(re.findall(r"-?[\d.]+", d), dtype=float).reshape(-1, 2).T
    left, top, right, bottom = axes["box"]
    shown = axes["x"][0] + (x - left) / (right - left) * np.ptp(axes["x"])
    np.testing.assert_allclose(shown, [0, 1, 2], atol=0.02)
    shown = axes["y"][1] - (y - top) / (bottom - top) * np.ptp(axes["y"])
    np.testing.assert_allclose(shown, [5, 7, 5], atol=0.02)
    assert "stroke: currentColor" in text
    assert "#000000" not in text.split("<svg")[1].split("</svg>")[0]


def test_a_map_keeps_its_own_colours():
    """What lies on light ground stays dark on a dark page."""
    page = Report("a")
    page.figure(drawn(), "map", "caption", drawn=True, light=True)
    text = page.to_bytes().decode()
    assert '<figure id="map" class="light"' in text
    assert "currentColor" not in text.split("<svg")[1].split("</svg>")[0]


def test_figures_are_written_as_png_and_svg_under_stable_names(tmp_path):
    """Each figure has two files; the same page writes the same bytes again."""
    files = []
    for folder in ("one", "two"):
        page = Report("a")
        page.figure(drawn(), "curves", "caption", drawn=True)
        page.figure(drawn(), "curves", "caption")
        (tmp_path / folder).mkdir()
        files.append(page.write_figures(tmp_path / folder))
    names = ["curves.png", "curves.svg", "curves-2.png", "curves-2.svg"]
    assert files[0] == [str(tmp_path / "one" / name) for name in names]
    for name in names:
        first, second = ((tmp_path / folder / name).read_bytes() for folder in ("one", "two"))
        assert first == second
    assert Image.open(io.BytesIO((tmp_path / "one/curves.png").read_bytes())).format == "PNG"
    assert b"<svg" in (tmp_path / "one/curves.svg").read_bytes()
