"""Meshes of collisions: read, checked, and taken apart where parts are convex."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from worlds.sdf.collada import read_collada
from worlds.sdf.elements import SdfError

FORMATS = (".stl", ".dae", ".obj", ".ply", ".off", ".gltf", ".glb")
"""Ends of the names of files that are read: Collada by ourselves, the others through open3d."""

_MAX_TRIANGLES = 200_000
"""Largest number of triangles of a mesh."""

_FLAT = 1e-6
"""Height of a vertex over the plane of a face up to which a part is convex, as a share of its
size."""

_MAX_PAIRS = 20_000_000
"""Number of pairs of faces and vertices above which a part is not tried for being convex."""


class Surface(NamedTuple):
    """Triangles.

    Attributes:
        vertices: Vertices [m], float64, shape (n, 3).
        triangles: Vertex indices, int64, shape (m, 3), counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]


def load_mesh(path: Path, where: str) -> Surface:
    """Return the triangles of a file that have an area, with one vertex at each place.

    Args:
        path: File.
        where: File, line and element that name it, for errors.

    Raises:
        SdfError: If it is of a kind that is not read, damaged, empty, or too large.
    """
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise SdfError(
            f"{where}: expected a mesh of a kind {', '.join(FORMATS)}, got {path}; convert it"
        )
    vertices, triangles = _collada(path, where) if suffix == ".dae" else _through_open3d(path)
    if not len(triangles) or not np.isfinite(vertices).all():
        raise SdfError(f"{where}: expected triangles in {path}, got none; is the file damaged?")
    if len(triangles) > _MAX_TRIANGLES:
        raise SdfError(
            f"{where}: expected at most {_MAX_TRIANGLES} triangles, got {len(triangles)} in "
            f"{path}; simplify the mesh"
        )
    vertices, same = np.unique(vertices, axis=0, return_inverse=True)
    return _with_area(Surface(vertices, same.reshape(-1)[triangles]))


def parts(surface: Surface) -> tuple[list[Surface], list[Surface]]:
    """Return the connected parts of a surface: those that are closed and convex, and the others.

    All are turned so that closed ones have their inside behind their faces.
    """
    convex: list[Surface] = []
    others: list[Surface] = []
    a, b, c = surface.triangles.T
    n = len(surface.vertices)
    links = coo_matrix((np.ones(2 * len(a)), (np.r_[a, b], np.r_[b, c])), shape=(n, n))
    _, labels = connected_components(links, directed=False)
    of_triangles = labels[a]
    for label in np.unique(of_triangles):
        used, triangles = np.unique(surface.triangles[of_triangles == label], return_inverse=True)
        part = Surface(surface.vertices[used], triangles.reshape(-1, 3))
        closed = is_closed(part.triangles)
        if closed and volume(part) < 0:
            part = part._replace(triangles=part.triangles[:, ::-1])
        (convex if closed and _is_convex(part) else others).append(part)
    return convex, others


def is_closed(triangles: NDArray[np.int64]) -> bool:
    """Return True if every edge of a triangle is one of exactly one other, the other way round."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there, counts = np.unique(edges, axis=0, return_counts=True)
    back = np.unique(edges[:, ::-1], axis=0)
    return bool((counts == 1).all()) and np.array_equal(there, back)


def volume(surface: Surface) -> float:
    """Return the volume of a closed surface [m3], negative if its faces look inwards."""
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def normals(surface: Surface) -> NDArray[np.float64]:
    """Return the outward direction of each triangle, as long as twice its area, shape (m, 3)."""
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _collada(path: Path, where: str) -> Surface:
    """Return the triangles of a Collada file, each with corners of its own."""
    try:
        corners = read_collada(path, _MAX_TRIANGLES)
    except SdfError as error:
        raise SdfError(f"{where}: {error}") from None
    return Surface(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def _through_open3d(path: Path) -> Surface:
    """Return the triangles of a file, none if it is damaged."""
    import open3d

    # open3d returns an empty mesh instead of an error, and prints why.
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        mesh = open3d.io.read_triangle_mesh(path)
    vertices = np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3)
    return Surface(vertices, np.asarray(mesh.triangles, dtype=np.int64).reshape(-1, 3))


def _with_area(surface: Surface) -> Surface:
    """Return a surface without the triangles that have no area."""
    kept = np.linalg.norm(normals(surface), axis=1) > 1e-12
    return surface._replace(triangles=surface.triangles[kept])


def _is_convex(part: Surface) -> bool:
    """Return True if no vertex of a closed part is above one of its faces."""
    if len(part.triangles) * len(part.vertices) > _MAX_PAIRS:
        return False
    across = normals(part)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    offsets = np.einsum("ij,ij->i", across, part.vertices[part.triangles[:, 0]])
    heights = part.vertices @ across.T - offsets
    return float(heights.max()) <= _FLAT * float(np.ptp(part.vertices, axis=0).max())
