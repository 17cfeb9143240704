"""What comes out of a replay: beside what came out then, and how sure the robot was of it."""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Localizer
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.navigation.navigator import Step
from andabata.records.bag_reader import Period

LEFT_OUT_SHARE = 0.01
"""Share of a sense's messages that may be refused before data count as left out."""

_SHOWN = 8
"""Remarks that are shown as text; JSON has all."""


@dataclass
class Comparison:
    """What came out of a replay beside what came out then.

    Attributes:
        periods: Control periods.
        scans: Control periods with a virtual scan now.
        recorded_scans: Those with a recorded one.
        compared_scans: Those with both.
        differing_scans: Those with one of the two, or two that differ.
        differing_commands: Recorded commands that differ from the present ones.
        moving: Periods in which the robot is told to move.
        unequal_sectors: Sectors of compared scans that differ.
        sectors: Sectors of the present scans.
        unknown_sectors: Sectors of the present scans of which nothing is known.
    """

    periods: int = 0
    scans: int = 0
    recorded_scans: int = 0
    compared_scans: int = 0
    differing_scans: int = 0
    differing_commands: int = 0
    moving: int = 0
    unequal_sectors: int = 0
    sectors: int = 0
    unknown_sectors: int = 0
    _compared_sectors: int = field(default=0, repr=False)

    def add(self, period: Period, step: Step) -> None:
        """Compare one period."""
        self.periods += 1
        self.moving += step.wheels != WheelSpeeds(0.0, 0.0)
        ranges = None if step.view is None else step.view.scan.ranges
        self.scans += ranges is not None
        if ranges is not None:
            self.sectors += len(ranges)
            self.unknown_sectors += int(np.isnan(ranges).sum())
        self.recorded_scans += period.ranges is not None
        if ranges is not None and period.ranges is not None:
            self._compare(ranges, period.ranges)
        elif period.wheels is not None:
            self.differing_scans += (ranges is None) != (period.ranges is None)
        if period.wheels is not None:
            self.differing_commands += step.wheels != period.wheels

    def _compare(self, ranges: NDArray[np.float32], recorded: NDArray[np.float32]) -> None:
        """Compare two virtual scans."""
        self.compared_scans += 1
        if ranges.shape != recorded.shape:
            self.differing_scans += 1
            return
        with np.errstate(invalid="ignore"):
            unequal = (ranges != recorded) & ~(np.isnan(ranges) & np.isnan(recorded))
        self.differing_scans += bool(unequal.any())
        self.unequal_sectors += int(unequal.sum())
        self._compared_sectors += len(ranges)

    def as_dict(self) -> dict[str, Any]:
        """Return the figures, ready for JSON."""
        compared = self._compared_sectors
        return {
            "periods": self.periods,
            "scans": self.scans,
            "recorded_scans": self.recorded_scans,
            "compared_scans": self.compared_scans,
            "differing_scans": self.differing_scans,
            "differing_sectors": self.unequal_sectors / compared if compared else None,
            "differing_commands": self.differing_commands,
            "moving_periods": self.moving,
            "unknown_share": self.unknown_sectors / self.sectors if self.sectors else None,
        }


@dataclass
class Confidence:
    """How sure the localizer was, period by period.

    Attributes:
        health: Number of periods by health.
        complaints: Number of periods by complaint, without the numbers in it.
        counts: Believed, gated and refused measurements by sensor.
    """

    health: Counter[str] = field(default_factory=Counter)
    complaints: Counter[str] = field(default_factory=Counter)
    counts: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def add(self, localizer: Localizer) -> None:
        """Take in a period."""
        self.health[str(localizer.health)] += 1
        for text in getattr(localizer, "complaints", ()):
            self.complaints[re.sub(r" (for|by) [\d.]+.*", "", text)] += 1

    def end(self, localizer: Localizer) -> None:
        """Take in the counts of a drive that is over."""
        for name, row in getattr(localizer, "counts", {}).items():
            old = self.counts.get(name, (0,) * len(row))
            self.counts[name] = tuple(a + b for a, b in zip(old, row, strict=True))


def left_out(data: dict[str, Any], messages: Mapping[str, int], overlaps: int) -> list[str]:
    """Return which data of a recording were left out, in words; nothing for next to nothing.

    Args:
        data: Result of a replay.
        messages: Number of messages by our topics.
        overlaps: Number of parts between pieces that were left out.
    """
    found = [
        f"{sense}: {number} of {messages.get(sense, number)} messages refused"
        for sense, reasons in data["refused_by_reason"].items()
        if (number := sum(reasons.values())) > LEFT_OUT_SHARE * messages.get(sense, number)
    ]
    pieces = data["pieces"]
    if len(pieces) > 1:
        found.append(f"clock: {len(pieces)} pieces are replayed, and nothing between them")
    if overlaps:
        found.append(f"clock: {overlaps} parts that are too short, or lie mixed")
    failed = sum(piece["reason"] is not None for piece in pieces)
    if failed:
        found.append(f"{failed} of {len(pieces)} pieces: no start is known")
    return found


class NoScanError(ValueError):
    """A replay without a single virtual scan."""


def no_scan_reason(data: dict[str, Any]) -> str:
    """Return why a replay made no scan, on one line."""
    reasons = [
        f"{sense}: {number} messages refused ({reason})"
        for sense, found in data["refused_by_reason"].items()
        for reason, number in found.items()
    ]
    reasons += [f"localizer: {text}" for text in data["complaints"]]
    reasons += [text for text in data["left_out"] if text.startswith("clock")]
    reasons += [piece["reason"] for piece in data["pieces"] if piece["reason"]]
    if not reasons:
        reasons.append(f"{data['laser']} made no whole cloud in {data['periods']} periods")
    return f"expected at least one virtual scan, got none: {'; '.join(reasons)}"


def summary_text(data: dict[str, Any]) -> str:
    """Return the result of a replay for people."""
    lines = [
        f"{data['periods']} control periods, {data['scans']} virtual scans: "
        f"{data['differing_scans']} of {data['recorded_scans']} recorded scans and "
        f"{data['differing_commands']} commands differ"
    ]
    total = sum(data["health"].values())
    if total:
        order = ("ok", "degraded", "lost")
        shares = [
            f"{h} {_percent(data['health'][h] / total)}" for h in order if h in data["health"]
        ]
        lines.append(f"health: {', '.join(shares)}")
    if data["complaints"]:
        told = [f"{text} ({_percent(n / total)})" for text, n in data["complaints"].items()]
        lines.append(f"complaints: {', '.join(told)}")
    if data["unknown_share"] is not None:
        lines.append(f"unknown: {_percent(data['unknown_share'])} of the sectors")
    if len(data["pieces"]) > 1:
        told = [f"{piece['seconds']:.1f} s" for piece in data["pieces"]]
        lines.append(f"pieces: {len(told)}, each from a start of its own ({', '.join(told)})")
    lines += [f"remark: {text}" for text in data["remark_texts"][:_SHOWN]]
    more = len(data["remark_texts"]) - _SHOWN
    if more > 0:
        lines.append(f"remark: {more} more, see --json")
    lines += [f"left out: {text}" for text in data["left_out"]]
    return "\n".join(lines)


def _percent(share: float) -> str:
    """Return a share in per cent; what is little is not nothing."""
    return "< 1 %" if 0 < share < 0.01 else f"{100 * share:.0f} %"
