"""Datum that a user gives: an option of its own, or single fields of ``sensing.geo_reference``."""

from collections import Counter
from collections.abc import Callable, Mapping

from andabata.assembly.simulated_robot import SimulatedRobotConfig, with_geo_reference
from andabata.localization.datum import Datum
from andabata.localization.localizer import Localizer
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.geo_reference import GeoReference
from andabata.records.remarks import Remarks
from andabata.records.topics import FIX

# Two places that differ in every field: what stays different was not given.
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
    """Return the fields of the datum that the user's settings give, whatever they start from.

    Args:
        configure: Puts the user's settings over a configuration.
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


def use_datum(localizer: Localizer, datum: Datum) -> None:
    """Let a filter count from a datum and expect the field there."""
    if isinstance(localizer, UkfLocalizer):
        localizer.refer(datum.expected, datum.loose)


def add_fix_remarks(
    remarks: Remarks, localizer: Localizer, before: Mapping[str, int] | None = None
) -> None:
    """Count the fixes that a localizer has refused, or of which it has assumed something.

    Args:
        remarks: Remarks that they are added to.
        localizer: Any.
        before: Numbers of fixes that were refused before its start, by reason.
    """
    refused = Counter(before or {}) + Counter(getattr(localizer, "refused", {}))
    for reason, number in refused.items():
        remarks.refuse(FIX.ros1, reason, number=number)
    for text, number in getattr(localizer, "assumed", {}).items():
        remarks.count(FIX.ros1, text, number=number)
