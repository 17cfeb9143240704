"""Small Collada files, written by the tests that read them."""

from pathlib import Path

import numpy as np

from tests.support.mesh_files import block
from worlds.sdf.meshes import Surface

NAMESPACE = "http://www.collada.org/2005/11/COLLADASchema"
INPUT = '<input semantic="VERTEX" source="#{name}-vertices" offset="{offset}"/>'


def words(values: object) -> str:
    """Return numbers as an element holds them."""
    return " ".join(f"{value:.17g}" for value in np.ravel(values))


def triangles(name: str, corners: object) -> str:
    """Return triangles of the vertices of a geometry, with an index of normals, which are not."""
    found = [(corner, 0) for corner in np.ravel(corners)]
    inputs = INPUT.format(name=name, offset=0) + '<input semantic="NORMAL" source="#n" offset="1"/>'
    return f'<triangles count="{len(found) // 3}">{inputs}<p>{words(found)}</p></triangles>'


def geometry(name: str, vertices: object, *primitives: str) -> str:
    """Return a geometry of vertices and primitives."""
    count = np.size(vertices) // 3
    accessor = f'<accessor source="#{name}-array" count="{count}" stride="3"/>'
    return f"""<geometry id="{name}"><mesh>
<source id="{name}-positions">
<float_array id="{name}-array" count="{3 * count}">{words(vertices)}</float_array>
<technique_common>{accessor}</technique_common>
</source>
<vertices id="{name}-vertices"><input semantic="POSITION" source="#{name}-positions"/></vertices>
{"".join(primitives)}
</mesh></geometry>"""


def of_surface(name: str, surface: Surface) -> str:
    """Return a surface as a geometry."""
    return geometry(name, surface.vertices, triangles(name, surface.triangles))


def node(*parts: str, name: str = "") -> str:
    """Return a node of some parts."""
    return f'<node id="{name}">{"".join(parts)}</node>'


def instance(name: str, kind: str = "geometry") -> str:
    """Return an instance of a geometry or node."""
    return f'<instance_{kind} url="#{name}"/>'


def document(
    geometries: str, nodes: str, asset: str = "", others: str = "", version: str = "1.4.1"
) -> str:
    """Return a file whose scene has some nodes."""
    return f"""<COLLADA xmlns="{NAMESPACE}" version="{version}">
<asset>{asset}</asset>
<library_effects><effect id="e"><extra>a<b/></extra></effect></library_effects>
<library_geometries>{geometries}</library_geometries>
{others}
<library_visual_scenes><visual_scene id="scene">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""


def write(path: Path, *texts: str, **options: str) -> Path:
    """Write a file whose scene has some nodes."""
    path.write_text(document(*texts, **options), encoding="utf-8")
    return path


def crate(path: Path, size: tuple[float, float, float]) -> Path:
    """Write a box about the origin, in inches, as two geometries that turned nodes put together.

    Args:
        path: File.
        size: Edges along x, y and z [m].
    """
    x, y, z = np.array(size) / 0.0254
    box = block(y, x, z)
    raised = np.add(box.vertices, (0, 0, 9))
    halves = zip("ab", np.split(box.triangles, 2), strict=True)
    made = [of_surface(name, Surface(raised, half)) for name, half in halves]
    back = "<translate>0 0 -9</translate><rotate>0 0 1 90</rotate>"
    nodes = node(back, instance("a")) + node(back, node(instance("b")))
    asset = '<unit name="inch" meter="0.0254"/><up_axis>Y_UP</up_axis>'
    return write(path, "".join(made), nodes, asset=asset)
