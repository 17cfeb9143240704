"""Numbers and poses in XML: known answers, and errors with their line."""

import math
from pathlib import Path

import numpy as np
import pytest

from worlds.sdf.elements import Element, SdfError
from worlds.sdf.values import IDENTITY, inverse, is_true, length, lengths, numbers, pose_of

ROOT = math.sqrt(0.5)


def element(text, **attributes):
    """Return an element on line 7."""
    return Element("pose", attributes, Path("a.world"), 7, text=text)


def test_numbers_are_those_of_the_text():
    """Any white space parts numbers, in any notation."""
    assert numbers(element(" 1\t-2.5\n3e2 "), 3) == (1.0, -2.5, 300.0)


@pytest.mark.parametrize("text", ["1 2", "1 2 3 4", "1 2 x", "1 nan 3", "1 inf 3", ""])
def test_what_are_no_numbers_is_refused(text):
    """Too few, too many, words, NaN and infinity: file, line, element, and what came."""
    with pytest.raises(
        SdfError, match=rf"a\.world:7: <pose>: expected 3 finite numbers, got '{text}'"
    ):
        numbers(element(text), 3)


def test_lengths_are_more_than_nothing():
    """0 and less are no lengths."""
    assert lengths(element("0.5 2"), 2) == (0.5, 2.0)
    for text in ("0", "-1"):
        with pytest.raises(SdfError, match=rf"more than 0, got '{text}'"):
            lengths(element(text), 1)
    with pytest.raises(SdfError, match="expected <radius> inside"):
        length(element(""), "radius")


def test_numbers_have_a_size_that_can_be_reckoned_with():
    """Nothing is a hundred thousand kilometres away, or thinner than a micrometre."""
    assert numbers(element("1e8 -1e8"), 2) == (1e8, -1e8)
    with pytest.raises(SdfError, match=r"expected numbers up to 1e\+08, got -1e\+308"):
        numbers(element("0 -1e308"), 2)
    with pytest.raises(SdfError, match="more than 0, got '1e-300'"):
        lengths(element("1e-300"), 1)


@pytest.mark.parametrize(
    ("text", "truth"), [("1", True), (" True ", True), ("0", False), ("", False)]
)
def test_truth_is_1_or_true(text, truth):
    """Capitals and spaces do not count; a missing element is no truth."""
    assert is_true(element(text)) is truth
    assert not is_true(None)


@pytest.mark.parametrize(
    ("text", "point"),
    [
        ("1 2 3 0 0 0", (2, 2, 3)),
        (f"0 0 0 0 0 {math.pi / 2}", (0, 1, 0)),
        (f"0 0 0 0 {math.pi / 2} 0", (0, 0, -1)),
        (f"0 0 0 {math.pi / 2} 0 0", (1, 0, 0)),
        # Roll about x first, then pitch about the fixed y, then yaw about the fixed z.
        (f"0 0 0 0 {math.pi / 4} {math.pi / 2}", (0, ROOT, -ROOT)),
    ],
)
def test_a_pose_takes_x_where_geometry_says(text, point):
    """The point one metre along x."""
    np.testing.assert_allclose((pose_of(element(text)) @ (1, 0, 0, 1))[:3], point, atol=1e-12)


def test_angles_are_applied_in_their_order():
    """Roll, pitch and yaw about the fixed axes, as three rotations one after the other."""
    angles = (0.3, -0.7, 1.9)
    alone = [
        pose_of(element(" ".join("0" if j - 3 != k else str(angles[k]) for j in range(6))))
        for k in range(3)
    ]
    together = pose_of(element("0 0 0 " + " ".join(map(str, angles))))
    np.testing.assert_allclose(together, alone[2] @ alone[1] @ alone[0], atol=1e-12)


def test_degrees_and_quaternions_are_the_same_rotations():
    """A quarter turn about z, three ways; the length of a quaternion does not count."""
    turned = pose_of(element(f"1 2 3 0 0 {math.pi / 2}"))
    for text, attributes in (
        ("1 2 3 0 0 90", {"degrees": "true"}),
        ("1 2 3 0 0 1 1", {"rotation_format": "quat_xyzw"}),
        ("1 2 3 0 0 90", {"degrees": "1", "rotation_format": "euler_rpy"}),
    ):
        np.testing.assert_allclose(pose_of(element(text, **attributes)), turned, atol=1e-12)


def test_quaternions_turn_about_each_axis_as_angles_do():
    """A tenth of a turn about x, y and z."""
    half = 0.1 * math.pi
    for k in range(3):
        quaternion = [math.sin(half) if j == k else 0.0 for j in range(3)] + [math.cos(half)]
        angles = [2 * half if j == k else 0.0 for j in range(3)]
        text = "0 0 0 " + " ".join(map(str, quaternion))
        np.testing.assert_allclose(
            pose_of(element(text, rotation_format="quat_xyzw")),
            pose_of(element("0 0 0 " + " ".join(map(str, angles)))),
            atol=1e-12,
        )


def test_no_pose_is_the_identity():
    """A missing or empty element."""
    assert pose_of(None) is IDENTITY
    assert pose_of(element(" \n")) is IDENTITY


@pytest.mark.parametrize(
    ("text", "attributes", "wrong"),
    [
        ("0 0 nan 0 0 0", {}, "6 finite numbers, got '0 0 nan 0 0 0'"),
        ("0 0 0", {}, "6 finite numbers"),
        ("0 0 0 0 0 0", {"rotation_format": "quat_xyzw"}, "7 finite numbers"),
        ("0 0 0 0 0 0 0", {"rotation_format": "quat_xyzw"}, "a quaternion"),
        (
            "0 0 0 0 0 0",
            {"rotation_format": "matrix"},
            "rotation_format euler_rpy or quat_xyzw, got 'matrix'",
        ),
    ],
)
def test_what_is_no_pose_is_refused(text, attributes, wrong):
    """The error names file, line and element."""
    with pytest.raises(SdfError, match=rf"a\.world:7: <pose>: expected {wrong}"):
        pose_of(element(text, **attributes))


def test_the_inverse_undoes_a_pose():
    """Both ways round."""
    pose = pose_of(element("1 -2 3 0.4 0.5 0.6"))
    np.testing.assert_allclose(inverse(pose) @ pose, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(pose @ inverse(pose), np.eye(4), atol=1e-12)
