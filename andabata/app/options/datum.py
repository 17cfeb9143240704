"""Datum of the map from ``--datum``, and notes on the one that a replay used."""

from collections.abc import Mapping
from typing import Any

from andabata.configuration.usage import UsageError, numbers
from andabata.localization.datum import Datum
from andabata.machine.geo_reference import GeoReference

_FIELDS = ("latitude_deg", "longitude_deg", "altitude")


def datum_fields(text: str | None) -> dict[str, float]:
    """Return the fields of ``GeoReference`` that ``--datum LAT,LON[,ALT]`` gives, none without it.

    Raises:
        UsageError: If it is not two or three finite numbers, or out of bounds.
    """
    if text is None:
        return {}
    count = 3 if text.count(",") > 1 else 2
    try:
        fields = dict(zip(_FIELDS, numbers(text, count, "--datum"), strict=False))
        GeoReference(**fields)
    except ValueError as error:
        raise UsageError(
            "--datum: expected LAT,LON or LAT,LON,ALT in degrees and metres, latitude within 89, "
            f"longitude within 180, altitude from -500 to 9000, got {text!r}"
        ) from error
    return fields


def datum_overrides(text: str | None) -> tuple[str, ...]:
    """Return the settings of ``--datum LAT,LON[,ALT]``, as ``--set`` writes them.

    Raises:
        UsageError: If it is not two or three finite numbers, or out of bounds.
    """
    return tuple(
        f"sensing.geo_reference.{name}={value!r}" for name, value in datum_fields(text).items()
    )


def datum_notes(data: Mapping[str, Any]) -> list[str]:
    """Return notes on the datum of a replay, none if the recording gave it."""
    datum = Datum.from_dict(data)
    return [] if datum.source == "the recording" else list(datum.notes)
