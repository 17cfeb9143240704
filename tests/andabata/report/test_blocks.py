"""Blocks of a page: escaped text, words for keys, wide tables in parts, drawn figures."""

import json
import re
from base64 import b64encode

import numpy as np
import pytest
from matplotlib.figure import Figure

from andabata.report.blocks import (
    MOST_COLUMNS,
    Code,
    Folded,
    Picture,
    Plot,
    Shown,
    Table,
    Text,
    plain,
)


def drawn():
    """Return a figure of two axes with a line each."""
    figure = Figure(figsize=(4, 2), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot([0.0, 1.0, 2.0], [5.0, 7.0, 5.0], label="seed 0", color="black")
    left.set_xlabel("episodes")
    right.plot([1.0, 10.0], [1.0, 2.0])
    right.set_xscale("log")
    return figure


def text_of(block):
    """Return a block's HTML."""
    return block.to_html(Shown())


@pytest.mark.parametrize(
    ("block", "text"),
    [
        (Text("x & y"), "<p>x &amp; y</p>"),
        (Code("a < b"), "<pre>a &lt; b</pre>"),
        (
            Folded("a < b", [Text("one"), Text("two")]),
            "<details><summary>a &lt; b</summary><p>one</p><p>two</p></details>",
        ),
        (
            Folded("a", [Text("one"), Text("two")], is_grid=True),
            '<details><summary>a</summary><div class="grid"><p>one</p><p>two</p></div></details>',
        ),
    ],
)
def test_texts_are_escaped_and_stand_in_order(block, text):
    """What a run says is no markup."""
    assert text_of(block) == text


def test_a_picture_holds_its_bytes_and_caption():
    """A film has controls; both need no other file."""
    inside = f"data:image/png;base64,{b64encode(b'PNG').decode()}"
    text = text_of(Picture(b"PNG", 'a "caption"'))
    assert f'src="{inside}"' in text
    assert "a &quot;caption&quot;</figcaption>" in text
    assert "<video controls" in text_of(Picture(b"film", "caption", "mp4"))


def test_figures_and_films_are_known_under_names_of_their_own():
    """A second figure of a name gets a number; a film is named after its kind."""
    shown = Shown()
    for _ in range(3):
        Plot(drawn(), "Paths, seed 0", "caption").to_html(shown)
    Picture(b"GIF", "caption", "gif", "a film").to_html(shown)
    Picture(b"PNG", "caption").to_html(shown)
    assert list(shown.figures) == ["paths-seed-0", "paths-seed-0-2", "paths-seed-0-3"]
    assert shown.films == {"a-film.gif": b"GIF"}
    assert (plain("Table I: K = 2"), plain("!")) == ("table-i-k-2", "part")


def test_names_stand_left_and_numbers_right():
    """A value that is missing is a dash."""
    text = text_of(Table([{"name": "r", "value": 0.12345}, {"name": "s", "value": None}]))
    assert '<th class="t">name</th><th>value</th>' in text
    assert '<td class="t">r</td><td>0.12345</td>' in text
    assert '<td class="t">s</td><td>–</td>' in text


def test_keys_are_told_in_words_and_intervals_in_one_cell():
    """A chosen column has heading and unit; all others are folded."""
    row = {"controller": "gap", "success_rate": 0.5, "wilson_low": 0.25, "wilson_high": 0.75}
    columns = ("controller", "success_rate")
    text = text_of(Table([row | {"energy_j": 1234.0}], columns, "of < all", "All columns"))
    table, folded = text.split("<details>")
    assert "<caption>of &lt; all</caption>" in table
    assert "<td>0.50 [0.25, 0.75]</td>" in table
    assert "energy" not in table
    assert "energy of the motors [kJ]</th>" in folded
    assert "<td>1.2</td>" in folded
    assert "wilson" not in text
    assert "<details>" not in text_of(Table([row], columns, every="All columns"))


def test_a_wide_table_is_told_in_several():
    """No table has more columns than fit; each part repeats the names."""
    row = {"controller": "gap"} | {f"n{k}": k for k in range(19)}
    heads = [
        re.findall(r"<th[^>]*>([^<]*)", head) for head in text_of(Table([row])).split("<table>")[1:]
    ]
    assert [len(head) for head in heads] == [MOST_COLUMNS, MOST_COLUMNS, 6]
    assert [head[0] for head in heads] == ["controller"] * 3
    assert [name for head in heads for name in head[1:]] == [f"n{k}" for k in range(19)]


def test_chosen_columns_stand_side_by_side_however_many_there_are():
    """Nine chosen ones are one table; keys that the rows lack are left out."""
    row = {f"n{k}": k for k in range(MOST_COLUMNS + 1)}
    text = text_of(Table([row], (*row, "missing")))
    assert text.count("<table>") == 1
    assert text.count("<th>") == MOST_COLUMNS + 1


def test_three_columns_of_names_are_repeated():
    """A fourth one stands with the other columns."""
    row = {f"name{k}": "x" for k in range(4)} | {f"n{k}": k for k in range(8)}
    heads = text_of(Table([row])).split("<table>")[1:]
    assert [sum(f"name{k}<" in head for head in heads) for k in range(4)] == [2, 2, 2, 1]


def test_texts_of_a_table_are_escaped_and_long_ones_stand_left():
    """A long text is wrapped, although it begins as a number does."""
    text = text_of(Table([{"a<b": "x & y", "value": "1 of 2 [" + "0, " * 20 + "]"}]))
    assert '<th class="t">a&lt;b</th><th class="t">value</th>' in text
    assert '<td class="t">x &amp; y</td><td class="t">1 of 2' in text


def test_an_empty_table_is_nothing():
    """A table without rows leaves the page as it is."""
    assert text_of(Table([], ("a",), "caption", "All columns")) == ""


def test_a_drawn_figure_tells_its_axes_and_lines():
    """Linear axes are told with their box and lines; their ids are on the page."""
    text = text_of(Plot(drawn(), "Learning, seed 0", "caption", drawn=True))
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
    assert 'style="max-width:400px"' in text


def test_a_map_keeps_its_own_colours():
    """What lies on light ground stays dark on a dark page."""
    text = text_of(Plot(drawn(), "map", "caption", drawn=True, light=True))
    assert '<figure id="map" class="light"' in text
    assert "currentColor" not in text.split("<svg")[1].split("</svg>")[0]
