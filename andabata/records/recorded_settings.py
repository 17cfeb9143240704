"""Settings of a recorded drive, which our recordings hold as JSON in their diagnostics."""

import json
from typing import Any

from andabata.records.recorder import SETUP
from andabata.records.topics import RosMessage


def diagnostic_values(message: RosMessage) -> dict[str, str]:
    """Return the values of a diagnostics message by their keys."""
    return {pair.key: pair.value for status in message.status for pair in status.values}


def parse_settings(message: RosMessage) -> dict[str, Any]:
    """Return the settings in a diagnostics message, empty without any."""
    text = diagnostic_values(message).get(SETUP)
    if text is None:
        return {}
    try:
        settings = json.loads(text)
    except ValueError:
        return {}
    return settings if isinstance(settings, dict) else {}
