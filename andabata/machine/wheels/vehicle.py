"""Fast plant with physics: a rigid body on ray-cast wheels, the reference's forces in few lines."""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.machine.clock import TICK, TICK_HZ
from andabata.machine.planar.mover_contact import Contact, walker_contact
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.machine.solid_contact import build_solids
from andabata.machine.vectors import axes_of
from andabata.machine.wheel_contact import fit_wheel_plane, quaternion
from andabata.machine.wheels.body import WheelsConfig, wheels_body
from andabata.machine.wheels.dynamics import Surroundings, WheelsState, drive_ticks, motion_of
from worlds.drag import drag_map
from worlds.rooms.mover_motion import Movers
from worlds.walking import WalkerTrack
from worlds.world import Start, World

_SOLID, _WALKER, _SPEED = range(3)
"""Columns of the contacts of a tick."""


class WheelsVehicle:
    """Rigid body on four wheels that are springs and dampers along rays; deterministic."""

    def __init__(self, world: World, robot: RobotModel, config: WheelsConfig | None = None) -> None:
        """Place a robot at the origin of a world.

        Args:
            world: Ground and objects.
            robot: Parameters of the body.
            config: Friction and limits.

        Raises:
            ValueError: If an object of the world is not convex.
        """
        self._config = config or WheelsConfig()
        self._robot = robot
        self._body = wheels_body(robot, self._config)
        ground = np.ascontiguousarray(world.ground.heights), world.ground.cell
        nobody = WalkerTrack(Movers.none(1), np.zeros((1, 0)), np.zeros(0), 0, 1 / TICK)
        self._around = Surroundings(ground, build_solids(world), nobody)
        self._drag = drag_map(world)
        corners = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
        self._corners = corners * [robot.wheelbase, robot.track]
        self.place(Start(0.0, 0.0, 0.0))

    def place(self, start: Start) -> None:
        """Put the body down, let it come to rest, and set its time to zero."""
        x, y, c, s = start.x, start.y, math.cos(start.yaw), math.sin(start.yaw)
        heights, cell = self._around.ground
        z, roll, pitch = fit_wheel_plane(heights, cell, x, y, c, s, self._corners)
        turn = np.array(quaternion(roll, pitch, start.yaw))
        up = np.array(axes_of(turn).up) * self._body.height
        self._state, self._ticks = WheelsState.at_rest(np.array([x, y, z]) + up, turn), 0
        self.drive(WheelSpeeds(0.0, 0.0), round(self._config.settle_time / TICK))
        self._state.work[0], self._ticks = 0.0, 0
        self._contact = Contact.NONE

    def drive(
        self, wheels: WheelSpeeds, ticks: int, walkers: WalkerTrack | None = None
    ) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks; see ``Vehicle.drive``.

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """
        if not (math.isfinite(wheels.left) and math.isfinite(wheels.right)):
            raise ValueError(f"wheels: expected finite speeds [rad/s], got {wheels}")
        around = self._around if walkers is None else self._around._replace(walkers=walkers)
        rows, contacts = np.empty((ticks, 9)), np.empty((ticks, 3))
        targets = np.array([wheels.left, wheels.right])
        drive_ticks(self._state, targets, self._body, around, self._drag, rows, contacts)
        self._contact = self._first_contact(rows, contacts, walkers)
        self._ticks += ticks
        return rows

    def _first_contact(
        self,
        rows: NDArray[np.float64],
        contacts: NDArray[np.float64],
        walkers: WalkerTrack | None,
    ) -> Contact:
        """Return the contact of the first tick that has one; what stands comes first."""
        ticks = np.flatnonzero(contacts[:, _SOLID] + contacts[:, _WALKER])
        if not len(ticks):
            return Contact.NONE
        tick = int(ticks[0])
        if walkers is None or contacts[tick, _SOLID]:
            return Contact.OBSTACLE
        pose = Pose(rows[tick, :3], rows[tick, 3:7])
        x, y, _ = pose.position.tolist()
        speed = float(contacts[tick, _SPEED])
        return walker_contact((x, y, pose.yaw), speed, self._robot, tick, walkers.movers)

    @property
    def state(self) -> VehicleState:
        """True state of the body."""
        state, motion = self._state, motion_of(self._state, self._body)
        axes = np.array(motion.axes)
        angular = axes @ motion.spin
        # The state has the velocity of the centre of mass; base_footprint lies below it.
        below = np.array([0.0, 0.0, -self._body.height])
        left, right = state.speeds.reshape(2, 2).mean(axis=1).tolist()
        return VehicleState(
            stamp=self._ticks / TICK_HZ,
            pose=Pose(state.place + below @ axes, state.quaternion.copy()),
            linear=axes @ motion.velocity + np.cross(angular, below),
            angular=angular,
            wheels=WheelSpeeds(left, right),
            collided=self._contact is not Contact.NONE,
            tipped=bool(state.tipped[0]),
            work=float(state.work[0]),
            contact=self._contact,
        )

    def close(self) -> None:
        """Do nothing: the plant holds no resources."""
