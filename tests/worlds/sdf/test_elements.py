"""XML with lines: what is read, and every kind of file that is none."""

import gzip

import pytest

from worlds.sdf import elements
from worlds.sdf.elements import SdfError, read_xml

TEXT = '<sdf version="1.6">\n  <!-- one -->\n  <world name="w">\n    a<b/>c\n  </world>\n</sdf>\n'
BOMB = """<?xml version="1.0"?>
<!DOCTYPE sdf [
  <!ENTITY a "ha">
  <!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
]>
<sdf version="1.6"><world name="&b;"/></sdf>
"""
OUTSIDE = """<!DOCTYPE sdf [
<!ENTITY secret SYSTEM "file:///etc/passwd">
]>
<sdf version="1.6">&secret;</sdf>"""
PARAMETER = '<!DOCTYPE sdf [<!ENTITY % p SYSTEM "http://example.org/p.dtd"> %p;]><sdf/>'


def packed(data):
    """Return data as gzip packs it, without the time: names of tests must not depend on it."""
    return gzip.compress(data, mtime=0)


def read(folder, data, **options):
    """Return the root of a file with these bytes."""
    path = folder / "a.world"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return read_xml(path, **options)


def test_elements_know_their_place(tmp_path):
    """Tags, attributes, text, order and lines are those of the file."""
    root = read(tmp_path, TEXT)
    world = root.required("world")
    assert (root.tag, root.attributes, root.line) == ("sdf", {"version": "1.6"}, 1)
    assert (world.line, world.child("b").line) == (3, 4)
    assert "".join(world.text.split()) == "ac"
    assert world.where == f'{tmp_path / "a.world"}:3: <world name="w">'
    assert world.child("b").where.endswith("a.world:4: <b>")
    assert [each.tag for each in root.all("world")] == ["world"]
    assert root.child("model") is None


def test_a_packed_file_is_the_same(tmp_path):
    """Gzip is told by the bytes, not by the name."""
    assert read(tmp_path, gzip.compress(TEXT.encode())).required("world").line == 3


def test_predefined_and_numbered_characters_are_no_entities(tmp_path):
    """What XML itself stands for is read."""
    assert read(tmp_path, "<a>&lt;&#65;&amp;</a>").text == "<A&"


def test_names_are_without_the_namespace_of_the_document(tmp_path):
    """Names of other namespaces keep theirs."""
    root = read(tmp_path, '<a xmlns="http://x" xmlns:o="http://y"><b/><o:b/></a>')
    assert (root.tag, [each.tag for each in root.children]) == ("a", ["b", "http://y}b"])


def test_the_contents_of_opaque_elements_are_not_kept(tmp_path):
    """An opaque element stands alone, and what follows it is in its place."""
    root = read(tmp_path, "<a><v>x<w><v/></w></v>\n<c/></a>", opaque=frozenset({"v"}))
    assert [(each.tag, each.line, each.children, each.text) for each in root.children] == [
        ("v", 1, [], ""),
        ("c", 2, [], ""),
    ]


@pytest.mark.parametrize(
    ("data", "line", "element", "wrong"),
    [
        ("hello", 1, "document", "well-formed XML, got syntax error"),
        ("", 1, "document", "got no element found"),
        (b"\x00\x01", 1, "document", "well-formed XML"),
        ("<a>\n<b>\n</a>", 3, "b", "mismatched tag"),
        ("<a>\n<b></b>", 2, "a", "no element found"),
        ("<a/>\n<b/>", 2, "document", "junk after document element"),
        ("<a>\n<b x=1/></a>", 2, "a", "not well-formed"),
        ("<a>\n\n&none;</a>", 3, "a", "undefined entity"),
        ('<?xml version="1.0" encoding="klingon"?><a/>', 1, "document", "unknown encoding"),
        (BOMB, 3, "document", "no entities, got 'a'"),
        (OUTSIDE, 2, "document", "no entities, got 'secret'"),
        (PARAMETER, 1, "document", "no entities, got 'p'"),
        ("<a>" * 200, 1, "a", "at most 100 elements inside each other"),
        (packed(b"<a>\n<b>\n</a>"), 3, "b", "mismatched tag"),
    ],
)
def test_what_is_no_xml_is_refused_with_file_line_and_element(tmp_path, data, line, element, wrong):
    """The error names where reading ended, and inside of what; nothing is ever expanded."""
    with pytest.raises(SdfError) as error:
        read(tmp_path, data)
    assert str(error.value).startswith(f"{tmp_path / 'a.world'}:{line}: <{element}>: expected ")
    assert wrong in str(error.value)


@pytest.mark.parametrize(
    "data",
    [packed(TEXT.encode())[:-12], packed(TEXT.encode())[:20], b"\x1f\x8bxxxxxxxx"],
)
def test_a_damaged_gzip_file_is_refused(tmp_path, data):
    """What is cut off or no gzip after its first bytes is named."""
    with pytest.raises(SdfError, match=r"a\.world: expected a whole gzip file"):
        read(tmp_path, data)


def test_what_is_too_large_is_not_read_to_its_end(tmp_path, monkeypatch):
    """A limit holds for the bytes and for what they unpack to, and another for elements."""
    monkeypatch.setattr(elements, "_MAX_BYTES", 1000)
    for data in (b"<a>" + b" " * 1000 + b"</a>", gzip.compress(b"<a>" + b" " * 10**6 + b"</a>")):
        with pytest.raises(SdfError, match="at most 1000 bytes"):
            read(tmp_path, data)
    monkeypatch.setattr(elements, "_MAX_ELEMENTS", 10)
    assert len(read(tmp_path, "<a>" + "<b/>" * 9 + "</a>").children) == 9
    with pytest.raises(SdfError, match="at most 10 elements, got more"):
        read(tmp_path, "<a>" + "<b/>" * 10 + "</a>")


def test_a_required_element_that_is_missing_is_named(tmp_path):
    """The error is about the element that should hold it."""
    with pytest.raises(SdfError, match=r"a\.world:1: <a>: expected <b> inside, got none"):
        read(tmp_path, "<a/>").required("b")
