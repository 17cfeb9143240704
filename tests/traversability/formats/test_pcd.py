"""PCD headers in any spelling, and the pose that they hold."""

import numpy as np
import pytest

from tests.support.pcd_files import pcd_file
from traversability.formats import pcd
from traversability.formats.error import FormatError

POINTS = np.random.default_rng(0).normal(size=(40, 3)).astype("<f4")


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize("spell", [str.upper, str.lower, str.title])
def test_capitals_and_small_letters_are_the_same(form, spell):
    """Keywords, types and the form of the data are read in any spelling."""
    columns = pcd.parse(pcd_file(POINTS, "1 2 3 1 0 0 0", form, spell))
    np.testing.assert_array_equal(np.column_stack([columns[name] for name in "xyz"]), POINTS)
    assert pcd.viewpoint(pcd_file(POINTS, "1 2 3 1 0 0 0", form, spell))[:3] == (1.0, 2.0, 3.0)


def test_the_first_versions_names_are_known():
    """COLUMNS are fields, and WIDTH times HEIGHT points need no POINTS."""
    data = pcd_file(POINTS).replace(b"FIELDS", b"COLUMNS").replace(b"POINTS 40\n", b"")
    data = data.replace(b"WIDTH 40", b"WIDTH 20").replace(b"HEIGHT 1", b"HEIGHT 2")
    np.testing.assert_array_equal(pcd.parse(data)["y"], POINTS[:, 1])


def test_a_header_without_a_form_is_refused():
    """A file whose line DATA is lost has no body that can be read."""
    with pytest.raises(FormatError, match=r"POINTS and DATA, got 'DATA'"):
        pcd.parse(pcd_file(POINTS).replace(b"\nDATA ", b"\nDATA\x9f"))


def test_the_quaternion_begins_with_w_and_gets_length_one():
    """The pose is position and quaternion w, x, y, z; none, or nothing but zeros, is no pose."""
    found = pcd.viewpoint(pcd_file(POINTS, "1 2 3 2 0 0 2"))
    assert found == pytest.approx((1, 2, 3, 0.5**0.5, 0, 0, 0.5**0.5))
    assert pcd.viewpoint(pcd_file(POINTS, None)) is None
    assert pcd.viewpoint(pcd_file(POINTS, "0 0 0 0 0 0 0")) is None


@pytest.mark.parametrize("words", ["1 2 3", "1 2 3 0 0 0 0", "1 nan 3 1 0 0 0", "a b c 1 0 0 0"])
def test_a_pose_that_is_none_is_refused(words):
    """Numbers that are missing, not finite or no rotation are errors with the next step."""
    with pytest.raises(FormatError, match=rf"VIEWPOINT: expected .* got {words}; write"):
        pcd.viewpoint(pcd_file(POINTS, words))


def test_a_pose_is_written_as_it_was_read():
    """The writer puts the pose into the header, by default that of the sensor's own frame."""
    columns = dict(zip("xyz", POINTS.T, strict=True))
    pose = (701362.5, 0.1, -2.0, 0.5, 0.5, -0.5, 0.5)
    assert pcd.viewpoint(pcd.render(columns, pose)) == pose
    assert b"\nVIEWPOINT 0 0 0 1 0 0 0\n" in pcd.render(columns)
