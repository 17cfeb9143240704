"""Numbers and poses in the elements of a simulation description, checked with their line."""

import math

import numpy as np
from numpy.typing import NDArray

from worlds.sdf.elements import Element

Pose = NDArray[np.float64]
"""Matrix that takes coordinates of a frame to those of another, float64, shape (4, 4)."""

_MOST = 1e8
"""Largest number that is one: coordinates of whole countries have seven digits."""

_LEAST = 1e-6
"""Smallest length [m]."""

IDENTITY: Pose = np.eye(4)
IDENTITY.setflags(write=False)


def numbers(element: Element, count: int) -> tuple[float, ...]:
    """Return the numbers that an element holds.

    Args:
        element: Element.
        count: Number of numbers that it has to hold.

    Raises:
        SdfError: If they are not as many, or not all finite numbers up to 1e8.
    """
    try:
        values = tuple(map(float, element.text.split()))
    except ValueError:
        values = ()
    if len(values) != count or not all(map(math.isfinite, values)):
        text = " ".join(element.text.split())
        element.fail(f"expected {count} finite number{'s' * (count > 1)}, got {text!r}")
    if max(map(abs, values)) > _MOST:
        element.fail(f"expected numbers up to {_MOST:g}, got {max(values, key=abs):g}")
    return values


def lengths(element: Element, count: int) -> tuple[float, ...]:
    """Return the lengths that an element holds [m].

    Raises:
        SdfError: If they are not as many, or not all more than a micrometre.
    """
    values = numbers(element, count)
    if min(values) < _LEAST:
        element.fail(f"expected more than 0, got {element.text.strip()!r}")
    return values


def length(parent: Element, tag: str) -> float:
    """Return the length in a child [m].

    Raises:
        SdfError: If there is no such child, or it holds no positive number.
    """
    return lengths(parent.required(tag), 1)[0]


def is_true(element: Element | None) -> bool:
    """Return True if an element holds a true value; False if there is none."""
    return element is not None and element.text.strip().lower() in ("1", "true")


def pose_of(element: Element | None) -> Pose:
    """Return the pose that an element holds: x, y, z, then roll, pitch, yaw or a quaternion.

    Args:
        element: ``<pose>`` element, None for no pose. An empty one is the identity.

    Raises:
        SdfError: If it holds no pose.
    """
    if element is None or not element.text.strip():
        return IDENTITY
    form = element.attributes.get("rotation_format", "euler_rpy")
    if form == "quat_xyzw":
        x, y, z, *quaternion = numbers(element, 7)
        rotation = _from_quaternion(element, quaternion)
    elif form == "euler_rpy":
        x, y, z, *angles = numbers(element, 6)
        if element.attributes.get("degrees", "").lower() in ("1", "true"):
            angles = [math.radians(angle) for angle in angles]
        rotation = _from_angles(*angles)
    else:
        element.fail(f"expected rotation_format euler_rpy or quat_xyzw, got {form!r}")
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return np.array([[a, b, c, x], [d, e, f, y], [g, h, i, z], [0.0, 0.0, 0.0, 1.0]])


def inverse(pose: Pose) -> Pose:
    """Return the pose that undoes another."""
    inverted = np.eye(4)
    inverted[:3, :3] = pose[:3, :3].T
    inverted[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return inverted


_Rows = tuple[tuple[float, float, float], ...]


def _from_angles(roll: float, pitch: float, yaw: float) -> _Rows:
    """Return the rotation about fixed x, then y, then z [rad]."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def _from_quaternion(element: Element, quaternion: list[float]) -> _Rows:
    """Return the rotation of a quaternion x, y, z, w of any length but 0."""
    size = math.hypot(*quaternion)
    if size < 1e-9:
        element.fail("expected a quaternion x y z w, got one of length 0")
    x, y, z, w = (value / size for value in quaternion)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
