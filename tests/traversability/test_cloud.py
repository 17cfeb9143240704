"""Point clouds: what is found once of each."""

import numpy as np
import pytest

from traversability.cloud import PointCloud

POINTS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], dtype=np.float32)


def test_coordinates_lie_together_by_axis():
    """All x, then all y, then all z, in memory too."""
    xyz = PointCloud(POINTS, "odom").xyz
    assert xyz.tolist() == [[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]
    assert xyz.flags.c_contiguous


def test_the_newest_point_is_the_one_with_the_latest_stamp():
    """Points may be in any order."""
    assert PointCloud(POINTS, "odom", stamps=np.array([3.0, 2.0])).newest == 3.0


@pytest.mark.parametrize(
    "cloud",
    [PointCloud(POINTS, "odom"), PointCloud(POINTS[:0], "odom", stamps=np.empty(0))],
    ids=["without stamps", "without points"],
)
def test_without_stamped_points_none_is_the_newest(cloud):
    """The error names what is missing."""
    with pytest.raises(ValueError, match="stamps: expected points with stamps, got none"):
        _ = cloud.newest
