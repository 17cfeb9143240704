"""Geodetic reference: known distances, inverse conversion, magnetic flux."""

import numpy as np
import pytest

from andabata.machine.geo_reference import GeoReference, wrapped_longitude


def test_the_origin_is_the_origin():
    """The datum itself has coordinates zero."""
    geo_reference = GeoReference()
    place = np.array(
        [[geo_reference.latitude_deg, geo_reference.longitude_deg, geo_reference.altitude]]
    )
    np.testing.assert_allclose(geo_reference.to_map(place), 0, atol=1e-9)


def test_known_distances_on_the_ellipsoid():
    """A degree at the equator is 111,319.49 m to the east, 110,574.28 m to the north (WGS-84)."""
    geo_reference = GeoReference(latitude_deg=0, longitude_deg=0, altitude=0)
    step = 1e-4
    east, north = geo_reference.to_map(np.array([[0, step, 0], [step, 0, 0]]))
    np.testing.assert_allclose(east, [11.131949, 0, 0], atol=1e-4)
    np.testing.assert_allclose(north, [0, 11.057428, 0], atol=1e-4)


@pytest.mark.parametrize("latitude", [-70.0, -36.7, 0.0, 45.0, 80.0])
def test_there_and_back(latitude):
    """Conversion to geodetic coordinates and back is the identity."""
    geo_reference = GeoReference(latitude_deg=latitude, longitude_deg=170.0, altitude=500.0)
    points = np.random.default_rng(0).uniform(-5000, 5000, (100, 3)) * [1, 1, 0.1]
    np.testing.assert_allclose(
        geo_reference.to_map(geo_reference.to_geodetic(points)), points, atol=1e-5
    )


def test_up_is_up_and_north_is_north():
    """Ten metres up add ten metres of altitude; north adds latitude alone."""
    geo_reference = GeoReference()
    up, north = geo_reference.to_geodetic(np.array([[0, 0, 10.0], [0, 100.0, 0]]))
    assert up[2] == pytest.approx(geo_reference.altitude + 10.0, abs=1e-6)
    assert north[0] > geo_reference.latitude_deg
    assert north[1] == pytest.approx(geo_reference.longitude_deg, abs=1e-9)


def test_the_magnetic_field_points_north_and_down():
    """Flux has the given strength, declination and inclination."""
    geo_reference = GeoReference(declination_deg=10.0, inclination_deg=60.0, field=50.0)
    east, north, up = geo_reference.flux
    assert np.linalg.norm(geo_reference.flux) == pytest.approx(50.0)
    assert np.rad2deg(np.arctan2(east, north)) == pytest.approx(10.0)
    assert up == pytest.approx(-50 * np.sin(np.deg2rad(60)))


def test_both_sides_of_the_antimeridian_are_near_each_other():
    """Longitudes on both sides of 180 degrees are neighbours."""
    reference = GeoReference(latitude_deg=-16.8, longitude_deg=179.9999, altitude=40.0)
    west, east = reference.to_map(np.array([[-16.8, 179.9998, 40.0], [-16.8, -179.9999, 40.0]]))
    assert west[0] == pytest.approx(-10.66, abs=0.01)
    assert east[0] == pytest.approx(21.32, abs=0.01)
    assert reference.distance(-16.8, -179.9999) == pytest.approx(21.32, abs=0.01)
    np.testing.assert_allclose(reference.to_map(np.array([[-16.8, 180.0001, 40.0]]))[0], east)


def test_a_millimetre_far_from_home_is_a_millimetre():
    """Nothing is rounded to float32 before it is relative."""
    reference = GeoReference(latitude_deg=43.47, longitude_deg=-80.54, altitude=330.0)
    points = np.array([[1000.0, 2000.0, 1.0], [1000.001, 2000.0, 1.0]])
    back = reference.to_map(reference.to_geodetic(points))
    assert back[1, 0] - back[0, 0] == pytest.approx(0.001, abs=1e-7)


@pytest.mark.parametrize(
    ("latitude", "longitude", "distance"),
    [(43.47, -80.54, 6308e3), (36.715, -3.478, 89.4e3), (36.7151, -4.478, 11.1)],
)
def test_distances_over_the_globe(latitude, longitude, distance):
    """Distances are those of the sphere within half a per cent."""
    assert GeoReference().distance(latitude, longitude) == pytest.approx(distance, rel=0.005)


def test_a_datum_near_a_pole_is_refused():
    """A latitude beyond 89 degrees is an error."""
    with pytest.raises(ValueError, match="less than or equal to 89"):
        GeoReference(latitude_deg=89.5)


def test_longitudes_from_0_to_360_are_understood():
    """Longitudes beyond 180 degrees are wrapped."""
    assert wrapped_longitude(279.46) == pytest.approx(-80.54)
    assert wrapped_longitude(-4.478) == -4.478
    assert wrapped_longitude(180.0) == 180.0


def test_a_place_is_the_same_alone_and_among_others():
    """To the bit, both ways: what comes with a fix does not move it."""
    reference = GeoReference()
    points = np.random.default_rng(3).uniform(-300, 300, (200, 3))
    geodetic = reference.to_geodetic(points)
    there = reference.to_map(geodetic)
    for k in range(len(points)):
        assert np.array_equal(reference.to_geodetic(points[k : k + 1])[0], geodetic[k])
        assert np.array_equal(reference.to_map(geodetic[k : k + 1])[0], there[k])
