"""Study of a laser: a fixed policy while the laser is moved on the robot, turned and changed.

Every pose and kind drives the same tasks as the laser as it is, so that differences are those of
pairs. Zhang et al. (arXiv 2010.10209, section IV-C) compare two poses so, without an interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from andabata.evaluation.room_drives import RoomAttempt
from andabata.evaluation.rooms import RoomEvaluationConfig
from andabata.evaluation.statistics import Difference, paired_difference
from andabata.evaluation.table import (
    Design,
    Row,
    Sample,
    Table,
    by_contender,
    by_task,
    counts,
    is_success,
    pair,
    row_of,
    share,
    share_difference,
)
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.terminations import Outcome

DEVELOPMENT = tuple(f"random-{k}" for k in range(7300, 7308))
"""Random rooms to develop in: nothing is trained in them, nor judged."""

POSES = {"forward": ("x", "m"), "left": ("y", "m"), "turned": ("yaw_deg", "deg")}
"""Field and unit of each way of mounting the laser otherwise."""

KINDS = {
    "field of view": ("fov_deg", "deg"),
    "resolution": ("resolution_deg", "deg"),
    "range": ("max_range", "m"),
}
"""Field and unit of each way in which another laser differs."""

AS_IT_IS = "as it is"
"""Name of the laser without a change."""


class LidarStudyConfig(BaseModel):
    """Settings of a study.

    Attributes:
        lidar: Laser as it is, by name or label.
        forward: Distances that it is moved ahead [m].
        left: Distances that it is moved to the left [m].
        turned: Angles that it is turned by, counter-clockwise [deg].
        fov_deg: Other fields of view [deg].
        resolution_deg: Other angles between beams [deg].
        max_range: Other ranges [m].
        rooms: Names of the rooms.
        memory: ``reactive`` or ``map``; see ``RoomEvaluationConfig``.
        pairs: Number of random starts and goals in each room; 0 takes its fixed tasks.
        seed: Seed of starts and goals.
        task: Settings of the drives.
        map: Settings of the map.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    lidar: str = "ten-beams"
    forward: tuple[float, ...] = (-0.1, -0.05, 0.05, 0.1, 0.15)
    left: tuple[float, ...] = (0.05, 0.1)
    turned: tuple[float, ...] = (5.0, 10.0)
    fov_deg: tuple[float, ...] = (120.0, 270.0, 360.0)
    resolution_deg: tuple[float, ...] = (1.0, 5.0, 10.0, 30.0)
    max_range: tuple[float, ...] = (2.0, 5.0)
    rooms: tuple[str, ...] = Field(default=DEVELOPMENT, min_length=1)
    memory: Literal["reactive", "map"] = "reactive"
    pairs: int = Field(default=100, ge=0)
    seed: int = Field(default=0, ge=0)
    task: SpnConfig = Field(default_factory=SpnConfig)
    map: LidarMapConfig = Field(default_factory=LidarMapConfig)

    @model_validator(mode="after")
    def _check_changes(self) -> Self:
        """Refuse a laser that cannot be, and changes into such."""
        _ = self.changes
        return self

    @property
    def changes(self) -> "tuple[LidarChange, ...]":
        """Lasers of the study: as it is, then each change, those that change nothing left out."""
        base = PlanarLidarConfig.parse(self.lidar)
        moved = [
            LidarChange(name, value, unit, _with(base, field, getattr(base, field) + value))
            for name, (field, unit) in POSES.items()
            for value in getattr(self, name)
        ]
        others = [
            LidarChange(name, value, unit, _with(base, field, value))
            for name, (field, unit) in KINDS.items()
            for value in getattr(self, field)
        ]
        # By label: a value that the laser has already would be compared with itself.
        changes_by_label: dict[str, LidarChange] = {}
        for change in (LidarChange(AS_IT_IS, 0.0, "", base), *moved, *others):
            changes_by_label.setdefault(change.lidar.label, change)
        return tuple(changes_by_label.values())

    @property
    def cells(self) -> RoomEvaluationConfig:
        """Settings of the cells that the study drives."""
        return RoomEvaluationConfig(
            rooms=self.rooms,
            lidars=tuple(change.lidar.label for change in self.changes),
            memories=(self.memory,),
            pairs=self.pairs,
            seed=self.seed,
            task=self.task,
            map=self.map,
        )


@dataclass(frozen=True)
class LidarChange:
    """A laser of the study.

    Attributes:
        name: Name of the change.
        value: Value of what is changed; of a pose its difference.
        unit: Unit of the value.
        lidar: Laser with the change.
    """

    name: str
    value: float
    unit: str
    lidar: PlanarLidarConfig

    @property
    def text(self) -> str:
        """The change in words."""
        if self.name == AS_IT_IS:
            return self.name
        if self.name == "turned":
            return f"turned {self.value:+g} {self.unit}"
        if self.name in POSES:
            back = {"forward": "back", "left": "right"}[self.name]
            return f"{abs(self.value):g} {self.unit} {self.name if self.value > 0 else back}"
        return f"{self.name} {self.value:g} {self.unit}"


