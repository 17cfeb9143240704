"""Sources of the frames: which topic and node publishes the pose of each, and whether they agree.

tf2 takes whichever transform of a frame came last. A recorder that starts later, or a driver that
sends its own frame beside the URDF's, then decides where a laser looks; so poses that contradict
each other are refused here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.records.frames.transform import (
    MAX_SHIFT,
    MAX_TURN,
    Transform,
    differ,
    mounting_numbers,
    pose_difference,
)
from andabata.records.sources import MOST_NAMED, SourceDifference, Sources

_AGREEMENT = f"{100 * MAX_SHIFT:.0f} cm and {np.rad2deg(MAX_TURN):.0f} degrees"
"""Bounds of poses that agree, in words."""


@dataclass(frozen=True)
class FrameSource:
    """Source of a transform.

    Attributes:
        topic: ``/tf_static`` or ``/tf``.
        node: Name of the publishing node; empty if it is unknown.
    """

    topic: str
    node: str

    @property
    def is_static(self) -> bool:
        """True if it came by /tf_static."""
        return self.topic == "/tf_static"

    def __str__(self) -> str:
        """Return topic and node in words."""
        return f"{self.topic} of {self.node}" if self.node else self.topic


@dataclass
class _Poses:
    """Poses of one frame by source: the last one of each, and whether any of them moves."""

    sources: Sources = field(default_factory=Sources)
    last: dict[FrameSource, Sequence[float]] = field(default_factory=dict)
    fault: str | None = None


class FrameSources:
    """Judges the sources of every frame by the rule of ``andabata.records.sources``."""

    def __init__(self) -> None:
        """Create a judge without frames."""
        self._poses: dict[str, _Poses] = {}
        self._selves: dict[str, None] = {}
        self._updates: dict[str, None] = {}

    def ignore_self(self, name: str) -> None:
        """Note a transform of a frame to itself."""
        self._selves[name] = None

    def add(
        self, parent: str, child: str, source: FrameSource, numbers: Sequence[float]
    ) -> str | None:
        """Add a transform and return why the frame has no pose, None where nothing contradicts.

        A named node may correct its own static transform: its last one holds.

        Args:
            parent: Name of the parent frame.
            child: Name of the frame.
            source: Source of the transform.
            numbers: Position x, y, z [m] and quaternion x, y, z, w.
        """
        poses = self._poses.setdefault(child, _Poses())
        others = [each for each in poses.last if each != source]
        before = poses.last.get(source)
        poses.last[source] = tuple(numbers)
        if before is not None and source.is_static and differ(before, numbers):
            if source.node or not _contradict(before, numbers):
                text = f"the transform from {child} to {parent} was published twice and differs"
                self._updates[f"{text}; the last is used"] = None
            else:
                poses.fault = poses.fault or _two_poses(parent, source, before, source, numbers)
        if not others:
            poses.sources.add(str(source))
            return poses.fault
        other = others[0]
        poses.sources.add(str(source), _difference(poses.last[other], numbers))
        if poses.fault is None and _contradict(poses.last[other], numbers):
            poses.fault = _two_poses(parent, other, poses.last[other], source, numbers)
        return poses.fault

    @property
    def remarks(self) -> list[str]:
        """Remarks on updates, on frames with several sources and on ignored ones, a line each."""
        lines = list(self._updates)
        shared: dict[str, list[str]] = {}
        for child, poses in self._poses.items():
            names = " and ".join(sorted(poses.sources.counts))
            if poses.fault:
                text = f"have two poses by {names}, which contradict each other"
                shared.setdefault(text, []).append(child)
            elif poses.sources.is_shared:
                text = f"come from {names}, which agree within {_AGREEMENT}"
                shared.setdefault(text, []).append(child)
        lines += [f"frames that {text}: {_listed(names)}" for text, names in shared.items()]
        if self._selves:
            lines.append(f"transforms of a frame to itself are ignored: {_listed(self._selves)}")
        return lines


def returning_text(parent: str, one: Sequence[float], other: Sequence[float]) -> str:
    """Return why a frame whose transforms jump to and fro has no pose.

    Args:
        parent: Name of the parent frame.
        one: Position x, y, z [m] and quaternion x, y, z, w of a transform.
        other: Position and quaternion of the transform that it alternates with.
    """
    values = f"{_in_words(one)} and {_in_words(other)}"
    return f"expected one pose on {parent}, got two in turn: {values}; stop one of two publishers"


def _difference(one: Sequence[float], other: Sequence[float]) -> SourceDifference:
    """Return the difference of two poses."""
    shift, turn = pose_difference(one, other)
    text = f"{shift:.2f} m and {np.rad2deg(turn):.0f} degrees"
    return SourceDifference(max(shift / MAX_SHIFT, turn / MAX_TURN), text)


def _contradict(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two poses of one frame differ by more than the bound."""
    return _difference(one, other).share > 1


def _two_poses(
    parent: str,
    one: FrameSource,
    first: Sequence[float],
    other: FrameSource,
    second: Sequence[float],
) -> str:
    """Return why a frame with two poses has none."""
    return (
        f"expected one pose on {parent}, got two that differ by {_difference(first, second).text}: "
        f"{_in_words(first)} by {one} and {_in_words(second)} by {other} "
        "(x, y, z in m, roll, pitch, yaw in degrees)"
    )


def _in_words(numbers: Sequence[float]) -> str:
    """Return a pose as ``--mounting`` takes it."""
    pose = Transform(Rotation.from_quat(numbers[3:]), np.array(numbers[:3]))
    return ",".join(f"{number:.3g}" for number in mounting_numbers(pose))


def _listed(names: Sequence[str] | dict[str, None]) -> str:
    """Return the first names, and the number of the others."""
    shown = list(names)[:MOST_NAMED]
    more = len(names) - len(shown)
    return ", ".join(shown) + (f" and {more} more" if more else "")
