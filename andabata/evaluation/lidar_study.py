"""Study of a laser: a fixed policy while the laser is moved on the robot, turned and changed.

Every pose and kind drives the same tasks as the laser as it is, so that differences are those of
pairs. Zhang et al. (arXiv 2010.10209, section IV-C) compare two poses so, without an interval.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import NormalDist
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from andabata.engine import Engine
from andabata.evaluation.room_table import CellResult
from andabata.evaluation.rooms import OnCell, RoomEvaluationConfig, drive_cells
from andabata.evaluation.statistics import (
    Z95,
    Difference,
    clustered_interval,
    paired_difference,
)
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.navigation.planar.lidar_map import LidarMapConfig
from andabata.tasks.rooms.spn_config import SpnConfig
from andabata.tasks.terminations import Outcome
from rl.policy import Policy

Row = dict[str, Any]

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
        found: dict[str, LidarChange] = {}
        for change in (LidarChange(AS_IT_IS, 0.0, "", base), *moved, *others):
            found.setdefault(change.lidar.label, change)
        return tuple(found.values())

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


def study_lidar(
    config: LidarStudyConfig,
    policies: Mapping[str, Policy],
    engine: Engine | None = None,
    journal: Path | None = None,
    on_cell: OnCell | None = None,
) -> LidarStudy:
    """Drive every laser of a study and compare each with the laser as it is.

    Args:
        config: Settings.
        policies: Policies by name, such as several seeds.
        engine: Engine that runs the cells, on which the result does not depend; None for this
            process.
        journal: Journal of the drives; see ``drive_cells``.
        on_cell: Function that is called with each cell and its drives.

    Raises:
        ValueError: As ``drive_cells``.
    """
    results = drive_cells(config.cells, policies, engine, journal, on_cell)
    driven = [(change, _Drives.of(results, change, policies)) for change in config.changes]
    base = driven[0][1]
    poses = [(change, drives.successes) for change, drives in driven if change.name in POSES]
    rows = [_row(change, drives, base) for change, drives in driven]
    return LidarStudy(rows, mounting_advice(base.successes, poses))


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
    found = [(change.text, paired_difference(base, there, z)) for change, there in poses]
    counted = f"with 95 % confidence in all {len(poses)} poses at once"
    worse = [f"{text} {_points(gain)}" for text, gain in found if gain.high < 0]
    ending = f" Worse: {'; '.join(worse)}." if worse else ""
    better = [each for each in found if each[1].low > 0]
    if better:
        text, gain = max(better, key=lambda each: each[1].low)
        return f"Mount it {text}: success changes by {_points(gain)}, {counted}.{ending}"
    text, gain = max(found, key=lambda each: each[1].mean)
    return (
        f"No pose is shown to be better than the laser as it is: {text} changes success by "
        f"{_points(gain)}, {counted}.{ending}"
    )


def _points(gain: Difference) -> str:
    """Return a difference of rates in words."""
    return f"{100 * gain.mean:+.1f} points ({100 * gain.low:+.1f} to {100 * gain.high:+.1f})"


class _Drives(NamedTuple):
    """Drives of a laser.

    Attributes:
        outcomes: Outcome of each, shape (policies, tasks), rooms one after the other.
        rooms: Room of each task, shape (tasks,).
    """

    outcomes: NDArray[np.str_]
    rooms: NDArray[np.str_]

    @property
    def successes(self) -> NDArray[np.bool_]:
        """True where the goal was reached, shape (policies, tasks)."""
        return self.outcomes == str(Outcome.GOAL)

    @classmethod
    def of(
        cls, results: Sequence[CellResult], change: LidarChange, policies: Mapping[str, Policy]
    ) -> "_Drives":
        """Return the drives of a laser."""
        mine = [result for result in results if result.cell.lidar == change.lidar.label]
        outcomes = [
            [str(end) for result in mine if result.cell.policy == name for end in result.outcomes]
            for name in policies
        ]
        first = next(iter(policies))
        rooms = [
            result.cell.room
            for result in mine
            if result.cell.policy == first
            for _ in result.outcomes
        ]
        return cls(np.array(outcomes), np.array(rooms))


def _row(change: LidarChange, drives: _Drives, base: _Drives) -> Row:
    """Return the row of a laser; of the one as it is without differences."""
    reached, ends = drives.successes, drives.outcomes
    low, high = clustered_interval(reached)
    row: Row = {
        "change": change.name,
        "value": change.value,
        "unit": change.unit,
        "text": change.text,
        "lidar": change.lidar.label,
        "trials": reached.size,
        "successes": int(reached.sum()),
        "collisions": int((ends == str(Outcome.COLLISION)).sum()),
        "timeouts": int((ends == str(Outcome.TIMEOUT)).sum()),
        "success_rate": float(reached.mean()),
        "success_low": low,
        "success_high": high,
        "difference": None,
        "difference_low": None,
        "difference_high": None,
        "by_room": {},
    }
    if change.name == AS_IT_IS:
        return row
    gain = paired_difference(base.successes, reached, Z95)
    rooms = dict.fromkeys(drives.rooms.tolist())
    return row | {
        "difference": gain.mean,
        "difference_low": gain.low,
        "difference_high": gain.high,
        "by_room": {
            room: paired_difference(
                base.successes[:, base.rooms == room], reached[:, drives.rooms == room]
            ).mean
            for room in rooms
        },
    }


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
