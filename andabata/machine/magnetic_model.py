"""Earth's magnetic field for a place and a date, by the World Magnetic Model (NOAA/NCEI, BGS)."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

_MODELS = ((2025.0, "WMM_2025"), (2020.0, "WMM_2020"), (2015.0, "WMM_2015v2"), (2010.0, "WMM_2010"))
"""Decimal year in which each model begins and name of its coefficients, the newest first."""

_END = 2030.0
"""Decimal year in which the newest model ends."""


@dataclass(frozen=True)
class MagneticField:
    """Magnetic field of a place at a date.

    Attributes:
        declination_deg: Angle from true north to magnetic north, east positive.
        inclination_deg: Angle below the horizon.
        flux_density: Total flux density [uT].
        source: Name of the model, and the date.
        is_valid: True if a model is published for the date.
    """

    declination_deg: float
    inclination_deg: float
    flux_density: float
    source: str
    is_valid: bool


def magnetic_field(
    latitude_deg: float, longitude_deg: float, altitude: float, year: float
) -> MagneticField:
    """Return the magnetic field of a place at a date.

    Before the first and after the last model the nearest one is extrapolated by its own secular
    variation, and ``is_valid`` is false.

    Args:
        latitude_deg: Geodetic latitude.
        longitude_deg: Longitude.
        altitude: Altitude above the ellipsoid [m]; an error of a hundred metres is negligible.
        year: Decimal year.
    """
    from pygeomag import GeoMag

    name = next((name for begin, name in _MODELS if year >= begin), _MODELS[-1][1])
    is_valid = _MODELS[-1][0] <= year <= _END
    # A linear extrapolation over more than five years has no value.
    used = min(max(year, _MODELS[-1][0] - 5.0), _END + 5.0)
    found = GeoMag(coefficients_file=f"wmm/{name}.COF").calculate(
        latitude_deg, longitude_deg, altitude / 1000.0, used, allow_date_outside_lifespan=True
    )
    source = f"{name.replace('_', '')} for {year:.1f}"
    if not is_valid:
        source += f", outside of {_MODELS[-1][0]:.0f} to {_END:.0f}: the nearest model is used"
    return MagneticField(float(found.d), float(found.i), float(found.f) / 1000.0, source, is_valid)


def decimal_year(stamp_ns: int) -> float:
    """Return the decimal year of a stamp [ns since 1970]."""
    moment = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=stamp_ns // 1_000_000_000)
    begin = datetime(moment.year, 1, 1, tzinfo=UTC)
    end = datetime(moment.year + 1, 1, 1, tzinfo=UTC)
    return moment.year + (moment - begin) / (end - begin)
