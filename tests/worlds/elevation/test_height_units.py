"""Units of heights: the band's, the vertical datum's, or unknown."""

from types import SimpleNamespace

import pytest

from worlds.elevation.height_units import metres_of

PLAIN = 'PROJCS["x",UNIT["US survey foot",0.3048006]]'
VERSION_1 = (
    'COMPD_CS["x",PROJCS["y",UNIT["metre",1]],VERT_CS["z",VERT_DATUM["d",2005,'
    'AUTHORITY["EPSG","5103"]],UNIT["US survey foot",0.304800609601219]]]'
)
VERSION_2 = (
    'COMPOUNDCRS["x",PROJCRS["y",LENGTHUNIT["metre",1]],VERTCRS["z",VDATUM["d"],CS[vertical,1],'
    'AXIS["height",up,LENGTHUNIT["foot",0.3048]]]]'
)


def crs(text):
    """Return a system of a text."""
    return SimpleNamespace(to_wkt=lambda: text)


@pytest.mark.parametrize(
    ("unit", "metres"),
    [
        ("m", 1.0),
        (" Metre", 1.0),
        ("ft", 0.3048),
        ("US survey foot", 0.3048006096),
        ("cm", 0.01),
    ],
)
def test_the_unit_of_the_band_comes_first(unit, metres):
    """Whatever the vertical datum says."""
    assert metres_of(unit, crs(VERSION_1)) == (pytest.approx(metres), unit.strip())


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (PLAIN, (None, "")),
        (VERSION_1, (pytest.approx(0.3048006096), "US survey foot")),
        (VERSION_2, (pytest.approx(0.3048), "foot")),
    ],
)
def test_else_it_is_that_of_the_vertical_datum(text, expected):
    """The unit of east and north is none of heights."""
    assert metres_of(None, crs(text)) == expected
    assert metres_of("", crs(text)) == expected


def test_another_unit_is_refused():
    """Its name is in the error."""
    with pytest.raises(ValueError, match="expected heights in metres or feet, got 'fathom'"):
        metres_of("fathom", crs(PLAIN))
