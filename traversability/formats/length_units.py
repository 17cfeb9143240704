"""Units of length by EPSG's codes, and those of EPSG's coordinate reference systems."""

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import NamedTuple

from traversability.formats.error import FormatError


class UnknownUnitError(FormatError):
    """Coordinates whose unit is not a known length; the user may give its length."""


class LengthUnit(NamedTuple):
    """Unit of length.

    Attributes:
        name: Name in words.
        metres: Length of the unit [m].
    """

    name: str
    metres: float


METRE = LengthUnit("metres", 1.0)

_FOOT = 0.3048
_US_FOOT = 1200 / 3937
_SEARS_FOOT = 0.304799471538676

UNITS: Mapping[int, LengthUnit] = MappingProxyType(
    {
        1025: LengthUnit("millimetres", 0.001),
        1033: LengthUnit("centimetres", 0.01),
        9001: METRE,
        9002: LengthUnit("international feet", _FOOT),
        9003: LengthUnit("US survey feet", _US_FOOT),
        9005: LengthUnit("Clarke's feet", 0.3047972654),
        9014: LengthUnit("fathoms", 1.8288),
        9030: LengthUnit("nautical miles", 1852.0),
        9031: LengthUnit("German legal metres", 1.0000135965),
        9033: LengthUnit("US survey chains", 66 * _US_FOOT),
        9034: LengthUnit("US survey links", 0.66 * _US_FOOT),
        9035: LengthUnit("US survey miles", 5280 * _US_FOOT),
        9036: LengthUnit("kilometres", 1000.0),
        9037: LengthUnit("Clarke's yards", 0.9143917962),
        9039: LengthUnit("Clarke's links", 0.201166195164),
        9040: LengthUnit("British yards (Sears 1922)", 3 * _SEARS_FOOT),
        9041: LengthUnit("British feet (Sears 1922)", _SEARS_FOOT),
        9042: LengthUnit("British chains (Sears 1922)", 66 * _SEARS_FOOT),
        9062: LengthUnit("British chains (Benoit 1895 B)", 20.1167824943759),
        9080: LengthUnit("Indian feet", 0.304799510248147),
        9084: LengthUnit("Indian yards", 0.914398530744441),
        9093: LengthUnit("miles", 5280 * _FOOT),
        9094: LengthUnit("Gold Coast feet", 0.304799710181509),
        9095: LengthUnit("British feet (1936)", 0.3048007491),
        9096: LengthUnit("yards", 3 * _FOOT),
        9097: LengthUnit("chains", 66 * _FOOT),
        9098: LengthUnit("links", 0.66 * _FOOT),
        9301: LengthUnit("British chains (Sears 1922 truncated)", 20.116756),
    }
)
"""Units by EPSG's codes of units of measure, which GeoTIFF uses, too."""

_NAMES: Mapping[str, int] = MappingProxyType(
    {
        **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 9001),
        **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), 1025),
        **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), 1033),
        **dict.fromkeys(("km", "kilometer", "kilometers", "kilometre", "kilometres"), 9036),
        **dict.fromkeys(("ft", "foot", "feet"), 9002),
        **dict.fromkeys(("us-ft", "ftus", "us survey foot", "us survey feet"), 9003),
        **dict.fromkeys(("in", "inch", "inches"), 0),
        **dict.fromkeys(("yd", "yard", "yards"), 9096),
    }
)
"""Codes of units by the names that people write; EPSG has no inch."""

_INCH = LengthUnit("inches", 0.0254)

_TOLERANCE = 1e-6
"""Relative difference up to which a length is that of a unit; the two feet differ by 2e-6."""


def unit_of_length(metres: float) -> LengthUnit:
    """Return the unit of a length [m], by its number in metres if it is none of ``UNITS``."""
    best = min(UNITS.values(), key=lambda unit: abs(unit.metres / metres - 1))
    if abs(best.metres / metres - 1) < _TOLERANCE:
        return LengthUnit(best.name, metres)
    return LengthUnit(f"units of {metres:.10g} m", metres)


def unit_of_name(name: str) -> LengthUnit | None:
    """Return the unit that people call so, or None."""
    code = _NAMES.get(" ".join(name.lower().split()))
    return None if code is None else UNITS.get(code, _INCH)


def unit_of_system(code: int) -> LengthUnit:
    """Return the unit of one of EPSG's projected or vertical systems, by its code."""
    return UNITS[_units_of_systems().get(code, 9001)]


@cache
def _units_of_systems() -> Mapping[int, int]:
    """Return codes of units by codes of systems that are not in metres."""
    text = files("traversability.formats").joinpath("epsg_units.txt").read_text("utf-8")
    units_by_system: dict[int, int] = {}
    unit = 0
    for line in text.splitlines():
        for word in line.split() if not line.startswith("#") else ():
            if word.endswith(":"):
                unit = int(word[:-1])
                continue
            first, _, last = word.partition("-")
            units_by_system |= dict.fromkeys(range(int(first), int(last or first) + 1), unit)
    return MappingProxyType(units_by_system)
