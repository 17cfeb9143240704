"""Datum of the map: given by the user or the first good fix, and the magnetic field there."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.localization.fix_check import check_fixes
from andabata.localization.initial_pose import levelled_field
from andabata.machine.geo_reference import (
    MAX_FIELD,
    MIN_FIELD,
    GeoReference,
    place_text,
    wrapped_longitude,
)
from andabata.machine.magnetic_model import magnetic_field
from andabata.machine.proprioception import MICROTESLA
from andabata.machine.sensor_readings import SensorReadings

MAX_DISTANCE = 10_000.0
"""Largest distance of the first fixes from a given datum [m]."""

MAX_JUMP = 1_000.0
"""Largest distance of one of the first fixes from their median [m]."""

_MAX_HEIGHT_ERROR = 10.0
"""Largest difference between the datum's altitude and the one that follows from the fixes [m]."""

_FIELD = {"declination_deg", "inclination_deg", "field"}
"""Names of the fields of ``GeoReference`` that describe the magnetic field."""

_MAX_MISFIT = 5.0
"""Difference of the measured from the expected magnetic field from which there is a note [uT]: five
times the robot's hard iron."""


class DatumError(ValueError):
    """Datum that does not fit the fixes, or that cannot be determined."""


@dataclass(frozen=True)
class Datum:
    """Geodetic reference of the map, and the sources that it comes from.

    Attributes:
        reference: Origin of the map and the magnetic field expected there.
        source: Source of the origin.
        magnetic_source: Source of the magnetic field.
        heading_only: True if strength and inclination of the field come from a model: the compass
            then corrects the heading alone.
        measured: Strength [uT] and inclination [deg] that the compass measured at the start, None
            without a compass.
    """

    reference: GeoReference
    source: str
    magnetic_source: str
    heading_only: bool = False
    measured: tuple[float, float] | None = None

    @property
    def expected(self) -> GeoReference:
        """Reference with the field that the compass is expected to measure.

        An uncalibrated compass still measures the heading: it is compared with its own reading at
        the start, turned to the expected declination.
        """
        if not self.heading_only or self.measured is None:
            return self.reference
        strength, dip = self.measured
        return self.reference.model_copy(update={"inclination_deg": dip, "field": strength})

    def as_dict(self) -> dict[str, Any]:
        """Return the datum as a dictionary for JSON."""
        reference, (strength, dip) = self.reference, self.measured or (None, None)
        return {
            "datum": {
                "latitude_deg": reference.latitude_deg,
                "longitude_deg": reference.longitude_deg,
                "altitude_m": reference.altitude,
                "source": self.source,
            },
            "magnetic": {
                "declination_deg": reference.declination_deg,
                "inclination_deg": reference.inclination_deg,
                "field_ut": reference.field,
                "source": self.magnetic_source,
                "heading_only": self.heading_only,
                "compass_inclination_deg": dip,
                "compass_field_ut": strength,
            },
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """Description of the datum, one text per line."""
        reference = self.reference
        place = place_text(reference.latitude_deg, reference.longitude_deg)
        dip, strength = reference.inclination_deg, reference.field
        found = [
            f"the map's origin is {place} ({self.source})",
            f"declination {reference.declination_deg:.1f} degrees, inclination {dip:.0f} degrees, "
            f"{strength:.1f} uT ({self.magnetic_source})",
        ]
        if self.measured is not None and self._misfit > _MAX_MISFIT:
            found.append(
                f"the compass reads {self.measured[0]:.1f} uT that dip by {self.measured[1]:.0f} "
                f"degrees, expected {strength:.1f} uT and {dip:.0f} degrees: it is not calibrated, "
                "or disturbed, or was elsewhere; its heading alone is used"
            )
        return tuple(found)

    @property
    def _misfit(self) -> float:
        """Difference of the measured and the expected field in the vertical plane [uT]."""
        strength, dip = self.measured or (0.0, 0.0)
        there = np.deg2rad([dip, self.reference.inclination_deg])
        lengths = np.array([strength, self.reference.field])
        level, down = lengths * np.cos(there), lengths * np.sin(there)
        return float(np.hypot(level[0] - level[1], down[0] - down[1]))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Datum":
        """Return a datum from its dictionary.

        Args:
            data: Dictionary as ``as_dict`` returns it.

        Raises:
            DatumError: If a key is missing or a value invalid.
        """
        try:
            place, field = data["datum"], data["magnetic"]
            reference = GeoReference(
                latitude_deg=place["latitude_deg"],
                longitude_deg=place["longitude_deg"],
                altitude=place["altitude_m"],
                declination_deg=field["declination_deg"],
                inclination_deg=field["inclination_deg"],
                field=field["field_ut"],
            )
            strength, dip = field["compass_field_ut"], field["compass_inclination_deg"]
            return cls(
                reference,
                str(place["source"]),
                str(field["source"]),
                bool(field["heading_only"]),
                None if strength is None or dip is None else (float(strength), float(dip)),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise DatumError(f"datum: expected a place and a field, got {data!r}") from error

    def with_compass(self, readings: SensorReadings) -> "Datum":
        """Return the datum with strength and inclination of the field as the compass measures them.

        Args:
            readings: Readings at the start; the datum stays as it is without compass or inertial
                unit.
        """
        field = levelled_field(readings)
        if field is None:
            return self
        ahead, left, up = field / MICROTESLA
        level = np.hypot(ahead, left)
        strength, dip = float(np.hypot(level, up)), float(np.rad2deg(np.arctan2(-up, level)))
        if not MIN_FIELD < strength < MAX_FIELD:
            return self  # No field on Earth: the filter rejects and reports it.
        return replace(self, measured=(strength, dip))


def datum_from_heading(readings: SensorReadings, yaw: float) -> Datum:
    """Return a datum without a place, whose declination follows from a given heading.

    Args:
        readings: Readings at the start; without a compass the default's field is expected.
        yaw: Given heading [rad].
    """
    default = Datum(
        GeoReference(), "the default, without any fix", "the default", heading_only=True
    )
    field = levelled_field(readings)
    if field is None:
        return default
    east, north = Rotation.from_euler("Z", yaw).apply(field)[:2]
    turned = {"declination_deg": float(np.rad2deg(np.arctan2(east, north)))}
    reference = default.reference.model_copy(update=turned)
    source = "the compass, by the given heading"
    return replace(default, reference=reference, magnetic_source=source).with_compass(readings)


def consistent_fixes(fixes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which fixes are valid and near the others.

    A receiver that has just been turned on may send its last position, or any other.

    Args:
        fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5).

    Returns:
        True for consistent fixes, shape (k,).
    """
    kept = check_fixes(fixes).good
    if not kept.any():
        return kept
    first = fixes[kept][0]
    level = GeoReference(
        latitude_deg=first[1], longitude_deg=wrapped_longitude(first[2]), altitude=None
    )
    places = level.to_map(np.column_stack([fixes[kept, 1:3], np.zeros(int(kept.sum()))]))
    apart = np.linalg.norm(places - np.median(places, axis=0), axis=1)
    kept[kept] = apart <= MAX_JUMP
    return kept


def rejected_fixes(fixes: NDArray[np.float64], until: float = np.inf) -> Counter[str]:
    """Return the number of the first fixes that cannot be used, by reason.

    Args:
        fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5); all serve to find outliers.
        until: Stamp of the first fix that is not counted [s].
    """
    early = ~(fixes[:, 0] >= until)
    check = check_fixes(fixes[early])
    rejected = Counter(check.rejected)
    if jumped := int((check.good & ~consistent_fixes(fixes)[early]).sum()):
        rejected[f"more than {MAX_JUMP / 1000:.0f} km from the others at the start"] += jumped
    return rejected


def make_datum(
    given: Mapping[str, float],
    fixes: NDArray[np.float64],
    year: float,
    start: NDArray[np.float64] | None = None,
) -> Datum | None:
    """Return the datum that the user gives, or else the first fix that is near the others.

    Fields of the magnetic field that are not given come from the World Magnetic Model.

    Args:
        given: Fields of ``GeoReference`` that the user gives.
        fixes: First rows as in ``SensorReadings.gnss``, shape (k, 5).
        year: Decimal year of the first fix.
        start: Given position in the map of the first consistent fix [m], shape (3,); None puts the
            origin there.

    Returns:
        Datum, or None if neither a place is given nor a fix is valid.

    Raises:
        DatumError: If one of latitude and longitude is given without the other, or the fixes lie
            more than 10 km from what is given.
    """
    if ("latitude_deg" in given) != ("longitude_deg" in given):
        one = next(name for name in ("latitude_deg", "longitude_deg") if name in given)
        raise DatumError(
            f"sensing.geo_reference: expected latitude_deg and longitude_deg, or neither, "
            f"got only {one}; --datum LAT,LON gives both"
        )
    rows = fixes[consistent_fixes(fixes)]
    altitudes = rows[np.isfinite(rows[:, 3]), 3]
    altitude = given.get("altitude", float(altitudes[0]) if len(altitudes) else None)
    if "latitude_deg" in given:
        source, place = "given", [given["latitude_deg"], given["longitude_deg"]]
    elif len(rows):
        source, place = "the first good fix", [rows[0, 1], wrapped_longitude(rows[0, 2])]
    else:
        return None
    reference = GeoReference(
        latitude_deg=float(place[0]), longitude_deg=float(place[1]), altitude=altitude
    )
    if source == "given":
        check_distance(reference, fixes, source)
        if start is not None and altitude is not None and len(altitudes):
            # Above the sea or above the ellipsoid: only the receiver's own vertical datum fits.
            counted = float(altitudes[0]) - float(start[2])
            if abs(counted - altitude) > _MAX_HEIGHT_ERROR:
                reference = reference.model_copy(update={"altitude": counted})
                source += f", but altitude {counted:.0f} m by the fixes instead of {altitude:.0f} m"
    elif start is not None:
        reference = _shifted(reference, start)
        source += ", at the given start"
    return _with_field(reference, source, given, year)


def _shifted(reference: GeoReference, start: NDArray[np.float64]) -> GeoReference:
    """Return a reference in which the old one's origin lies at a place in the map [m]."""
    latitude, longitude, altitude = reference.to_geodetic(-start[None])[0].tolist()
    known = None if reference.altitude is None else altitude
    return reference.model_copy(
        update={"latitude_deg": latitude, "longitude_deg": longitude, "altitude": known}
    )


def _with_field(
    reference: GeoReference, source: str, given: Mapping[str, float], year: float
) -> Datum:
    """Return a datum whose field is given or, where it is not, the World Magnetic Model's."""
    chosen = {name: given[name] for name in sorted(_FIELD & set(given))}
    sources = [f"given ({', '.join(chosen)})"] if chosen else []
    fields: dict[str, float] = {}
    if len(chosen) < len(_FIELD):
        model = magnetic_field(
            reference.latitude_deg, reference.longitude_deg, reference.altitude or 0.0, year
        )
        fields = {
            "declination_deg": model.declination_deg,
            "inclination_deg": model.inclination_deg,
            "field": model.flux_density,
        }
        sources.append(model.source)
    heading_only = not {"inclination_deg", "field"} <= set(chosen)
    reference = reference.model_copy(update=fields | chosen)
    return Datum(reference, source, "; ".join(sources), heading_only)


def check_distance(reference: GeoReference, fixes: NDArray[np.float64], source: str) -> None:
    """Check that fixes lie near a given datum, whatever their altitude.

    Args:
        reference: Datum of the map.
        fixes: First rows as in ``SensorReadings.gnss``, shape (k, 5).
        source: Source of the datum.

    Raises:
        DatumError: If the first fix that fits the others is more than 10 km away.
    """
    rows = fixes[consistent_fixes(fixes)]
    if not len(rows):
        return
    latitude, longitude = float(rows[0, 1]), float(rows[0, 2])
    away = reference.distance(latitude, longitude)
    if away <= MAX_DISTANCE:
        return
    hint = ""
    if reference.distance(longitude, latitude) <= MAX_DISTANCE:
        hint = " (latitude and longitude seem to be swapped)"
    elif reference.distance(*np.rad2deg([latitude, longitude]).tolist()) <= MAX_DISTANCE:
        hint = " (they seem to be in radians)"
    raise DatumError(
        f"fixes: expected them within {MAX_DISTANCE / 1000:.0f} km of the datum at "
        f"{place_text(reference.latitude_deg, reference.longitude_deg)} ({source}), got "
        f"{place_text(latitude, longitude)}, {away / 1000:,.0f} km away{hint}; give --datum, or "
        "drop the setting sensing.geo_reference to take the first fix"
    )
