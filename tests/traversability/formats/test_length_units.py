"""Units of length by EPSG's codes and by the names that people write."""

import pytest

from traversability.formats.length_units import (
    METRE,
    UNITS,
    unit_of_length,
    unit_of_name,
    unit_of_system,
)


def test_the_two_feet_are_told_apart():
    """The international and the US survey foot differ by two millionths."""
    assert UNITS[9003].metres / UNITS[9002].metres - 1 == pytest.approx(2e-6, rel=1e-3)
    assert unit_of_length(0.3048).name == "international feet"
    assert unit_of_length(0.30480061).name == "US survey feet"
    assert unit_of_length(0.30480061).metres == 0.30480061
    assert unit_of_length(0.123).name == "units of 0.123 m"


@pytest.mark.parametrize(
    ("code", "unit"),
    [
        (2225, 9003),
        (2240, 9003),
        (2250, 9003),
        (2251, 9002),
        (6360, 9003),
        (8228, 9002),
        (22300, 9036),
        (29872, 9041),
        (32633, 9001),
        (5703, 9001),
        (2224, 9002),
        (2195, 9001),
    ],
)
def test_systems_have_epsgs_units(code, unit):
    """Units of some systems as EPSG lists them, at the ends of its blocks of codes, too."""
    assert unit_of_system(code) == UNITS[unit]


def test_names_that_people_write_are_known():
    """Names are read without regard to capitals and spaces."""
    assert unit_of_name(" Meters") == METRE
    assert unit_of_name("mm").metres == 0.001
    assert unit_of_name("US  survey feet").metres == pytest.approx(1200 / 3937)
    assert unit_of_name("inches").metres == 0.0254
    assert unit_of_name("parsec") is None
