"""HTML page: self-contained, in order, with escaped text."""

from base64 import b64encode

from andabata.app.report import Report


def test_a_page_holds_its_parts_in_order():
    """Sections, tables and pictures come in the order in which they were added."""
    page = Report("a < b")
    page.section("one", "x & y")
    page.table([{"name": "r", "value": 0.12345}, {"name": "s", "value": None}])
    page.picture(b"PNG", 'a "caption"')
    page.section("two")
    text = page.to_bytes().decode()
    parts = [
        "<h1>a &lt; b</h1>",
        "<h2>one</h2><p>x &amp; y</p>",
        "<tr><th>name</th><th>value</th></tr>",
        "<tr><td>r</td><td>0.123</td></tr><tr><td>s</td><td>-</td></tr>",
        f"data:image/png;base64,{b64encode(b'PNG').decode()}",
        "a &quot;caption&quot;</figcaption>",
        "<h2>two</h2></body>",
    ]
    places = [text.index(part) for part in parts]
    assert places == sorted(places)
    assert text.startswith("<!doctype html>")
    assert "http" not in text


def test_an_empty_table_adds_nothing():
    """A table without rows leaves the page as it is."""
    page = Report("a")
    before = page.to_bytes()
    page.table([])
    assert page.to_bytes() == before
