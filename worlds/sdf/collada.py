"""Collada files (``.dae``), the most frequent meshes of Gazebo's models, as Gazebo places them.

The nodes of the file's scene place geometries, in the ``<unit>`` of the file. Its ``<up_axis>`` is
ignored, as by Gazebo (gazebo-classic, issue 1305), whose models are made to stand upright without.
Materials, lights, cameras and animations are left out.

Source: Collada 1.4.1, Khronos Group 2008, chapter 5.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from worlds.sdf.collada_geometry import NO_CORNERS, Corners, Ids, triangles_of
from worlds.sdf.elements import Element, read_xml
from worlds.sdf.values import Pose, numbers

_OPAQUE = frozenset(
    (
        *("extra", "library_animation_clips", "library_animations", "library_cameras"),
        *("library_controllers", "library_effects", "library_images", "library_lights"),
        *("library_materials", "library_physics_models", "library_physics_scenes"),
    )
)
"""Elements that have no part in where triangles are."""

_MAX_DEPTH = 100
"""Largest number of nodes inside each other, those that refer to others included."""

_MAX_NODES = 10_000
"""Largest number of nodes of a scene: a few lines that refer to each other make millions."""


def read_collada(path: Path, most: int) -> Corners:
    """Return the corners of all triangles of a file's scene [m], shape (n, 3, 3).

    Args:
        path: File.
        most: Largest number of triangles that is read.

    Raises:
        SdfError: If it is no Collada, damaged, or too large, or holds meshes of kinds that are not
            read; the text names file, line and element.
        OSError: If it cannot be read.
    """
    root = read_xml(path, _OPAQUE)
    if root.tag != "COLLADA":
        root.fail("expected <COLLADA> as the outermost element")
    parts, count = [NO_CORNERS], 0
    for corners in _Scene(root).placed():
        count += len(corners)
        if count > most:
            root.fail(f"expected at most {most} triangles, got more; simplify the mesh")
        parts.append(corners)
    return np.concatenate(parts) * _metres(root)


class _Scene:
    """Nodes of a file's scene and the geometries that they place."""

    def __init__(self, root: Element) -> None:
        """Prepare for a file."""
        self._root, self._ids = root, Ids(root)
        self._known: dict[str, Corners] = {}
        self._nodes = 0

    def placed(self) -> Iterator[Corners]:
        """Yield the triangles of each geometry in the frame of the scene, in units of the file."""
        instance = self._root.required("scene").required("instance_visual_scene")
        for node in self._ids.named(instance, "url", "visual_scene").all("node"):
            yield from self._below(node, np.eye(4), 1)

    def _below(self, node: Element, around: Pose, depth: int) -> Iterator[Corners]:
        """Yield the triangles of a node, which stands in a frame, and of the nodes inside it."""
        self._nodes += 1
        if depth > _MAX_DEPTH or self._nodes > _MAX_NODES:
            node.fail(f"expected at most {_MAX_NODES} nodes, {_MAX_DEPTH} deep, got more")
        pose = around @ _pose(node)
        for child in node.children:
            match child.tag:
                case "node":
                    yield from self._below(child, pose, depth + 1)
                case "instance_node":
                    yield from self._below(self._ids.named(child, "url", "node"), pose, depth + 1)
                case "instance_geometry":
                    corners = self._geometry(child) @ pose[:3, :3].T + pose[:3, 3]
                    # A mirror image shows the back of its faces.
                    yield corners if np.linalg.det(pose[:3, :3]) > 0 else corners[:, ::-1]
                case "instance_controller":
                    child.fail("expected a mesh without bones; apply them before it is exported")

    def _geometry(self, instance: Element) -> Corners:
        """Return the triangles of a geometry, which is read once."""
        geometry = self._ids.named(instance, "url", "geometry")
        name = geometry.attributes["id"]
        if name not in self._known:
            self._known[name] = triangles_of(geometry, self._ids)
        return self._known[name]


def _metres(root: Element) -> float:
    """Return the length of a file's unit [m], 1 unless it says otherwise."""
    asset = root.child("asset")
    unit = None if asset is None else asset.child("unit")
    if unit is None or "meter" not in unit.attributes:
        return 1.0
    text = unit.attributes["meter"]
    try:
        metres = float(text)
    except ValueError:
        metres = math.nan
    if not 0 < metres < math.inf:
        unit.fail(f"expected a number of metres above 0, got {text!r}")
    return metres


def _pose(node: Element) -> Pose:
    """Return the transformation of a node, which may scale: the product of all its steps in order.

    Raises:
        SdfError: If a step is none of those that Gazebo takes, or badly formed.
    """
    pose = np.eye(4)
    for child in node.children:
        step = np.eye(4)
        match child.tag:
            case "matrix":
                step = np.reshape(numbers(child, 16), (4, 4))
                if step[3].tolist() != [0, 0, 0, 1]:
                    child.fail(f"expected 0 0 0 1 as the last row, got {step[3].tolist()}")
            case "translate":
                step[:3, 3] = numbers(child, 3)
            case "rotate":
                step[:3, :3] = _turn(child)
            case "scale":
                step[:3, :3] = np.diag(numbers(child, 3))
            case "lookat" | "skew":
                child.fail("expected <matrix>, <translate>, <rotate> or <scale>")
        pose = pose @ step
    return pose


def _turn(rotate: Element) -> Pose:
    """Return the rotation about an axis by an angle in degrees, shape (3, 3)."""
    *axis, degrees = numbers(rotate, 4)
    if (size := math.hypot(*axis)) < 1e-9:
        rotate.fail("expected an axis x y z and an angle, got an axis of length 0")
    x, y, z = (value / size for value in axis)
    across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = math.radians(degrees)
    # Rodrigues' formula.
    return np.eye(3) + math.sin(angle) * across + (1 - math.cos(angle)) * across @ across
