"""Result of a replay: differences from the recorded output, and the localizer's health."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.localization.estimator_status import without_numbers
from andabata.localization.localizer import Health, Localizer, health_after
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.navigation.navigator import StepResult
from andabata.records.bag_reader import Period

LEFT_OUT_SHARE = 0.01
"""Share of a sensor's messages above which refused ones count as left out."""

_SHOWN_REMARKS = 8
"""Number of remarks in the text; JSON has all."""

_HEALTH_ORDER = tuple(str(health) for health in Health)


@dataclass
class RecordedComparison:
    """Counts of equal and different output, present and recorded.

    Attributes:
        periods: Number of control periods.
        scans: Number of periods with a present virtual scan.
        recorded_scans: Number of periods with a recorded virtual scan.
        compared_scans: Number of periods with both.
        differing_scans: Number of periods with one of the two, or with two that differ.
        differing_commands: Number of recorded commands that differ from the present ones.
        moving: Number of periods with a present command other than a standstill.
        unequal_sectors: Number of sectors of compared scans that differ.
        sectors: Number of sectors of the present scans.
        unknown_sectors: Number of sectors of the present scans that are unknown.
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

    def add(self, period: Period, result: StepResult) -> None:
        """Compare the present step with the recorded control period.

        Args:
            period: Recorded control period.
            result: Navigator's step for its readings.
        """
        ranges = None if result.scan is None else result.scan.ranges
        self.periods += 1
        self._add_scan(ranges, period)
        self._add_command(result.wheels, period.wheels)

    def _add_scan(self, ranges: NDArray[np.float32] | None, period: Period) -> None:
        """Compare the present virtual scan [m], shape (n_sectors,), with the recorded one."""
        self.recorded_scans += period.ranges is not None
        if ranges is not None:
            self.scans += 1
            self.sectors += len(ranges)
            self.unknown_sectors += int(np.isnan(ranges).sum())
        if ranges is not None and period.ranges is not None:
            self._compare(ranges, period.ranges)
        elif period.wheels is not None:  # The recorded navigator was running.
            self.differing_scans += (ranges is None) != (period.ranges is None)

    def _add_command(self, wheels: WheelSpeeds, recorded: WheelSpeeds | None) -> None:
        """Compare the present wheel speeds with the recorded ones."""
        self.moving += wheels != WheelSpeeds(0.0, 0.0)
        if recorded is not None:
            self.differing_commands += wheels != recorded

    def _compare(self, ranges: NDArray[np.float32], recorded: NDArray[np.float32]) -> None:
        """Compare two virtual scans [m]; NaN, an unknown sector, equals NaN."""
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
        """Return the counts and shares, ready for JSON."""
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
class LocalizerStatistics:
    """Health, complaints and measurement counts of a localizer over a replay.

    Attributes:
        health: Number of periods by health.
        complaints: Number of periods by complaint, without the numbers in its text.
        counts: Numbers of accepted, gated and refused measurements by sensor.
    """

    health: Counter[str] = field(default_factory=Counter)
    complaints: Counter[str] = field(default_factory=Counter)
    counts: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def add(self, localizer: Localizer) -> None:
        """Add a control period."""
        self.health[str(localizer.health)] += 1
        for text in getattr(localizer, "warnings", ()):
            self.complaints[without_numbers(text)] += 1

    def health_after(self, has_failures: bool) -> dict[str, int]:
        """Return the number of periods by health; with a failed check none of them is ok.

        Args:
            has_failures: True if a check of the sensors against each other failed.
        """
        counts = Counter[str]()
        for health, periods in self.health.items():
            counts[str(health_after(Health(health), has_failures))] += periods
        return dict(counts)

    def end(self, localizer: Localizer) -> None:
        """Add the measurement counts of a piece at its end."""
        for name, row in getattr(localizer, "counts", {}).items():
            old = self.counts.get(name, (0,) * len(row))
            self.counts[name] = tuple(a + b for a, b in zip(old, row, strict=True))


@dataclass
class PieceReport:
    """Outcome of one piece of a recording.

    Attributes:
        begin_s: Time from the begin of the first piece [s].
        seconds: Duration [s].
        scans: Number of virtual scans.
        reason: Reason why it was not replayed; None if it was.
    """

    begin_s: float
    seconds: float
    scans: int = 0
    reason: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the report, ready for JSON."""
        return asdict(self)


