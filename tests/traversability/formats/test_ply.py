"""Comments of PLY files on the unit of their coordinates."""

import numpy as np
import pytest

from traversability.files import decode_cloud_file
from traversability.formats import ply

POINTS = np.random.default_rng(0).normal(size=(40, 3)).astype("<f4")


def ply_file(comment):
    """Return a PLY file with a line in its header."""
    data = ply.render(dict(zip("xyz", POINTS.T, strict=True)))
    return data.replace(b"element", comment.encode() + b"\nelement", 1)


@pytest.mark.parametrize(
    ("comment", "metres"),
    [
        ("comment units: mm", 0.001),
        ("comment Unit millimeters", 0.001),
        ("comment length_unit = cm", 0.01),
        ("obj_info units US survey feet", 1200 / 3937),
        ("comment coordinate unit: metre", 1.0),
    ],
)
def test_a_comment_names_the_unit(tmp_path, comment, metres):
    """The unit of a comment becomes metres, which is said; metres are not."""
    path = tmp_path / "cloud.ply"
    path.write_bytes(ply_file(comment))
    found = decode_cloud_file(path)
    np.testing.assert_allclose(found.cloud.points, metres * POINTS, rtol=1e-6)
    assert len(found.remarks) == (metres != 1.0)
    given = decode_cloud_file(path, unit=2.0)
    np.testing.assert_allclose(given.cloud.points, 2 * POINTS, rtol=1e-6)
    assert given.remarks == ()


@pytest.mark.parametrize("comment", ["comment united in mm", "comment units of love", "comment mm"])
def test_other_comments_name_none(comment):
    """A comment that is no statement on a known unit changes nothing."""
    assert ply.units(ply_file(comment)) == (None, ())
