"""Meshes for tests of imports: written to files, and looked into by open3d."""

from pathlib import Path
from typing import Any

import numpy as np

from worlds.sdf.meshes import Surface


def torus(outer: float = 1.0, inner: float = 0.3) -> Surface:
    """Return a ring about z: closed, and not convex."""
    import open3d

    return of(open3d.geometry.TriangleMesh.create_torus(outer, inner, 24, 12))


def block(*size: float) -> Surface:
    """Return a box about the origin."""
    import open3d

    mesh = open3d.geometry.TriangleMesh.create_box(*size)
    return of(mesh.translate(-np.array(size) / 2))


def angle_bar(long: float = 1.0, thick: float = 0.2, height: float = 1.0) -> Surface:
    """Return an upright bar with the section of an L, its corner at the origin: not convex."""
    corners = [(0, 0), (long, 0), (long, thick), (thick, thick), (thick, long), (0, long)]
    bottom = [(x, y, 0.0) for x, y in corners]
    vertices = np.array(bottom + [(x, y, height) for x, y, _ in bottom], dtype=float)
    floor = [(0, 2, 1), (0, 3, 2), (0, 4, 3), (0, 5, 4)]
    roof = [(a + 6, c + 6, b + 6) for a, b, c in floor]
    sides = []
    for k in range(6):
        n = (k + 1) % 6
        sides += [(k, n, n + 6), (k, n + 6, k + 6)]
    return Surface(vertices, np.array(floor + roof + sides))


def together(*surfaces: Surface) -> Surface:
    """Return several surfaces as one."""
    firsts = np.cumsum([0] + [len(each.vertices) for each in surfaces[:-1]])
    triangles = [each.triangles + first for each, first in zip(surfaces, firsts, strict=True)]
    return Surface(np.concatenate([each.vertices for each in surfaces]), np.concatenate(triangles))


def of(mesh: Any) -> Surface:
    """Return the surface of open3d's own mesh."""
    return Surface(np.asarray(mesh.vertices), np.asarray(mesh.triangles).astype(np.int64))


def legacy(surface: Surface) -> Any:
    """Return a surface as open3d's own mesh."""
    import open3d

    return open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(surface.vertices),
        open3d.utility.Vector3iVector(surface.triangles.astype(np.int32)),
    )


def save(path: Path, surface: Surface) -> Path:
    """Write a surface to a file of any kind that open3d writes."""
    import open3d

    mesh = legacy(surface)
    mesh.compute_triangle_normals()
    path.parent.mkdir(parents=True, exist_ok=True)
    assert open3d.io.write_triangle_mesh(str(path), mesh)
    return path


def scene(surface: Surface) -> Any:
    """Return a scene of open3d that holds a surface."""
    import open3d

    made = open3d.t.geometry.RaycastingScene(nthreads=1)
    made.add_triangles(open3d.t.geometry.TriangleMesh.from_legacy(legacy(surface)))
    return made


def ranges(surface: Surface, rays: np.ndarray) -> np.ndarray:
    """Return the distance along each ray to a surface [m], infinite without a hit."""
    import open3d

    tensor = open3d.core.Tensor.from_numpy(rays.astype(np.float32))
    return scene(surface).cast_rays(tensor, nthreads=1)["t_hit"].numpy()


def occupied(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Return True for points inside of a closed surface."""
    import open3d

    tensor = open3d.core.Tensor.from_numpy(points.astype(np.float32))
    return scene(surface).compute_occupancy(tensor, nthreads=1, nsamples=3).numpy() > 0.5
