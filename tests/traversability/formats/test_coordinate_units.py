"""Units of coordinates in words, and their lengths."""

from traversability.formats.coordinate_units import METRES, CoordinateUnits
from traversability.formats.length_units import METRE, UNITS


def test_metres_need_no_words():
    """Nothing is said of coordinates in metres."""
    assert METRES.metres == (1.0, 1.0)
    assert METRES.remarks("its WKT") == ()
    assert CoordinateUnits(METRE, METRE).remarks("its WKT") == ()


def test_words_name_units_and_what_was_assumed():
    """One sentence names the units, where they stand, and where z had none."""
    feet = UNITS[9002]
    (text,) = CoordinateUnits(feet, feet).remarks("its WKT")
    assert text.startswith("coordinates in international feet (0.3048 m), by its WKT, are conv")
    assert "z" not in text
    (text,) = CoordinateUnits(feet).remarks("its WKT")
    assert text.endswith("; nothing names the unit of z: the same")
    (text,) = CoordinateUnits(feet, METRE).remarks("its GeoKeys")
    assert "x and y in international feet (0.3048 m) and z in metres, by its Geo" in text
    assert CoordinateUnits(feet).metres == (0.3048, 0.3048)
    assert CoordinateUnits.given(0.001).metres == (0.001, 0.001)
