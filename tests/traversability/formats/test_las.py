"""LAS and LAZ: units of the coordinates by the file's own records."""

import numpy as np
import pytest

from tests.support.las_files import GEOGRAPHIC_WKT, geo_keys, las_file, projected_wkt, vertical_wkt
from traversability.files import CloudFileError, cloud_to_bytes, decode_cloud_file

pytest.importorskip("laspy")
US_FOOT = 1200 / 3937
POINTS = np.random.default_rng(0).uniform(-20, 20, (200, 3))
ORIGIN = np.array([2_000_100.0, 500_100.0, 300.0])
FEET = geo_keys((1024, 1), (3072, 2225), (3076, 9003), (4099, 9003))
MIXED = geo_keys((1024, 1), (3072, 2225), (3076, 9003), (4099, 9001))


def decoded(tmp_path, data, name="cloud.las", unit=None):
    """Return the cloud of a file's bytes."""
    path = tmp_path / name
    path.write_bytes(data)
    return decode_cloud_file(path, unit=unit)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    ("record", "up"),
    [
        ({"directory": FEET}, US_FOOT),
        ({"directory": MIXED}, 1.0),
        ({"text": projected_wkt()}, US_FOOT),
        ({"text": f'COMPD_CS["c",{projected_wkt()},{vertical_wkt()}]'}, 1.0),
        ({"text": projected_wkt(), "extended": True}, US_FOOT),
    ],
)
def test_feet_become_metres_and_that_is_said_once(tmp_path, record, up, packed):
    """Coordinates are in metres, whichever record names their unit."""
    scale = np.array([US_FOOT, US_FOOT, up])
    data = las_file(POINTS / scale + ORIGIN, packed=packed, **record)
    found = decoded(tmp_path, data, "cloud.laz" if packed else "cloud.las")
    np.testing.assert_allclose(found.cloud.coordinates(), POINTS + ORIGIN * scale, atol=2e-3)
    (note,) = found.remarks
    assert "in US survey feet (0.3048006 m)" in note
    np.testing.assert_allclose(found.spacing[0], 0.001 * scale)


def test_the_header_says_whether_text_or_keys_count(tmp_path):
    """A file with both is read by the one that its header names."""
    data = las_file(POINTS, FEET, text=projected_wkt("metre", "1"))
    assert decoded(tmp_path, data).units.metres == (1.0, 1.0)
    assert decoded(tmp_path, las_file(POINTS, FEET, text="")).units.horizontal.metres == US_FOOT


def test_metres_and_silence_need_no_words(tmp_path):
    """Files in metres, and those that name no unit, keep their coordinates."""
    for record in ({}, {"directory": geo_keys((1024, 1), (3072, 32633))}):
        found = decoded(tmp_path, las_file(POINTS + ORIGIN, **record))
        np.testing.assert_allclose(found.cloud.coordinates(), POINTS + ORIGIN, atol=2e-3)
        assert found.remarks == ()


@pytest.mark.parametrize(
    ("record", "text"),
    [
        ({"directory": geo_keys((1024, 2), (2048, 4326))}, "degrees"),
        ({"text": GEOGRAPHIC_WKT}, "degrees"),
        ({"directory": geo_keys((1024, 1), (3076, 9999))}, "--unit"),
        ({"text": "nonsense"}, "--unit"),
    ],
)
def test_what_is_no_clear_length_is_refused_unless_the_user_says_it(tmp_path, record, text):
    """Degrees and unknown units are refused; the length that the user gives overrides the file."""
    data = las_file(POINTS, **record)
    with pytest.raises(CloudFileError, match=text):
        decoded(tmp_path, data)
    found = decoded(tmp_path, data, unit=0.5)
    np.testing.assert_allclose(found.cloud.points, 0.5 * POINTS, atol=1e-3)
    assert found.remarks == ()


def test_a_converted_file_is_in_metres(tmp_path):
    """Written again, the coordinates are metres on the old grid, and nothing says feet."""
    found = decoded(tmp_path, las_file(POINTS / US_FOOT + ORIGIN, FEET))
    data = cloud_to_bytes(found.cloud, "las", found.others, found.spacing)
    again = decoded(tmp_path, data)
    coordinates = found.cloud.coordinates()
    np.testing.assert_allclose(again.cloud.coordinates(), coordinates, atol=5e-4)
    assert again.remarks == ()
