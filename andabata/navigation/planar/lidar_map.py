"""Local map of a 2D laser on flat ground: memory for any policy that steers to a goal.

A policy that knows the last scan alone balances in pockets, and with ten beams it meets edges that
lie between two of them. The map remembers hits while the robot moves; the robot's own grid planner
finds a path over them, and the farthest place of the path that can be headed for straight away
takes the goal's place (assumption: SPN, arXiv 2010.10209, has no memory).
"""

import math
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planar.hit_layer import HitLayer, HitLayerConfig, LaserPose
from andabata.navigation.planning.cost_map import CostConfig, CostWeights, Passage
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.grid_planner import GridPlanner

_RIM = 0.02
"""Distance from the robot's edge, inwards, from which on the ground under it is free [m]."""

ON_THE_MIDDLE = LaserPose()
"""Pose of a laser on the robot's middle that faces ahead."""

DISC_RADIUS = 0.2
"""Radius of the robot that ``ROOM_COSTS`` are made for [m]: SPN's."""

ROOM_COSTS = CostConfig(
    inscribed_radius=0.26,
    inflation_radius=0.46,
    inscribed_cost=50.0,
    inflation_cost=1.0,
    unknown_cost=0.0,
    uncertain_cost=0.0,
    lethal_cost=0.0,
)
"""Costs of a metre for a round robot of ``DISC_RADIUS`` in a room. What was not seen counts as
free: a robot that waits to know sees no more."""


