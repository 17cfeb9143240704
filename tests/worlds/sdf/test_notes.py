"""Warnings of an import: counted by kind, with the first of each."""

from pathlib import Path

import pytest

from worlds.sdf.elements import Element
from worlds.sdf.notes import Notes


def element(tag, line=1, name=None):
    return Element(tag, {} if name is None else {"name": name}, Path("a.world"), line)


def test_warnings_of_a_kind_are_one_line_with_the_first_and_the_number():
    """In the order in which they first came; one alone has no number."""
    notes = Notes()
    notes.add("mesh taken for its box", element("mesh", 7, "tree"))
    notes.add("no shape", element("link", 9))
    notes.add("mesh taken for its box", element("mesh", 12))
    assert notes.lines == (
        'a.world:7: <mesh name="tree">: mesh taken for its box (2 of them)',
        "a.world:9: <link>: no shape",
    )
    assert Notes().lines == ()


@pytest.mark.parametrize(
    ("tag", "parent", "text"),
    [
        ("light", "world", "light left out"),
        ("sensor", "link", "sensor left out"),
        ("teapot", "world", "unknown element <teapot> left out"),
        ("collision", "model", "unknown element <collision> left out"),
        ("pose", "nothing", "unknown element <pose> left out"),
        ("pose", "model", None),
        ("visual", "link", None),
        ("geometry", "collision", None),
    ],
)
def test_what_is_not_read_is_said(tag, parent, text):
    """An element counts by what it is in: a shape outside of a link is none."""
    notes = Notes()
    notes.check(element(tag, 3), parent)
    assert notes.lines == (() if text is None else (f"a.world:3: <{tag}>: {text}",))
