"""Units of the heights of a raster: what its band or its vertical datum says, to metres."""

import re
from typing import Any

_METRES = {
    "m": 1.0,
    "metre": 1.0,
    "meter": 1.0,
    "metres": 1.0,
    "meters": 1.0,
    "ft": 0.3048,
    "foot": 0.3048,
    "feet": 0.3048,
    "international foot": 0.3048,
    "us survey foot": 1200 / 3937,
    "us-ft": 1200 / 3937,
    "us_survey_foot": 1200 / 3937,
    "foot_us": 1200 / 3937,
    "ftus": 1200 / 3937,
    "dm": 0.1,
    "decimetre": 0.1,
    "cm": 0.01,
    "centimetre": 0.01,
}
"""Metres of one unit, by its names in GDAL and PROJ, lower case."""

_VERTICAL = re.compile(
    r'VERT(?:_CS|CRS)\[.*?\b(?:LENGTH)?UNIT\["([^"]*)",\s*([0-9.eE+-]+)', re.DOTALL
)
"""Name and metres of the unit of a vertical system in well-known text, of version 1 or 2."""


def metres_of(unit: str | None, crs: Any) -> tuple[float | None, str]:  # noqa: ANN401 - rasterio's.
    """Return the metres of a unit of height, None if nothing says what it is, and its name.

    Args:
        unit: Unit of the raster's band, as the file names it; None or empty if it names none.
        crs: Coordinate reference system, which may have a vertical part.

    Raises:
        ValueError: If the unit's name is not known.
    """
    if unit:
        metres = _METRES.get(unit.strip().lower())
        if metres is None:
            raise ValueError(f"expected heights in metres or feet, got {unit!r}")
        return metres, unit.strip()
    vertical = _VERTICAL.search(crs.to_wkt())
    if vertical is not None:
        return float(vertical[2]), vertical[1]
    return None, ""
