"""Units by the well-known text of a reference system, in its three dialects."""

import pytest

from tests.support.las_files import GEOGRAPHIC_WKT, projected_wkt, vertical_wkt
from traversability.formats.error import FormatError
from traversability.formats.length_units import UnknownUnitError
from traversability.formats.well_known_text import parse_text, units_of_text

US_FOOT = 0.3048006096012192
WKT2_BASE = (
    'BASEGEOGCRS["NAD83",DATUM["d",ELLIPSOID["GRS 1980",6378137,298.25,LENGTHUNIT["metre",1]]]],'
    'CONVERSION["c",METHOD["Lambert"],PARAMETER["e",0,LENGTHUNIT["metre",1]]]'
)


def compound(*parts):
    """Return a compound system in WKT 1."""
    return f'COMPD_CS["both",{",".join(parts)}]'


@pytest.mark.parametrize(
    ("text", "across", "up"),
    [
        (projected_wkt(), US_FOOT, US_FOOT),
        (projected_wkt("Foot_US", "0.3048006096012192"), US_FOOT, US_FOOT),
        (compound(projected_wkt(), vertical_wkt()), US_FOOT, 1.0),
        (compound(projected_wkt("metre", "1"), vertical_wkt("foot", "0.3048")), 1.0, 0.3048),
        (f"{projected_wkt()},{vertical_wkt('metre', '1.0')}", US_FOOT, 1.0),
        (f'PROJCRS["p",{WKT2_BASE},CS[Cartesian,2],AXIS["x",east],AXIS["y",north],'
         f'LENGTHUNIT["US survey foot",{US_FOOT}]]', US_FOOT, US_FOOT),
        (f'PROJCRS["p",{WKT2_BASE},CS[Cartesian,3],'
         f'AXIS["x",east,LENGTHUNIT["foot",0.3048]],AXIS["y",north,LENGTHUNIT["foot",0.3048]],'
         'AXIS["h",up,LENGTHUNIT["metre",1]]]', 0.3048, 1.0),
        (f'COMPOUNDCRS["c",PROJCRS["p",{WKT2_BASE},CS[Cartesian,2],LENGTHUNIT["metre",1]],'
         'VERTCRS["v",VDATUM["d"],CS[vertical,1],AXIS["up (H)",up],LENGTHUNIT["foot",0.3048]]]',
         1.0, 0.3048),
        ('LOCAL_CS["site",UNIT["millimetre",0.001]]', 0.001, 0.001),
        ('projcs ( "p (odd ""name"")" , unit ( "" , 0.5 ) )\r\n\0', 0.5, 0.5),
    ],
)  # fmt: skip
def test_units_are_those_of_the_text(text, across, up):
    """The unit of the plane counts, never that of its base or of a parameter."""
    assert units_of_text(text).metres == pytest.approx((across, up), rel=1e-12)


def test_an_empty_text_says_nothing():
    """Records of zeros are no statement."""
    assert units_of_text("\0\0\0 \n") is None


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (GEOGRAPHIC_WKT, "degrees of a geographic system"),
        (compound(GEOGRAPHIC_WKT, vertical_wkt()), "degrees"),
        ('GEODCRS["g",CS[ellipsoidal,2],ANGLEUNIT["degree",0.017]]', "degrees"),
        ('GEODCRS["g",CS[Cartesian,3],LENGTHUNIT["metre",1]]', "geocentric"),
        ('GEOCCS["g",UNIT["metre",1]]', "geocentric"),
        (compound(projected_wkt(), vertical_wkt(axis="DOWN")), "expected heights, got depths"),
    ],
)
def test_what_is_no_length_upwards_is_refused(text, words):
    """Angles, axes from the Earth's centre and depths are errors that no unit mends."""
    with pytest.raises(FormatError, match=words) as error:
        units_of_text(text)
    assert not isinstance(error.value, UnknownUnitError)


@pytest.mark.parametrize(
    "text",
    ["EPSG:2225", 'PROJCS["p"', 'PROJCS["p"]]', 'PROJCS["p",UNIT["foot","long"]]', 'PROJCS["p"]',
     'PROJCS["p",UNIT["foot",0]]', 'VERT_CS["v",UNIT["foot",0.3]]', '"'],
)  # fmt: skip
def test_a_text_without_a_unit_asks_for_one(text):
    """What cannot be read names the option with which the user says the unit."""
    with pytest.raises(UnknownUnitError, match="; give its length in metres with --unit"):
        units_of_text(text)


def test_nodes_hold_values_and_children():
    """Texts, numbers and nested keywords are kept apart, in their order."""
    (node,) = parse_text('A["x",1,B[2],C["y",D[3]]]')
    assert (node.keyword, node.values) == ("A", ["x", "1"])
    assert [each.keyword for each in node.walk()] == ["A", "B", "C", "D"]
