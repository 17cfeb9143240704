"""What the planner knows and wants as messages: local map, plan, sub-goal, heading error."""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.localization.localizer import Localizer
from andabata.machine.pose import Pose
from andabata.navigation.controller import Planner
from andabata.navigation.navigator import StepResult
from andabata.navigation.perception import Perception, assembler_of
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.map_layers import MapLayers, map_layers
from andabata.navigation.planning.plan_path import path_of
from andabata.records import map_messages, topics
from andabata.records.messages import MessageBuilder
from andabata.records.topics import RosMessage, Topic

_MAP_PERIOD, _PLAN_PERIOD = 1.0, 0.5
"""Time between two maps, and between two plans [s]."""

_EARLY = 0.05
"""Half a control period [s], by which a message may be early: stamps are rounded."""

Stamped = tuple[Topic, RosMessage]


class PlannerRecorder:
    """Makes the messages of a navigator's planner; of one without, the heading error alone."""

    def __init__(self, localizer: Localizer, perception: Perception, planner: Planner) -> None:
        """Prepare for a drive.

        Args:
            localizer: Localizer of the navigator.
            perception: Perception of the navigator.
            planner: Planner of the navigator.
        """
        self._localizer, self._perception = localizer, perception
        self._planner = planner if isinstance(planner, LocalPlanner) else None
        self._last_map, self._last_plan = -math.inf, -math.inf
        self._map: MapLayers | None = None
        self._has_decided = False
        if self._planner is not None:  # Compile the search for the path: a live robot can't wait.
            path_of(self._planner.plan, np.zeros(2))

    def messages(self, builder: MessageBuilder, step: StepResult) -> list[Stamped]:
        """Return the messages that are due after a control step, with their topics.

        Args:
            builder: Builder of the messages.
            step: The step.
        """
        due: list[Stamped] = []
        now = step.readings.stamp
        if step.situation is not None:
            error = step.situation.heading_error
            message = builder.new("std_msgs/msg/Float64", data=float(error))
            due.append((topics.HEADING_ERROR, message))
            self._has_decided = True
        if self._planner is None or not self._has_decided:
            return due  # Nothing is known before the first scan.
        if now < self._last_plan:  # The clock began anew with another drive.
            self._last_map, self._last_plan, self._map = -math.inf, -math.inf, None
        if now - self._last_map > _MAP_PERIOD - _EARLY:
            self._last_map = now
            due += self._map_messages(builder, now, self._planner)
        if step.situation is not None and now - self._last_plan > _PLAN_PERIOD - _EARLY:
            self._last_plan = now
            due += self._plan_messages(builder, now, self._planner)
        return due

    def map_transform(self, builder: MessageBuilder, seconds: float) -> RosMessage:
        """Return the transform ``map -> odom``, without which the goal has no place in ``odom``."""
        pose, odometry = self._localizer.pose, self._localizer.odometry
        return map_messages.map_to_odom(builder, seconds, pose, odometry)

    def _map_messages(
        self, builder: MessageBuilder, now: float, planner: LocalPlanner
    ) -> list[Stamped]:
        """Return the local map in both forms."""
        assembler = assembler_of(self._perception)
        cloud = None if assembler is None else assembler.cloud
        points = None if cloud is None else cloud.points
        self._map = map_layers(planner, self._perception.layers, points)
        height = float(self._localizer.odometry.position[2])
        occupancy = map_messages.occupancy_grid(builder, now, self._map, height)
        return [
            (topics.LOCAL_MAP, occupancy),
            (topics.GRID_MAP, map_messages.grid_map(builder, now, self._map)),
        ]

    def _plan_messages(
        self, builder: MessageBuilder, now: float, planner: LocalPlanner
    ) -> list[Stamped]:
        """Return the plan and the sub-goal."""
        odometry = self._localizer.odometry
        places = path_of(planner.plan, odometry.position[:2])
        target = self._on_ground(planner.target[None], odometry)[0]
        ahead = target[:2] - odometry.position[:2]
        bearing = math.atan2(ahead[1], ahead[0])
        return [
            (topics.PLAN, map_messages.path(builder, now, self._on_ground(places, odometry))),
            (topics.SUBGOAL, map_messages.subgoal(builder, now, target, bearing)),
        ]

    def _on_ground(self, places: NDArray[np.float64], odometry: Pose) -> NDArray[np.float64]:
        """Return places in ``odom`` [m] with the height of the ground, else the robot's, (k, 3)."""
        height = float(odometry.position[2])
        if self._map is None:
            return np.column_stack([places, np.full(len(places), height)])
        return np.column_stack([places, self._map.height_at(places, height)])
