"""``--datum``: where on Earth the map lies, as a user gives it."""

from collections.abc import Mapping
from typing import Any

from andabata.app.usage import UsageError, numbers
from andabata.localization.datum import Datum
from andabata.machine.geo_reference import GeoReference

_FIELDS = ("latitude_deg", "longitude_deg", "altitude")


def datum_overrides(text: str | None) -> tuple[str, ...]:
    """Return what ``--datum LAT,LON[,ALT]`` sets, as ``--set`` writes it.

    Raises:
        UsageError: If it is not two or three finite numbers, or no place that can be a datum.
    """
    if text is None:
        return ()
    count = 3 if text.count(",") > 1 else 2
    try:
        found = numbers(text, count, "--datum")
        GeoReference(**dict(zip(_FIELDS, found, strict=False)))
    except ValueError as error:
        raise UsageError(
            "--datum: expected LAT,LON or LAT,LON,ALT in degrees and metres, latitude within 89, "
            f"longitude within 180, altitude from -500 to 9000, got {text!r}"
        ) from error
    return tuple(
        f"sensing.geo_reference.{name}={value!r}"
        for name, value in zip(_FIELDS, found, strict=False)
    )


def datum_notes(data: Mapping[str, Any]) -> list[str]:
    """Return what a user must know of the datum, from a replay's figures."""
    datum = Datum.from_dict(data)
    return [] if datum.source == "the recording" else list(datum.notes)
