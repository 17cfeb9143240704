"""Geometries of Collada files: their triangles, and their polygons as triangles."""

from collections.abc import Iterator
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from worlds.sdf.elements import Element

Corners = NDArray[np.float64]
"""Corners of triangles, counter-clockwise seen from outside, float64, shape (n, 3, 3)."""

NO_CORNERS: Corners = np.empty((0, 3, 3))
NO_CORNERS.setflags(write=False)

_Number = TypeVar("_Number", np.float64, np.int64)

_NO_AREA = frozenset(("source", "vertices", "lines", "linestrips", "extra"))
"""Elements of a mesh that are no faces."""


class Ids:
    """Elements of a file by their ids, by which they refer to each other."""

    def __init__(self, root: Element) -> None:
        """Find all ids below an element."""
        self._elements = {
            each.attributes["id"]: each for each in _all(root) if "id" in each.attributes
        }

    def named(self, element: Element, attribute: str, tag: str) -> Element:
        """Return the element that an attribute names, as ``#id``.

        Args:
            element: Element with the attribute.
            attribute: Name of the attribute.
            tag: Kind that the named element has to be of.

        Raises:
            SdfError: If there is none of that kind.
        """
        text = element.attributes.get(attribute, "")
        target = self._elements.get(text.removeprefix("#"))
        if target is None or target.tag != tag:
            element.fail(f"expected {attribute} to name a <{tag}> of this file, got {text!r}")
        return target


def triangles_of(geometry: Element, ids: Ids) -> Corners:
    """Return the triangles of a geometry, in its own frame and the units of the file.

    Raises:
        SdfError: If it has no mesh, is of a kind that is not read, or contradicts itself.
    """
    children = geometry.required("mesh").children
    triangles = [_faces(each, ids) for each in children if each.tag not in _NO_AREA]
    return np.concatenate([NO_CORNERS, *triangles])


def _faces(primitive: Element, ids: Ids) -> Corners:
    """Return the triangles of ``<triangles>``, ``<polylist>`` or ``<polygons>``."""
    stride = 1 + max((_whole(each, "offset", "0") for each in primitive.all("input")), default=0)
    indices, counts = _polygons(primitive, stride)
    if not len(indices):
        return NO_CORNERS
    if counts.min(initial=0) < 0 or counts.sum() * stride != len(indices):
        wanted = f"{counts.sum()} corners of {stride} each"
        primitive.fail(f"expected as many indices as {wanted} need, got {len(indices)}")
    vertex = _input(primitive, "VERTEX")
    points = _positions(vertex, ids)
    of_corners = indices[_whole(vertex, "offset", "0") :: stride]
    low, high = of_corners.min(), of_corners.max()
    if low < 0 or high >= len(points):
        primitive.fail(f"expected indices of {len(points)} vertices, got {low} to {high}")
    return points[of_corners[_fans(counts)]]


def _polygons(primitive: Element, stride: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices of a primitive, and the number of corners of each of its polygons."""
    lists = [_numbers(each, np.int64) for each in primitive.all("p")]
    indices = np.concatenate([np.empty(0, np.int64), *lists])
    match primitive.tag:
        case "triangles":
            counts = np.full(len(indices) // (3 * stride), 3)
        case "polylist":
            counts = _numbers(primitive.required("vcount"), np.int64)
        case "polygons" if primitive.child("ph") is None:
            counts = np.array([len(each) // stride for each in lists], dtype=np.int64)
        case _:
            kinds = "<triangles>, <polylist> or <polygons> without holes"
            primitive.fail(f"expected {kinds}; triangulate the mesh before it is exported")
    return indices, counts


def _fans(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the triangles of polygons about their first corners, as Gazebo does, shape (n, 3).

    Args:
        counts: Number of corners of each polygon; the corners of all are numbered in a row.
    """
    pieces = np.maximum(counts - 2, 0)
    firsts = np.repeat(np.cumsum(counts) - counts, pieces)
    within = np.arange(pieces.sum()) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return np.stack([firsts, firsts + within + 1, firsts + within + 2], axis=1)


def _positions(vertex: Element, ids: Ids) -> NDArray[np.float64]:
    """Return the positions of the vertices that an ``<input>`` names, shape (n, 3)."""
    position = _input(ids.named(vertex, "source", "vertices"), "POSITION")
    source = ids.named(position, "source", "source")
    accessor = source.required("technique_common").required("accessor")
    values = _numbers(ids.named(accessor, "source", "float_array"), np.float64)
    count, stride = _whole(accessor, "count"), _whole(accessor, "stride", "1")
    first = _whole(accessor, "offset", "0")
    if stride < 3 or first + count * stride > len(values):
        accessor.fail(
            f"expected {count} positions of 3 numbers or more, got {len(values)} numbers, those "
            f"from {first} on with the stride {stride}"
        )
    return values[first : first + count * stride].reshape(count, stride)[:, :3]


def _input(parent: Element, semantic: str) -> Element:
    """Return the first ``<input>`` of a semantic."""
    for each in parent.all("input"):
        if each.attributes.get("semantic") == semantic:
            return each
    return parent.fail(f"expected an <input> with the semantic {semantic}, got none")


def _whole(element: Element, name: str, default: str = "") -> int:
    """Return an attribute that is a whole number from 0 on, required unless it has a default."""
    text = element.attributes.get(name, default)
    if not text.isdecimal() or len(text) > 9:
        element.fail(f"expected a whole number as {name}, got {text!r}")
    return int(text)


def _numbers(element: Element, kind: type[_Number]) -> NDArray[_Number]:
    """Return the finite numbers that an element holds."""
    try:
        numbers = np.array(element.text.split(), dtype=kind)
    except (ValueError, OverflowError) as error:
        element.fail(f"expected numbers, got others: {error}")
    if not np.isfinite(numbers).all():
        element.fail("expected finite numbers, got others")
    return numbers


def _all(element: Element) -> Iterator[Element]:
    """Yield an element and all below it."""
    yield element
    for child in element.children:
        yield from _all(child)
