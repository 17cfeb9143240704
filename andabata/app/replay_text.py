"""Results of replays and of live navigation as text for people."""

from collections.abc import Mapping
from typing import Any

from andabata.app.fault_tables import fault_text
from andabata.app.options.datum import datum_notes
from andabata.app.options.mountings import mountings_in_words
from andabata.replay.result import summary_text

Data = Mapping[str, Any]


def replay_notes(data: Data) -> list[str]:
    """Return what a user must know to read the result of a replay."""
    notes = []
    if data["same_models"] is False:
        notes.append("other models drove; scans and commands may differ")
    if data["laser"] != "/2D_scan":
        notes.append(f"cells are made of {data['laser']}")
    return notes + datum_notes(data)


def replay_text(data: Data) -> str:
    """Return the result of a replay and the mountings of its sensors as text."""
    faults = [fault_text(data["faults"])] if data.get("faults") else []
    return "\n".join([summary_text(dict(data)), mountings_in_words(data["frames"]), *faults])


def navigation_text(data: Data) -> str:
    """Return the result of a navigator in a live graph as text."""
    lines = [
        f"{data['commands']} commands, {data['scans']} virtual scans, {data['missed_ticks']} ticks "
        f"missed; the filter is {data['health']}",
        mountings_in_words(data["frames"]),
    ]
    return "\n".join([*lines, *(f"remark: {text}" for text in data["remark_texts"])])
