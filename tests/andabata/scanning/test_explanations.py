"""Units and axes that put the ground where the mounting says are tried before they are advised."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.mounting import Mounting
from andabata.models import shipped_forest
from andabata.scanning.explanations import CloudOrigin, could_be_feet, explain, is_level_ground
from andabata.scanning.scan import ScanConfig, Scanned, scan_cloud
from tests.support.scanned_scenes import scene
from traversability.cloud import PointCloud

MOUNTED = ScanConfig(mounting=Mounting(x=0.2, y=-0.1))


def scanned(points, config=MOUNTED) -> Scanned:
    """Return the scan of points in the sensor's frame."""
    cloud = PointCloud(points.astype(np.float32), "sensor")
    return scan_cloud(cloud, config, shipped_forest())


def test_a_unit_is_only_guessed_where_none_is_named():
    """A file that names its unit, or a user who gives it, is not contradicted."""
    seen = scanned(scene() * 100)
    assert "centimetres" in explain(seen, MOUNTED, CloudOrigin())
    assert explain(seen, MOUNTED, CloudOrigin(is_metric=False)) is None


def test_feet_fit_a_sensor_that_would_be_high_up():
    """The ground under the sensor in feet is where the mounting says."""
    assert could_be_feet(scanned(scene() / 0.3048), MOUNTED, CloudOrigin())
    assert not could_be_feet(scanned(scene()), MOUNTED, CloudOrigin())
    assert not could_be_feet(scanned(scene() / 0.3048), MOUNTED, CloudOrigin(is_metric=False))


def test_a_mounting_keeps_the_place_and_adds_to_the_names_rotation():
    """The advised angles turn the axes of the message, of which the name's rotation is undone."""
    camera = Rotation.from_euler("xyz", (-90, 0, -90), degrees=True)
    seen = scanned(scene() * [1, -1, -1])
    assert "--mounting 0.2,-0.1,180,0,0)" in explain(seen, MOUNTED, CloudOrigin())
    text = explain(seen, MOUNTED, CloudOrigin(rotation=camera))
    angles = [float(word) for word in text.split("0.2,-0.1,")[1].rstrip(")").split(",")]
    whole = Rotation.from_euler("xyz", (180, 0, 0), degrees=True) * camera
    given = Rotation.from_euler("xyz", angles, degrees=True)
    assert (given.inv() * whole).magnitude() == pytest.approx(0, abs=1e-6)


def test_what_the_user_gave_is_not_explained_away():
    """A cloud that is levelled, or mounted with angles, gets no other axes."""
    turned = scene() * [1, -1, -1]
    for config in (ScanConfig(level=True), ScanConfig(mounting=Mounting(pitch=0.3))):
        assert explain(scanned(turned, config), config, CloudOrigin()) is None


def test_ground_is_level_within_bounds():
    """Ground within 20 cm and 12 degrees of the base plane agrees with a mounting."""
    ground = scene().astype(np.float32) + np.float32([0, 0, 0.72])
    assert is_level_ground(ground)
    assert not is_level_ground(ground + np.float32([0, 0, 0.3]))
    tilted = Rotation.from_euler("y", 15, degrees=True).apply(ground).astype(np.float32)
    assert not is_level_ground(tilted)
    assert not is_level_ground(ground[:3])