class LidarMapConfig(BaseModel):
    """Settings of the map.

    Attributes:
        hits: Settings of the hit layer.
        robot_radius: Radius of the robot [m]; None takes that of the task's robot, 0.2 m without a
            task, and leaves as much room beside it as ``costs`` leave beside one of 0.2 m.
        costs: Costs of a metre.
        replan_every: Number of scans between two plans; a new obstacle on the straight way to the
            sub-goal brings one at once.
        min_lookahead: Distance of the nearest sub-goal [m]: a robot that is nearer has reached it,
            and the next is planned.
        max_lookahead: Distance of the farthest sub-goal [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hits: HitLayerConfig = Field(default_factory=HitLayerConfig)
    robot_radius: float | None = Field(default=None, gt=0)
    costs: CostConfig = ROOM_COSTS
    replan_every: int = Field(default=5, ge=1)
    min_lookahead: float = Field(default=0.3, ge=0)
    max_lookahead: float = Field(default=1.5, gt=0)

    def for_robot(self, radius: float) -> Self:
        """Return the settings for a round robot, with its radius in map and costs.

        Settings that name a radius are those of a robot already, and stay as they are.

        Args:
            radius: Radius of the robot [m].
        """
        if self.robot_radius is not None:
            return self
        wider = radius - DISC_RADIUS
        # A smaller robot gets no radius below its own, unless the costs have one.
        radii = {
            name: max(getattr(self.costs, name) + wider, min(getattr(self.costs, name), radius))
            for name in ("inscribed_radius", "inflation_radius")
        }
        costs = self.costs.model_copy(update=radii)
        return self.model_copy(update={"robot_radius": radius, "costs": costs})


class LidarMap:
    """Remembers the scans of a 2D laser around the robot, and plans sub-goals over them.

    All places are in one frame that does not jump, such as ``odom``.

    Attributes:
        config: Settings, with the radius of the robot.
        hits: Hit layer.
        plan: Costs and cost to go of the last plan; none is needed while the straight way is free.
    """

    def __init__(self, config: LidarMapConfig | None = None, radius: float = DISC_RADIUS) -> None:
        """Begin with an empty map.

        Args:
            config: Settings.
            radius: Radius of the robot, for settings that name none [m].
        """
        self.config = config = (config or LidarMapConfig()).for_robot(radius)
        self.hits = HitLayer(config.hits)
        hits, self._radius = config.hits, config.robot_radius or radius
        self.plan = GridPlanner(
            hits.cells,
            hits.cell,
            CostWeights.of(config.costs, hits.lethal_log_odds, hits.max_log_odds),
            (config.min_lookahead, config.max_lookahead),
            0.0,
            Passage(self._radius, self._radius, self._radius),
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.hits.reset()
        self.plan.reset()
        self._scans = 0
        self._planned_for = np.full(2, np.nan)
        self._subgoal: NDArray[np.float64] | None = None
        self._is_blocked = False

    def update(
        self,
        pose: ArrayLike,
        bearings: NDArray[np.floating],
        ranges: NDArray[np.floating],
        max_range: float,
        laser: LaserPose = ON_THE_MIDDLE,
    ) -> None:
        """Take in a scan. The order of its beams does not matter.

        Args:
            pose: x, y [m] and yaw [rad] of the robot, shape (3,).
            bearings: Bearing of each beam from the laser's heading [rad], shape (b,).
            ranges: Range of each beam from the laser [m], shape (b,). NaN and what is not above 0
                measured nothing.
            max_range: Range from which on a beam has met nothing [m].
            laser: Pose of the laser on the robot.

        Raises:
            ValueError: If there is not one range for each bearing, or the pose, the laser's or a
                bearing is not finite.
        """
        robot = LaserPose(*(float(value) for value in np.asarray(pose, dtype=np.float64)))
        eye, position = laser.on(robot), np.array(robot[:2])
        if bearings.ndim != 1 or bearings.shape != ranges.shape:
            raise ValueError(
                f"ranges: expected one for each bearing, {bearings.shape}, got {ranges.shape}"
            )
        if not (np.isfinite(eye).all() and np.isfinite(bearings).all()):
            raise ValueError(f"pose: expected finite poses and bearings, got {robot}, {laser}")
        self.hits.follow(position)
        new_hits = self.hits.update(eye, bearings, ranges, max_range)
        self.hits.clear(position, self._radius - _RIM)
        target = self._planned_for if self._subgoal is None else self._subgoal
        near = _distances_from_way(new_hits, position, target) < self.config.costs.inscribed_radius
        self._is_blocked = self._is_blocked or bool(near.any())
        self._scans += 1

    def subgoal(
        self, position: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> NDArray[np.float64]:
        """Return the place to head for [m], shape (2,): the goal itself if straight and free.

        Args:
            position: Position of the robot [m], shape (2,).
            goal: Goal [m], shape (2,).

        Raises:
            ValueError: If one of them is not finite.
        """
        here, there = np.asarray(position, dtype=np.float64), np.asarray(goal, dtype=np.float64)
        if not (np.isfinite(here).all() and np.isfinite(there).all()):
            raise ValueError(f"goal: expected finite places [m], got {goal} from {position}")
        if self._is_due(here, there):
            self._subgoal = self._planned(here, there)
            self._planned_for, self._scans, self._is_blocked = there.copy(), 0, False
        return there.copy() if self._subgoal is None else self._subgoal.copy()

    def _planned(
        self, position: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return a new sub-goal [m]; None is the goal itself, straight and free."""
        hits = self.hits
        hits.follow(position)
        # Nothing beside the straight way costs anything: no other can be better, and beyond the
        # square none is known.
        near = _distances_from_way(hits.obstacles, position, goal)
        if (near >= self.config.costs.inflation_radius).all():
            return None
        return self.plan.plan(hits.log_odds, hits.centre, EVERYWHERE, position, goal, hits.places)

    def _is_due(self, position: NDArray[np.float64], goal: NDArray[np.float64]) -> bool:
        """Return True if the last plan is old, for another goal, blocked, or carried out."""
        is_same = math.dist(goal, self._planned_for) <= self.config.hits.cell  # False for NaN.
        if self._is_blocked or self._scans >= self.config.replan_every or not is_same:
            return True
        place = self._subgoal
        return place is not None and math.dist(place, position) < self.config.min_lookahead


def _distances_from_way(
    places: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distances of places from a straight way [m], shape (k,)."""
    along, offsets = end - start, places - start
    shares = np.clip(offsets @ along / max(float(along @ along), 1e-12), 0.0, 1.0)
    return np.asarray(np.hypot(*(offsets - shares[:, None] * along).T))
