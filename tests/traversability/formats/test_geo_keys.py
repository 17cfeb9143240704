"""GeoKeys of GeoTIFF, as LAS 1.0 to 1.3 has them: units by code, by system, or refused."""

import struct

import pytest

from tests.support.las_files import geo_keys
from traversability.formats.error import FormatError
from traversability.formats.geo_keys import units_of_geo_keys
from traversability.formats.length_units import UnknownUnitError

US_FOOT, FOOT = 1200 / 3937, 0.3048


@pytest.mark.parametrize(
    ("keys", "across", "up"),
    [
        (((1024, 1), (3072, 2225), (3076, 9003), (4099, 9003)), US_FOOT, US_FOOT),
        (((1024, 1), (3072, 2225), (3076, 9003), (4099, 9001)), US_FOOT, 1.0),
        (((1024, 1), (3072, 2225), (4096, 5703)), US_FOOT, 1.0),
        (((1024, 1), (3072, 2225), (4096, 6360)), US_FOOT, US_FOOT),
        (((1024, 1), (3072, 2222)), FOOT, FOOT),
        (((3076, 9002),), FOOT, FOOT),
        (((1024, 1), (3072, 2225), (3076, 9002)), FOOT, FOOT),
        (((1024, 1), (3072, 32633), (3076, 9002)), FOOT, FOOT),
        (((1024, 1), (3072, 32633), (2048, 4326), (3076, 9001)), 1.0, 1.0),
        (((3072, 32633), (2048, 4326)), 1.0, 1.0),
        (((1024, 1), (3072, 32633), (4096, 8228)), 1.0, FOOT),
        (((1024, 1), (3072, 32767), (3076, 9036)), 1000.0, 1000.0),
        (((1024, 1), (3072, 32767)), 1.0, 1.0),
    ],
)
def test_units_are_those_of_the_keys(keys, across, up):
    """A unit is named by its own key, else by the code of its system; z is like x without one."""
    assert units_of_geo_keys(geo_keys(*keys)).metres == pytest.approx((across, up), rel=1e-12)


def test_a_unit_of_the_users_own_is_a_double():
    """The length of a user-defined unit stands among the doubles."""
    directory = geo_keys((1024, 1), (3076, 32767), (3077, 34736, 1, 1))
    doubles = struct.pack("<2d", 7.0, 0.25)
    assert units_of_geo_keys(directory, doubles).metres == (0.25, 0.25)
    with pytest.raises(UnknownUnitError, match="got 32767; give its length in metres with --unit"):
        units_of_geo_keys(directory, b"")


def test_no_keys_say_nothing():
    """An empty directory, or none, is no statement."""
    assert units_of_geo_keys(b"") is None
    assert units_of_geo_keys(geo_keys()) is None
    assert units_of_geo_keys(b"\1\0\1") is None


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        (((1024, 2), (2048, 4326)), "degrees of a geographic system; project the file"),
        (((2048, 4326), (4099, 9001)), "degrees"),
        (((1024, 3), (2048, 4978)), "geocentric"),
        (((1024, 1), (3076, 9999)), "known unit of length, got 9999"),
        (((1024, 1), (3076, 9001), (4099, 9999)), "known unit of length, got 9999"),
        (((1024, 1), (3072, 2225), (3076, 9001)), "got metres and EPSG:2225, which is in US"),
    ],
)
def test_what_is_no_clear_length_is_refused(keys, text):
    """Angles, axes from the Earth's centre, unknown units and contradictions are errors."""
    with pytest.raises(FormatError, match=text):
        units_of_geo_keys(geo_keys(*keys))


def test_a_system_without_a_unit_is_metres_and_assumed():
    """Nothing but a plane is metres, which is said, unless the system's name has feet."""
    directory = geo_keys((1024, 1), (3072, 32767), (4099, 9001))
    found = units_of_geo_keys(directory, b"", b"Left field|NAD83|")
    assert found.is_assumed
    assert found.metres == (1.0, 1.0)
    assert "taken as metres; --unit" in found.remarks("its GeoKeys")[0]
    assert not units_of_geo_keys(geo_keys((1024, 1), (3072, 32633))).is_assumed
    for name in (
        b"NAD83 / California zone 1 (ftUS)|",
        b"Zone 3 US survey feet|",
        b"plane ft|",
        b"Foot_US",
        b"US_FEET",
    ):
        with pytest.raises(UnknownUnitError, match="a name in feet; give its length"):
            units_of_geo_keys(directory, b"", name)
        assert units_of_geo_keys(geo_keys((1024, 1), (3076, 9001)), b"", name).metres == (1, 1)
