"""Shapes of collisions in SDF."""

from dataclasses import dataclass, replace
from pathlib import Path

from worlds.sdf.elements import Element
from worlds.sdf.files import ModelFolders
from worlds.sdf.notes import Notes
from worlds.sdf.values import length, lengths, numbers

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """Box about its centre.

    Attributes:
        size: Edges along x, y and z [m].
    """

    size: Vector


@dataclass(frozen=True)
class Cylinder:
    """Cylinder about its centre, its axis along z.

    Attributes:
        radius: Radius [m].
        length: Length [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class Capsule:
    """Cylinder with a half sphere on both ends, its axis along z.

    Attributes:
        radius: Radius [m].
        length: Length of the cylinder alone [m].
    """

    radius: float
    length: float


@dataclass(frozen=True)
class Sphere:
    """Sphere about its centre.

    Attributes:
        radius: Radius [m].
    """

    radius: float


@dataclass(frozen=True)
class Ellipsoid:
    """Ellipsoid about its centre.

    Attributes:
        radii: Half-axes along x, y and z [m].
    """

    radii: Vector


@dataclass(frozen=True)
class Plane:
    """Plane through the origin; what lies behind it is solid.

    Attributes:
        normal: Direction in which it faces, of any length.
        size: Extent of what is drawn [m]; a plane that collides has no end.
    """

    normal: Vector
    size: tuple[float, float]


@dataclass(frozen=True)
class Polyline:
    """Upright solid between z = 0 and its height; outlines inside others are holes.

    Attributes:
        outlines: Corners of each outline [m].
        height: Height [m].
    """

    outlines: tuple[tuple[tuple[float, float], ...], ...]
    height: float


@dataclass(frozen=True)
class Mesh:
    """Triangles in a file.

    Attributes:
        path: File.
        scale: Factors along x, y and z.
    """

    path: Path
    scale: Vector


@dataclass(frozen=True)
class Heightmap:
    """Ground from an image, whose first row is that of the largest y.

    Attributes:
        path: Image.
        size: Extent along x and y, and height of the image's brightest place over black [m].
        position: Middle of the ground, at the height of black [m].
    """

    path: Path
    size: Vector
    position: Vector


Shape = Box | Cylinder | Capsule | Sphere | Ellipsoid | Plane | Polyline | Mesh | Heightmap
"""Any shape."""

_IGNORED = frozenset({"image", "cone"})
"""Shapes of SDF that are left out."""


def read_shape(geometry: Element, folders: ModelFolders, notes: Notes) -> Shape | None:
    """Return the shape of a ``<geometry>``; None for one that is empty or left out with a warning.

    Args:
        geometry: Element.
        folders: Folders in which meshes and images lie.
        notes: Warnings, to which this adds.

    Raises:
        SdfError: If there is no shape, one that SDF does not know, or one with a bad measure.
    """
    if not geometry.children:
        geometry.fail("expected a shape inside, got none")
    element = geometry.children[0]
    if element.tag == "polyline":
        return _polyline(geometry)
    if len(geometry.children) > 1:
        notes.add("a collision has one shape: those after it were left out", geometry.children[1])
    match element.tag:
        case "box":
            x, y, z = lengths(element.required("size"), 3)
            return Box((x, y, z))
        case "cylinder":
            return Cylinder(length(element, "radius"), length(element, "length"))
        case "capsule":
            return Capsule(length(element, "radius"), length(element, "length"))
        case "sphere":
            return Sphere(length(element, "radius"))
        case "ellipsoid":
            x, y, z = lengths(element.required("radii"), 3)
            return Ellipsoid((x, y, z))
        case "plane":
            return _plane(element)
        case "mesh":
            return _mesh(element, folders, notes)
        case "heightmap":
            return _heightmap(element, folders)
        case "empty":
            return None
        case tag if tag in _IGNORED:
            notes.add(f"shapes of the kind {tag} are left out", element)
            return None
    return geometry.fail(
        "expected a box, cylinder, capsule, sphere, ellipsoid, plane, polyline, mesh or heightmap, "
        f"got <{element.tag}> on line {element.line}"
    )


def scaled(shape: Shape, scale: Vector) -> Shape:
    """Return a shape with the scale of a ``<state>``, which comes on top of its own measures.

    Cylinders and spheres stay what they are: the larger of their scales counts.
    """
    x, y, z = scale
    match shape:
        case Box():
            a, b, c = shape.size
            return Box((a * x, b * y, c * z))
        case Cylinder() | Capsule():
            return replace(shape, radius=shape.radius * max(x, y), length=shape.length * z)
        case Sphere():
            return Sphere(shape.radius * max(scale))
        case Ellipsoid():
            a, b, c = shape.radii
            return Ellipsoid((a * x, b * y, c * z))
        case Polyline():
            outlines = tuple(tuple((u * x, v * y) for u, v in each) for each in shape.outlines)
            return Polyline(outlines, shape.height * z)
        case Mesh():
            a, b, c = shape.scale
            return Mesh(shape.path, (a * x, b * y, c * z))
        case Plane() | Heightmap():
            return shape


def _plane(element: Element) -> Plane:
    """Return a plane; it faces up unless it says otherwise."""
    normal, size = element.child("normal"), element.child("size")
    x, y, z = (0.0, 0.0, 1.0) if normal is None else numbers(normal, 3)
    if normal is not None and x * x + y * y + z * z < 1e-12:
        normal.fail("expected a direction, got one of length 0")
    a, b = (1.0, 1.0) if size is None else lengths(size, 2)
    return Plane((x, y, z), (a, b))


def _polyline(geometry: Element) -> Polyline:
    """Return the solid of all polylines of a geometry."""
    outlines, heights = [], []
    for element in geometry.all("polyline"):
        points = [numbers(point, 2) for point in element.all("point")]
        outline = [(x, y) for x, y in points]
        if outline and outline[0] == outline[-1]:
            outline.pop()  # Some close the outline themselves.
        if len(set(outline)) < 3:
            element.fail(f"expected 3 points or more, got {len(set(outline))}")
        outlines.append(tuple(outline))
        heights.append(length(element, "height"))
    return Polyline(tuple(outlines), max(heights))


def _mesh(element: Element, folders: ModelFolders, notes: Notes) -> Mesh | None:
    """Return a mesh; None if its file is not there and may be missing."""
    path = folders.file(element.required("uri"))
    if path is None:
        return None
    scale = element.child("scale")
    x, y, z = (1.0, 1.0, 1.0) if scale is None else numbers(scale, 3)
    if scale is not None and min(map(abs, (x, y, z))) < 1e-9:
        scale.fail(f"expected factors other than 0, got {scale.text.strip()!r}")
    if (part := element.child("submesh")) is not None:
        notes.add("one part of a mesh is asked for: the whole mesh was taken", part)
    return Mesh(path, (x, y, z))


def _heightmap(element: Element, folders: ModelFolders) -> Heightmap | None:
    """Return a heightmap; None if its file is not there and may be missing."""
    path = folders.file(element.required("uri"))
    if path is None:
        return None
    size, position = element.child("size"), element.child("pos")
    a, b, c = (1.0, 1.0, 1.0) if size is None else lengths(size, 3)
    x, y, z = (0.0, 0.0, 0.0) if position is None else numbers(position, 3)
    return Heightmap(path, (a, b, c), (x, y, z))