class LidarStudy(NamedTuple):
    """Result of a study.

    Attributes:
        rows: Row of the laser as it is, then one of each change.
        advice: Where to mount the laser, if the intervals say so.
    """

    rows: list[Row]
    advice: str


def tabulate_study(config: LidarStudyConfig, attempts: Sequence[RoomAttempt]) -> LidarStudy:
    """Return the rows of a study and its advice.

    Args:
        config: Settings.
        attempts: Attempts of the cells of the study.
    """
    samples = {each.attempts[0].detail.lidar: each for each in _TABLE.samples(attempts)}
    driven = [(change, samples[change.lidar.label]) for change in config.changes]
    base = driven[0][1]
    poses = [(change, _successes(base, each)) for change, each in driven if change.name in POSES]
    rows = [_row(change, sample, base) for change, sample in driven]
    return LidarStudy(rows, mounting_advice(_successes(base, base), poses))


def mounting_advice(
    base: NDArray[np.bool_], poses: Sequence[tuple[LidarChange, NDArray[np.bool_]]]
) -> str:
    """Return where to mount a laser, if the intervals say so, else that they do not.

    The intervals are those of 95 % for all poses at once (Bonferroni): the best of many poses gains
    by chance.

    Args:
        base: Successes of the laser as it is, shape (policies, tasks).
        poses: Poses, each with the successes of the laser there.
    """
    if not poses:
        return "No other pose was tried."
    z = NormalDist().inv_cdf(1 - 0.025 / len(poses))
    differences = [(change.text, paired_difference(base, there, z)) for change, there in poses]
    counted = f"with 95 % confidence in all {len(poses)} poses at once"
    worse = [f"{text} {_points(gain)}" for text, gain in differences if gain.high < 0]
    ending = f" Worse: {'; '.join(worse)}." if worse else ""
    better = [each for each in differences if each[1].low > 0]
    if better:
        # The best lower end, not the best mean: of many poses the luckiest has the best mean.
        text, gain = max(better, key=lambda each: each[1].low)
        return f"Mount it {text}: success changes by {_points(gain)}, {counted}.{ending}"
    text, gain = max(differences, key=lambda each: each[1].mean)
    return (
        f"No pose is shown to be better than the laser as it is: {text} changes success by "
        f"{_points(gain)}, {counted}.{ending}"
    )


def _points(gain: Difference) -> str:
    """Return a difference of rates in words."""
    return f"{100 * gain.mean:+.1f} points ({100 * gain.low:+.1f} to {100 * gain.high:+.1f})"


def _successes(base: Sample, sample: Sample) -> NDArray[np.bool_]:
    """Return True where the goal was reached, shape (policies, tasks), tasks as of the base."""
    return pair(base, sample, is_success)[1] > 0


def _ends(sample: Sample) -> Row:
    """Return how many drives there were and how they ended."""
    return {"trials": len(sample.attempts), "successes": sample.count(is_success)}


_TABLE = Table(
    by=lambda attempt: attempt.detail.lidar,
    design=Design(cluster=by_task, repeat=by_contender),
    columns=(
        _ends,
        counts(collisions=Outcome.COLLISION, timeouts=Outcome.TIMEOUT),
        share(),
    ),
)
"""Rows of lasers, all rooms and policies together."""

_GAIN = share_difference("difference")


def _row(change: LidarChange, sample: Sample, base: Sample) -> Row:
    """Return the row of a laser; of the one as it is without differences."""
    about: Row = {
        "change": change.name,
        "value": change.value,
        "unit": change.unit,
        "text": change.text,
        "lidar": change.lidar.label,
    }
    gain: Row = dict.fromkeys(("difference", "difference_low", "difference_high"))
    rooms: Row = {}
    if change.name != AS_IT_IS:
        gain, rooms = _GAIN(base, sample), _by_room(base, sample)
    return about | row_of(_TABLE.columns, sample) | gain | {"by_room": rooms}


def _by_room(base: Sample, sample: Sample) -> dict[str, float]:
    """Return the difference in success in each room."""
    # A pose that helps in one room may cost in another, which the sum hides.
    rooms = dict.fromkeys(attempt.scenario for attempt in sample.attempts)
    return {room: _GAIN(_in(base, room), _in(sample, room))["difference"] for room in rooms}


def _in(sample: Sample, room: str) -> Sample:
    """Return the attempts of a sample in one room."""
    return replace(sample, attempts=[each for each in sample.attempts if each.scenario == room])


def _with(base: PlanarLidarConfig, field: str, value: float) -> PlanarLidarConfig:
    """Return a laser with another value of a field.

    Raises:
        ValueError: If the value is out of its bounds.
    """
    try:
        return PlanarLidarConfig.model_validate(base.model_dump() | {field: value})
    except ValidationError as error:
        reason = error.errors()[0]["msg"]
        raise ValueError(f"laser {base.label} with {field} {value:g}: {reason}") from error
