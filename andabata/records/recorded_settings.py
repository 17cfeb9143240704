"""Settings of a recorded drive, which our recordings hold as JSON in their diagnostics."""

import json
from collections.abc import Mapping
from typing import Any

from andabata.records.bags import BagError
from andabata.records.recorder import SETUP
from andabata.records.topics import RosMessage

RENAMED_KEYS: Mapping[str, str] = {
    "rig": "simulated_robot",
    "rig.local_map": "simulated_robot.local_planner",
    "rig.sensing.site": "simulated_robot.sensing.geo_reference",
    "area": "geofence",
    "models.squares": "models.ground_classifier",
}
"""Keys of older versions as dotted paths, and their names of this version."""

RENAMED_CONTROLLERS: Mapping[str, str] = {
    "learned": "policy+planner",
    "learned-map": "policy",
    "straight+map": "planner",
    "reactive+map": "reactive+planner",
}
"""Controllers of older versions, and their names of this version."""


def diagnostic_values(message: RosMessage) -> dict[str, str]:
    """Return the values of a diagnostics message by their keys."""
    return {pair.key: pair.value for status in message.status for pair in status.values}


def parse_settings(message: RosMessage, source: str) -> dict[str, Any]:
    """Return the settings in a diagnostics message, empty without any.

    Args:
        message: Diagnostics of the recording.
        source: Recording and topic, for the error.

    Raises:
        BagError: If an older version recorded them; the message names the old and the new words.
    """
    text = diagnostic_values(message).get(SETUP)
    if text is None:
        return {}
    try:
        settings = json.loads(text)
    except ValueError:
        return {}
    if not isinstance(settings, dict):
        return {}
    _refuse_renamed(settings, source)
    return settings


def _refuse_renamed(settings: Mapping[str, Any], source: str) -> None:
    """Refuse settings with keys of an older version.

    Raises:
        BagError: If there are some.
    """
    words = [
        f"{old!r} (now {new!r})"
        for old, new in RENAMED_KEYS.items()
        if _holds(settings, old.split("."))
    ]
    if not words:
        return
    found = f"the key{'s' if len(words) > 1 else ''} {', '.join(words)}"
    controller = str(settings.get("controller"))
    if controller in RENAMED_CONTROLLERS:
        new = RENAMED_CONTROLLERS[controller]
        found += f" and the controller {controller!r} (now {new!r})"
    raise BagError(
        f"{source}: expected settings of this version, got {found}; record it again, replay it "
        "with the version that recorded it, or replay a copy without this topic, with --controller "
        "and --set"
    )


def _holds(settings: object, path: list[str]) -> bool:
    """Return whether settings hold a key, given as the keys that lead to it."""
    for key in path:
        if not isinstance(settings, Mapping) or key not in settings:
            return False
        settings = settings[key]
    return True