class NoScanError(ValueError):
    """A replay without a single virtual scan."""


def left_out(data: Mapping[str, Any], messages: Mapping[str, int], skipped: int) -> list[str]:
    """Return which data of a recording were left out, one sentence each.

    Refused messages are listed from ``LEFT_OUT_SHARE`` of a sensor's messages on.

    Args:
        data: Result of a replay.
        messages: Number of messages by our topics.
        skipped: Number of stretches between pieces that were left out.
    """
    sentences = [
        f"{sensor}: {number} of {messages.get(sensor, number)} messages refused"
        for sensor, reasons in data["refused_by_reason"].items()
        if (number := sum(reasons.values())) > LEFT_OUT_SHARE * messages.get(sensor, number)
    ]
    pieces = data["pieces"]
    if len(pieces) > 1:
        sentences.append(f"clock: {len(pieces)} pieces are replayed, and nothing between them")
    if skipped:
        sentences.append(f"clock: {skipped} parts that are too short or overlap others")
    failed = sum(piece["reason"] is not None for piece in pieces)
    if failed:
        sentences.append(f"{failed} of {len(pieces)} pieces: no start is known")
    return sentences


def no_scan_reason(data: Mapping[str, Any]) -> str:
    """Return the reasons why a replay made no virtual scan, on one line."""
    reasons = [
        f"{sensor}: {number} messages refused ({reason})"
        for sensor, counts in data["refused_by_reason"].items()
        for reason, number in counts.items()
    ]
    reasons += [f"localizer: {text}" for text in data["complaints"]]
    reasons += [text for text in data["left_out"] if text.startswith("clock")]
    reasons += [piece["reason"] for piece in data["pieces"] if piece["reason"]]
    if not reasons:
        reasons.append(f"{data['laser']} made no whole cloud in {data['periods']} periods")
    return f"expected at least one virtual scan, got none: {'; '.join(reasons)}"


def summary_text(data: Mapping[str, Any]) -> str:
    """Return the result of a replay as lines of text."""
    lines = [
        f"{data['periods']} control periods, {data['scans']} virtual scans: "
        f"{data['differing_scans']} of {data['recorded_scans']} recorded scans and "
        f"{data['differing_commands']} commands differ"
    ]
    lines += _localizer_lines(data["health"], data["complaints"])
    if data["unknown_share"] is not None:
        lines.append(f"unknown: {_percent(data['unknown_share'])} of the sectors")
    if len(data["pieces"]) > 1:
        durations = [f"{piece['seconds']:.1f} s" for piece in data["pieces"]]
        lines.append(
            f"pieces: {len(durations)}, each from a start of its own ({', '.join(durations)})"
        )
    lines += _remark_lines(data["remark_texts"])
    lines += [f"left out: {text}" for text in data["left_out"]]
    return "\n".join(lines)


def _localizer_lines(health: Mapping[str, int], complaints: Mapping[str, int]) -> list[str]:
    """Return shares of the periods by health and by complaint."""
    lines, total = [], sum(health.values())
    if total:
        shares = [f"{h} {_percent(health[h] / total)}" for h in _HEALTH_ORDER if h in health]
        lines.append(f"health: {', '.join(shares)}")
    if complaints:
        texts = [f"{text} ({_percent(n / total)})" for text, n in complaints.items()]
        lines.append(f"complaints: {', '.join(texts)}")
    return lines


def _remark_lines(texts: tuple[str, ...]) -> list[str]:
    """Return the first remarks, and the number of the others."""
    lines = [f"remark: {text}" for text in texts[:_SHOWN_REMARKS]]
    more = len(texts) - _SHOWN_REMARKS
    return [*lines, f"remark: {more} more, see --json"] if more > 0 else lines


def _percent(share: float) -> str:
    """Return a share in per cent; a share above zero is never shown as zero."""
    return "< 1 %" if 0 < share < 0.01 else f"{100 * share:.0f} %"
