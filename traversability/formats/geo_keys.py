"""Units of a LAS file by its GeoKeys, the keys of GeoTIFF (LAS 1.4 R15, section 3.2)."""

import re
from collections.abc import Mapping

import numpy as np

from traversability.formats.coordinate_units import (
    GEOCENTRIC,
    GEOGRAPHIC,
    GIVE,
    CoordinateUnits,
)
from traversability.formats.error import FormatError
from traversability.formats.length_units import (
    METRE,
    UNITS,
    LengthUnit,
    UnknownUnitError,
    unit_of_length,
    unit_of_system,
)

_MODEL, _GEOGRAPHIC_SYSTEM = 1024, 2048
_PROJECTED_SYSTEM, _LINEAR_UNIT, _LINEAR_UNIT_SIZE = 3072, 3076, 3077
_VERTICAL_SYSTEM, _VERTICAL_UNIT = 4096, 4099
"""Numbers of the keys (OGC GeoTIFF 1.1, section 7)."""

_PROJECTED, _ANGULAR, _FROM_THE_CENTRE = 1, 2, 3
"""Values of the model's key."""

_USER_DEFINED = 32767
_ALIKE = 1e-4
"""Relative difference up to which two units are as good as one."""

_FEET = re.compile(r"(?:\b|_|us)(?:ft|foot|feet)(?:\b|_|us)", re.IGNORECASE)
"""Feet in the name of a system."""

_DOUBLES = 34736
"""Record of the LAS file that holds a key's value where it is a float64."""


def units_of_geo_keys(
    directory: bytes, doubles: bytes = b"", citations: bytes = b""
) -> CoordinateUnits | None:
    """Return the units of coordinates, None if there are no keys.

    A unit that a key names counts before that of the coordinate system whose code another names.

    Args:
        directory: Record 34735: 16 bit numbers, four of the header and four of each key.
        doubles: Record 34736: float64 numbers.
        citations: Record 34737: names of the systems, in free text.

    Raises:
        UnknownUnitError: If a unit's length is unknown, or the keys contradict each other.
        FormatError: If the coordinates are angles, or count from the Earth's centre.
    """
    keys = _keys(directory, doubles)
    if not keys:
        return None
    model, length = keys.get(_MODEL), _LINEAR_UNIT in keys or _PROJECTED_SYSTEM in keys
    if model == _FROM_THE_CENTRE:
        raise FormatError(GEOCENTRIC)
    if model == _ANGULAR or (model != _PROJECTED and _GEOGRAPHIC_SYSTEM in keys and not length):
        raise FormatError(GEOGRAPHIC)
    across = _unit(keys, _LINEAR_UNIT, _PROJECTED_SYSTEM, keys.get(_LINEAR_UNIT_SIZE))
    up = _unit(keys, _VERTICAL_UNIT, _VERTICAL_SYSTEM, None)
    if across is None and _FEET.search(citations.decode("latin-1")):
        raise UnknownUnitError(f"GeoKeys: expected a unit of length, got a name in feet; {GIVE}")
    return CoordinateUnits(across or METRE, up, is_assumed=across is None)


def _unit(
    keys: Mapping[int, float], unit: int, system: int, size: float | None
) -> LengthUnit | None:
    """Return a unit by its own key, else by that of its system, None without both.

    Raises:
        UnknownUnitError: If its length is unknown, or the two keys contradict each other.
    """
    code, place = int(keys.get(unit, 0)), int(keys.get(system, 0))
    known = unit_of_system(place) if 0 < place < _USER_DEFINED else None
    if code == 0:
        return known
    if code == _USER_DEFINED and size is not None and np.isfinite(size) and size > 0:
        return unit_of_length(size)
    if code not in UNITS:
        raise UnknownUnitError(f"GeoKeys: expected a known unit of length, got {code}; {GIVE}")
    # Programs write other units beside metric systems, and mix up the two feet, which matters to
    # the place of a cloud, not to its shape; metres beside a system in feet are a contradiction.
    if known not in (None, METRE) and abs(UNITS[code].metres / known.metres - 1) > _ALIKE:
        raise UnknownUnitError(
            f"GeoKeys: expected one unit, got {UNITS[code].name} and EPSG:{place}, which is in "
            f"{known.name}; {GIVE}"
        )
    return UNITS[code]


def _keys(directory: bytes, doubles: bytes) -> dict[int, float]:
    """Return the keys that hold a number: a short in place, or one of the doubles."""
    shorts = np.frombuffer(directory, dtype="<u2", count=len(directory) // 2)
    floats = np.frombuffer(doubles, dtype="<f8", count=len(doubles) // 8)
    keys: dict[int, float] = {}
    for key, location, _, value in shorts[4 : len(shorts) // 4 * 4].reshape(-1, 4).tolist():
        if location == 0:
            keys[key] = value
        elif location == _DOUBLES and value < len(floats):
            keys[key] = float(floats[value])
    keys.pop(0, None)
    return keys
