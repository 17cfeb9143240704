"""Clouds are scanned from where the file says the sensor was."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.las_files import geo_keys, las_file
from tests.support.pcd_files import IDENTITY, pcd_file
from tests.support.scanned_scenes import advised, is_right, scan, scene, unpainted

VIEWPOINT = "5 3 0.72 0.70710678 0 0 0.70710678"


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """Draw nothing."""
    unpainted(monkeypatch)


def seen(turn=90.0, place=(5.0, 3.0, 0.72)):
    """Return a scene in a map where the sensor stands elsewhere and looks north."""
    return Rotation.from_euler("z", turn, degrees=True).apply(scene()) + np.array(place)


@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
def test_viewpoint_is_the_sensor(capsys, tmp_path, form):
    """The ranges are those of the scene, ahead of where the sensor looked; it is said once."""
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd_file(seen()[::2], VIEWPOINT, form))
    result = scan(capsys, path)
    (note,) = result["notes"]
    assert note.startswith("points are taken from VIEWPOINT: the sensor at 5,3,0.72, turned by 90")
    assert "--level" not in note
    assert is_right(result)


def test_the_position_that_the_user_gives_overrides_viewpoint(capsys, tmp_path):
    """``--sensor-at`` is the position in the file's coordinates, whose axes then count."""
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd_file(seen(turn=0.0), VIEWPOINT))
    result = scan(capsys, path, "--sensor-at", "5,3,0.72")
    assert result["notes"] == []
    assert is_right(result)


def test_points_in_the_sensors_own_frame_stay_there(capsys, tmp_path):
    """Some programs write the sensor's pose beside points in its own frame: seen and said."""
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd_file(scene(), VIEWPOINT))
    result = scan(capsys, path)
    (note,) = result["notes"]
    assert note.startswith("VIEWPOINT 5,3,0.72 is not among the points")
    assert is_right(result)
    near = "0.1 0 0.72 0.70710678 0 0 0.70710678"
    path.write_bytes(pcd_file(scene(), near))  # Too near to be told apart.
    note = scan(capsys, path)["notes"][0]
    assert is_right(scan(capsys, path, *advised(note, "--sensor-at")))


def test_no_viewpoint_changes_nothing(capsys, tmp_path):
    """Identity, zeros and no such line are the sensor's own frame."""
    path = tmp_path / "cloud.pcd"
    found = []
    for viewpoint in (IDENTITY, "0 0 0 0 0 0 0", None):
        path.write_bytes(pcd_file(scene(), viewpoint))
        found.append(scan(capsys, path))
    assert found[0] == found[1] == found[2]
    assert found[0]["notes"] == []
    assert is_right(found[0])


def test_a_viewpoint_under_the_ground_is_doubted(capsys, tmp_path):
    """The option that overrides it is named, not one that would hide the fault."""
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd_file(seen(turn=0.0), "5 3 -30 1 0 0 0"))
    note = scan(capsys, path)["notes"][-1]
    assert "is VIEWPOINT where the sensor was? (--sensor-at X,Y,Z overrides it)" in note
    assert is_right(scan(capsys, path, "--sensor-at", "5,3,0.72"))


@pytest.mark.parametrize("packed", [False, True])
def test_a_position_counts_in_the_files_own_unit(capsys, tmp_path, packed):
    """A LAS file in feet has ranges in metres, and ``--sensor-at`` is in feet."""
    pytest.importorskip("laspy")
    keys = geo_keys((1024, 1), (3072, 2225), (3076, 9003), (4099, 9001))
    foot, here = 1200 / 3937, np.array([2_000_100.0, 500_100.0, 300.0])
    path = tmp_path / f"cloud.{'laz' if packed else 'las'}"
    path.write_bytes(las_file(scene() / [foot, foot, 1.0] + here, keys, packed=packed))
    result = scan(capsys, path, "--sensor-at", "2000100,500100,300")
    assert len(result["notes"]) == 1
    assert is_right(result)
    low = scan(capsys, path, "--sensor-at", "2000100,500100,250")
    step = advised(low["notes"][-1], "--sensor-at")
    assert is_right(scan(capsys, path, *step))
