"""Local frame: metres to the east and north of a place on Earth."""

import sys

import numpy as np
import pytest

from tests.support.elevation_models import EAST, NORTH, SCALE, UTM, needs_rasterio
from worlds.elevation.errors import MissingRasterioError
from worlds.elevation.local_frame import WGS_84, LocalFrame, crs_of

needs_rasterio()
FRAME = LocalFrame(45.0, 9.0)


def test_north_and_east_have_the_lengths_of_a_degree():
    """On the ellipsoid, at 45 degrees: 111,131.8 m of latitude and 78,846.8 m of longitude."""
    x, y = FRAME.of(WGS_84, np.array([9.0, 9.001]), np.array([45.001, 45.0]))
    assert y[0] == pytest.approx(111.1318, abs=1e-3)
    assert x[1] == pytest.approx(78.8468, abs=1e-3)
    assert [x[0], y[1]] == pytest.approx([0.0, 0.0], abs=1e-3)


def test_to_and_of_are_inverse():
    """In any shape."""
    x, y = np.meshgrid([-60.0, 0.0, 60.0], [-30.0, 90.0])
    back = FRAME.of(UTM, *FRAME.to(UTM, x, y))
    np.testing.assert_allclose(back, [x, y], atol=1e-5)


def test_on_a_central_meridian_a_projection_differs_by_its_scale():
    """Grid north is true north there."""
    longitude, latitude = LocalFrame(46.0, 9.0).to(UTM, np.array([0.0, 100.0]), np.zeros(2))
    assert longitude == pytest.approx([EAST, EAST + 100 * SCALE], abs=1e-3)
    assert abs(latitude[0] - NORTH) < 10_000


def test_what_a_projection_does_not_reach_is_infinite():
    """A quarter of the Earth from its central meridian it has no coordinates."""
    x, y = LocalFrame(0.0, 99.0).to(UTM, np.zeros((2, 3)), np.zeros((2, 3)))
    assert x.shape == y.shape == (2, 3)
    assert np.isinf([x, y]).all()


def test_an_unknown_system_is_refused(capfd):
    """Nothing but the error tells it."""
    with pytest.raises(ValueError, match="99999"):
        crs_of("EPSG:99999")
    assert capfd.readouterr() == ("", "")


def test_without_rasterio_the_extra_is_named(monkeypatch):
    """The error says what to install."""
    monkeypatch.setitem(sys.modules, "rasterio", None)
    with pytest.raises(MissingRasterioError, match="the extra `gis`"):
        crs_of(UTM)
