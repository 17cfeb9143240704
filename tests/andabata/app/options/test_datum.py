"""Datum from an option: bounds, and the settings that it stands for."""

import pytest

from andabata.app.options.datum import datum_overrides
from andabata.configuration.usage import UsageError

PREFIX = "sensing.geo_reference."


def test_two_or_three_numbers_are_settings():
    """Latitude, longitude and, if given, altitude are set in this order."""
    two = (f"{PREFIX}latitude_deg=40.5", f"{PREFIX}longitude_deg=-3.25")
    assert datum_overrides("40.5,-3.25") == two
    assert datum_overrides("40.5,-3.25,600") == (*two, f"{PREFIX}altitude=600.0")
    assert datum_overrides(None) == ()


@pytest.mark.parametrize("text", ["40", "90,0", "0,181", "0,0,9001", "0,0,1,2", "a,b", ""])
def test_a_wrong_datum_is_a_usage_error(text):
    """A wrong count or a place out of bounds is refused with the expected form."""
    with pytest.raises(UsageError, match="--datum: expected LAT,LON or LAT,LON,ALT"):
        datum_overrides(text)
