"""Datum of the map: given, or the first good fix, with the magnetic field that holds there."""

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
from andabata.machine.proprioception import TESLA
from andabata.machine.sensor_readings import SensorReadings

MAX_DISTANCE = 10_000.0
"""Largest distance of the first fixes from a datum that is told [m]."""

MAX_JUMP = 1_000.0
"""Largest distance of one of the first fixes from their median [m]."""

_MAX_HEIGHT_ERROR = 10.0
"""Largest difference between the datum's altitude and what the fixes make of it [m]."""

_FIELD = {"declination_deg", "inclination_deg", "field"}

_MAX_MISFIT = 5.0
"""Difference of the field that the compass reads from the one expected from which it is said [uT]:
five times what the robot's own iron makes."""


class DatumError(ValueError):
    """A datum that does not belong to the fixes, or that nothing tells."""


@dataclass(frozen=True)
class Datum:
    """Geodetic reference of the map and who told it.

    Attributes:
        reference: Origin of the map and the field expected there.
        source: Teller of the origin.
        magnetic_source: Teller of the field.
        loose: Whether strength and dip of the field are only a model's: the compass then tells the
            heading alone.
        sensed: Strength [uT] and dip [deg] that the compass read at the start, None without.
    """

    reference: GeoReference
    source: str
    magnetic_source: str
    loose: bool = False
    sensed: tuple[float, float] | None = None

    @property
    def expected(self) -> GeoReference:
        """Reference whose field is the one that the compass has to compare with.

        A compass that nobody calibrated still tells the heading: it is compared with what it read
        at the start, turned to the declination that is expected.
        """
        if not self.loose or self.sensed is None:
            return self.reference
        strength, dip = self.sensed
        return self.reference.model_copy(update={"inclination_deg": dip, "field": strength})

    def as_dict(self) -> dict[str, Any]:
        """Return all of it, ready for JSON."""
        reference, (strength, dip) = self.reference, self.sensed or (None, None)
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
                "heading_only": self.loose,
                "compass_inclination_deg": dip,
                "compass_field_ut": strength,
            },
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """All of it in words, for the user."""
        reference = self.reference
        place = place_text(reference.latitude_deg, reference.longitude_deg)
        dip, strength = reference.inclination_deg, reference.field
        found = [
            f"the map's origin is {place} ({self.source})",
            f"declination {reference.declination_deg:.1f} degrees, inclination {dip:.0f} degrees, "
            f"{strength:.1f} uT ({self.magnetic_source})",
        ]
        if self.sensed is not None and self._misfit > _MAX_MISFIT:
            found.append(
                f"the compass reads {self.sensed[0]:.1f} uT that dip by {self.sensed[1]:.0f} "
                f"degrees, expected {strength:.1f} uT and {dip:.0f} degrees: it is not calibrated, "
                "or disturbed, or was elsewhere; its heading alone is used"
            )
        return tuple(found)

    @property
    def _misfit(self) -> float:
        """Difference of the sensed and the expected field in the vertical plane [uT]."""
        strength, dip = self.sensed or (0.0, 0.0)
        there = np.deg2rad([dip, self.reference.inclination_deg])
        lengths = np.array([strength, self.reference.field])
        level, down = lengths * np.cos(there), lengths * np.sin(there)
        return float(np.hypot(level[0] - level[1], down[0] - down[1]))

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Datum":
        """Return what ``as_dict`` gave.

        Raises:
            DatumError: If it is not that.
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
        """Return the datum with strength and dip of the field as the compass reads them.

        Args:
            readings: Readings at the start; without compass or inertial unit nothing changes.
        """
        field = levelled_field(readings)
        if field is None:
            return self
        ahead, left, up = field / TESLA
        level = np.hypot(ahead, left)
        strength, dip = float(np.hypot(level, up)), float(np.rad2deg(np.arctan2(-up, level)))
        if not MIN_FIELD < strength < MAX_FIELD:
            return self  # No field on Earth: the filter refuses it, and says so.
        return replace(self, sensed=(strength, dip))


def datum_of_heading(readings: SensorReadings, yaw: float) -> Datum:
    """Return a datum nowhere in particular whose declination is what a told heading makes of it.

    Args:
        readings: Readings at the start; without a compass the default's field is expected.
        yaw: Heading that is told [rad].
    """
    nowhere = Datum(GeoReference(), "the default, since no fix tells it", "the default", loose=True)
    field = levelled_field(readings)
    if field is None:
        return nowhere
    east, north = Rotation.from_euler("Z", yaw).apply(field)[:2]
    turned = {"declination_deg": float(np.rad2deg(np.arctan2(east, north)))}
    reference = nowhere.reference.model_copy(update=turned)
    source = "the compass, by the heading that is told"
    return replace(nowhere, reference=reference, magnetic_source=source).with_compass(readings)


def consistent_fixes(fixes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which fixes are good and near to the others.

    A receiver that has just begun may send where it last was, or anything.

    Args:
        fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5).
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


def refused_fixes(fixes: NDArray[np.float64], until: float = np.inf) -> Counter[str]:
    """Return how many of the first fixes cannot tell the place, by reason.

    Args:
        fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5); all of them tell which fit each other.
        until: Stamp of the first that is not counted [s].
    """
    early = ~(fixes[:, 0] >= until)
    check = check_fixes(fixes[early])
    refused = Counter(check.refused)
    if jumped := int((check.good & ~consistent_fixes(fixes)[early]).sum()):
        refused[f"more than {MAX_JUMP / 1000:.0f} km from the others at the start"] += jumped
    return refused


def make_datum(
    given: Mapping[str, float],
    fixes: NDArray[np.float64],
    year: float,
    start: NDArray[np.float64] | None = None,
) -> Datum | None:
    """Return the datum: what is given, and where nothing is, the first fix that fits the others.

    The World Magnetic Model tells what is not given of the field.

    Args:
        given: Fields of ``GeoReference`` that the user gives.
        fixes: The first rows as in ``SensorReadings.gnss``, shape (k, 5).
        year: Decimal year of the first fix.
        start: Place in the map of the first fix that fits [m], shape (3,), where it is told; None
            puts the origin there.

    Returns:
        None where neither a place is given nor a fix is good.

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
            # Above the sea or above the ellipsoid: the receiver's count is the one that comes back.
            counted = float(altitudes[0]) - float(start[2])
            if abs(counted - altitude) > _MAX_HEIGHT_ERROR:
                reference = reference.model_copy(update={"altitude": counted})
                source += f", but altitude {counted:.0f} m by the fixes instead of {altitude:.0f} m"
    elif start is not None:
        reference = _shifted(reference, start)
        source += ", at the start that is told"
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
    """Return a datum with the field that is given, and by the model what is not."""
    told = {name: given[name] for name in sorted(_FIELD & set(given))}
    sources = [f"given ({', '.join(told)})"] if told else []
    fields: dict[str, float] = {}
    if len(told) < len(_FIELD):
        model = magnetic_field(
            reference.latitude_deg, reference.longitude_deg, reference.altitude or 0.0, year
        )
        fields = {
            "declination_deg": model.declination_deg,
            "inclination_deg": model.inclination_deg,
            "field": model.flux_density,
        }
        sources.append(model.source)
    loose = not {"inclination_deg", "field"} <= set(told)
    return Datum(reference.model_copy(update=fields | told), source, "; ".join(sources), loose)


def check_distance(reference: GeoReference, fixes: NDArray[np.float64], source: str) -> None:
    """Refuse fixes that lie far from a datum that is told, whatever their altitude.

    Args:
        reference: The datum.
        fixes: The first rows as in ``SensorReadings.gnss``, shape (k, 5).
        source: Teller of the datum.

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
