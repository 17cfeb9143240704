"""Datum of a replay: the one that the user gives, the recorded one, or the first good fix."""

from collections import Counter
from collections.abc import Callable, Mapping

from andabata.assembly.simulated_robot import SimulatedRobotConfig, with_geo_reference
from andabata.localization.datum import Datum, check_distance, make_datum
from andabata.localization.localizer import Localizer
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.machine.magnetic_model import decimal_year
from andabata.records.bags import Bag
from andabata.records.drive_setup import DriveSetup, read_first_fixes
from andabata.records.remarks import Remarks
from andabata.records.topic_selection import Remapping
from andabata.records.topics import FIX

_POSITION = frozenset({"latitude_deg", "longitude_deg", "altitude"})
"""Fields of a ``GeoReference`` that make up its place."""

# Two places that differ in every field: a field that the user leaves open differs between them.
_PROBES = (
    GeoReference(
        latitude_deg=1.0,
        longitude_deg=2.0,
        altitude=3.0,
        declination_deg=4.0,
        inclination_deg=5.0,
        field=6.0,
    ),
    GeoReference(
        latitude_deg=-1.5,
        longitude_deg=-2.5,
        altitude=3.5,
        declination_deg=-4.5,
        inclination_deg=-5.5,
        field=6.5,
    ),
)


def given_geo_reference(
    configure: Callable[[SimulatedRobotConfig], SimulatedRobotConfig],
) -> dict[str, float]:
    """Return the fields of the geo reference that the user's settings fix.

    Args:
        configure: Function that applies the user's settings to a configuration.

    Returns:
        Values by field of ``GeoReference``; fields that the settings leave open are missing.
    """
    first, second = (
        configure(
            with_geo_reference(SimulatedRobotConfig(), probe)
        ).sensing.geo_reference.model_dump()
        for probe in _PROBES
    )
    return {
        name: value for name, value in first.items() if value == second[name] and value is not None
    }


def recorded_datum(
    bag: Bag,
    setup: DriveSetup,
    config: SimulatedRobotConfig,
    given: Mapping[str, float],
    topics: Remapping,
) -> Datum:
    """Return the datum of a recording that names it in its settings.

    Args:
        bag: The recording, or a piece of it.
        setup: Start of the recorded drive.
        config: Configuration with the recorded geo reference.
        given: Fields of ``GeoReference`` that the user gives; they take precedence.
        topics: Names of the recording's topics by ours, where they differ.

    Raises:
        DatumError: If the fixes lie far from it.
    """
    recorded = config.sensing.geo_reference
    fixes, stamp_ns = read_first_fixes(bag, topics)
    if {"latitude_deg", "longitude_deg"} & set(given):
        position = recorded.model_dump(include=set(_POSITION))
        year = decimal_year(stamp_ns or setup.epoch_ns)
        datum = make_datum({**position, **given}, fixes, year)
        return datum or Datum(recorded, "given", "given")
    check_distance(recorded, fixes, "the recording")
    return Datum(recorded, "the recording", "given" if given else "the recording")


def magnetic_flux_density(
    bag: Bag, given: Mapping[str, float], topics: Remapping, config: SimulatedRobotConfig
) -> float:
    """Return the flux density of the magnetic field at the place of a recording [uT].

    Args:
        bag: The recording.
        given: Fields of ``GeoReference`` that the user gives.
        topics: Names of the recording's topics by ours, where they differ.
        config: Configuration; its geo reference counts where it is not the default one.

    Raises:
        DatumError: If the fixes lie far from the datum that is given.
    """
    configured = config.sensing.geo_reference
    if configured != GeoReference():
        return configured.field
    fixes, stamp_ns = read_first_fixes(bag, topics)
    datum = make_datum(given, fixes, decimal_year(stamp_ns)) if stamp_ns else None
    return (configured if datum is None else datum.reference).field


def position_fields(datum: Datum) -> dict[str, float]:
    """Return latitude [deg], longitude [deg] and altitude [m] of a datum by field name.

    An unknown altitude is left out.
    """
    fields = datum.reference.model_dump(include=set(_POSITION))
    return {name: value for name, value in fields.items() if value is not None}


def use_datum(localizer: Localizer, datum: Datum) -> None:
    """Refer a filter's fixes and magnetic measurements to a datum; others need none."""
    if isinstance(localizer, UkfLocalizer):
        localizer.set_geo_reference(datum.expected, datum.heading_only)


def add_fix_remarks(
    remarks: Remarks, localizer: Localizer, before: Mapping[str, int] | None = None
) -> None:
    """Add the numbers of fixes that a localizer has refused or completed by assumptions.

    Args:
        remarks: Remarks of the drive, extended.
        localizer: Localizer after the drive.
        before: Numbers of fixes refused before its start, by reason.
    """
    refused = Counter(before or {}) + Counter(getattr(localizer, "rejected_fixes", {}))
    for reason, number in refused.items():
        remarks.refuse(FIX.ros1, reason, number=number)
    for text, number in getattr(localizer, "assumed_fixes", {}).items():
        remarks.count(FIX.ros1, text, number=number)
