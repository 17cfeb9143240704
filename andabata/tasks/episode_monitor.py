"""Monitors one drive on the true state: terminations, and measures of how it was driven."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.mover_contact import Contact
from andabata.machine.sensor_readings import VehicleState
from andabata.tasks.terminations import Drives, Ending, Outcome, TerminationConfig, Terminations
from traversability.virtual_scan import VirtualScan
from worlds.world import World

__all__ = ["EpisodeMonitor", "Outcome", "TerminationConfig"]

_BEFORE_ARRIVAL = (Ending.GOAL, Ending.COLLISION, Ending.TIPOVER)
"""Endings that stand whatever a robot declares in the same step."""


class EpisodeMonitor:
    """Watches the true state of one drive; of what is perceived, what ``collision_range`` needs.

    Attributes:
        ending: Ending of the drive so far.
        is_too_near: True if the drive ended by ``collision_range`` and nothing was touched.
        distance: Distance driven [m].
        forbidden_distance: Distance driven where the true map forbids it [m].
        steering_variation: Integral of the squared yaw rate [rad2/s].
        turns: Number of whole turns, left less right.
        energy: Work of the motors [J]; None where the plant has none.
        min_clearance: Smallest distance from the body's centre to forbidden ground [m].
        path: Positions of the body, one a control step [m].
        time: Duration so far [s].
        contact: Contact of the body: what it touches, and who drove into whom.
        goal_radius: Distance below which the goal is reached [m].
    """

    def __init__(self, world: World, config: TerminationConfig, sees_scan: bool = False) -> None:
        """Take a world and the rules of its drives.

        Args:
            world: World.
            config: Rules of a drive.
            sees_scan: True if each update comes with the virtual scan, where there is one.

        Raises:
            ValueError: If the rules need a scan and none is seen.
        """
        self._truth = world.truth
        self.goal_radius = config.goal_radius
        self._terminations = Terminations(config, sees_scan=sees_scan)

    def begin(self, state: VehicleState, goal: NDArray[np.float64]) -> None:
        """Start measuring a drive to ``goal``, map coordinates [m], shape (2,)."""
        self._goal = goal
        self._began = state.stamp
        self._terminations.begin(0, state.pose.position[:2], state.stamp)
        self._work = state.work
        self.ending = Ending.NONE
        self.is_too_near = False
        self.energy: float | None = None
        self.distance = 0.0
        self.forbidden_distance = 0.0
        self.steering_variation = 0.0
        self.turns = 0.0
        self.min_clearance = np.inf
        self.path: list[NDArray[np.float64]] = [state.pose.position.copy()]
        self.time = 0.0
        self.contact = Contact.NONE

    def head_for(self, goal: NDArray[np.float64]) -> None:
        """Go on with another goal, map coordinates [m], shape (2,)."""
        self._goal = goal

    def excuse_standing(self, state: VehicleState) -> None:
        """Forget for how long the robot has stayed where it is."""
        self._terminations.begin(0, state.pose.position[:2], state.stamp)

    def update(
        self,
        state: VehicleState,
        has_arrived: bool | None = None,
        scan: VirtualScan | None = None,
    ) -> Outcome | None:
        """Take in the true state after a control step; return the outcome, None before the end.

        Args:
            state: True state.
            has_arrived: True in the step in which the robot declares its goal reached, and False
                before; None where the true state alone says when a goal is reached.
            scan: Latest virtual scan that the controller was given; None before the first.
        """
        position = state.pose.position[:2]
        moved = float(np.hypot(*(position - self.path[-1][:2])))
        step = state.stamp - self._began - self.time
        self.distance += moved
        self.steering_variation += float(state.angular[2] ** 2) * step
        self.turns += float(state.angular[2]) * step / (2 * np.pi)
        self.time = state.stamp - self._began
        if state.work is not None and self._work is not None:
            self.energy = state.work - self._work
        forbidden, clearance = self._truth.at(float(position[0]), float(position[1]))
        if moved > 0 and forbidden:
            self.forbidden_distance += moved
        self.min_clearance = min(self.min_clearance, clearance)
        self.contact = state.contact
        self.path.append(state.pose.position.copy())
        # A goal that the robot does not know to be reached is not reached.
        is_waited_for = has_arrived is not None and not has_arrived
        goal_distance = np.inf if is_waited_for else self.goal_distance(state)
        drives = Drives(
            positions=position[None],
            goal_distances=np.array([goal_distance]),
            collided=np.array([state.collided]),
            tipped=np.array([state.tipped]),
            stamps=np.array([state.stamp]),
            times=np.array([self.time]),
            nearest=np.array([np.inf if scan is None else scan.nearest]),
        )
        self.ending = Ending(int(self._terminations.endings(drives)[0]))
        touched = state.collided or state.tipped
        self.is_too_near = bool(self._terminations.too_near(drives)[0]) and not touched
        if has_arrived and self.ending not in _BEFORE_ARRIVAL:
            self.ending = Ending.FALSE_ARRIVAL
        return self.ending.outcome

    def goal_distance(self, state: VehicleState) -> float:
        """Return the true horizontal distance to the goal [m]."""
        return float(np.hypot(*(self._goal - state.pose.position[:2])))
