"""Map and globe."""

import numpy as np
import pytest

from andabata.machine.geo_reference import GeoReference


def test_the_origin_is_the_origin():
    site = GeoReference()
    place = np.array([[site.latitude_deg, site.longitude_deg, site.altitude]])
    np.testing.assert_allclose(site.to_map(place), 0, atol=1e-9)


def test_known_distances_on_the_ellipsoid():
    """A degree at the equator is 111,319.49 m to the east, 110,574.28 m to the north (WGS-84)."""
    site = GeoReference(latitude_deg=0, longitude_deg=0, altitude=0)
    step = 1e-4
    east, north = site.to_map(np.array([[0, step, 0], [step, 0, 0]]))
    np.testing.assert_allclose(east, [11.131949, 0, 0], atol=1e-4)
    np.testing.assert_allclose(north, [0, 11.057428, 0], atol=1e-4)


@pytest.mark.parametrize("latitude", [-70.0, -36.7, 0.0, 45.0, 80.0])
def test_there_and_back(latitude):
    site = GeoReference(latitude_deg=latitude, longitude_deg=170.0, altitude=500.0)
    points = np.random.default_rng(0).uniform(-5000, 5000, (100, 3)) * [1, 1, 0.1]
    np.testing.assert_allclose(site.to_map(site.to_geodetic(points)), points, atol=1e-5)


def test_up_is_up_and_north_is_north():
    site = GeoReference()
    up, north = site.to_geodetic(np.array([[0, 0, 10.0], [0, 100.0, 0]]))
    assert up[2] == pytest.approx(site.altitude + 10.0, abs=1e-6)
    assert north[0] > site.latitude_deg
    assert north[1] == pytest.approx(site.longitude_deg, abs=1e-9)


def test_the_magnetic_field_points_north_and_down():
    site = GeoReference(declination_deg=10.0, inclination_deg=60.0, field=50.0)
    east, north, up = site.flux
    assert np.linalg.norm(site.flux) == pytest.approx(50.0)
    assert np.rad2deg(np.arctan2(east, north)) == pytest.approx(10.0)
    assert up == pytest.approx(-50 * np.sin(np.deg2rad(60)))
