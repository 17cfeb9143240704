"""Second judge: the reference's rigid body on four driven wheels, in MuJoCo (extra ``mujoco``).

What two engines without a line of code in common agree on does not depend on an engine. Robot,
ground, objects and friction along a wheel are those of bullet; contacts and solver are MuJoCo's,
and the friction of a wheel is an ellipse here and a rectangle there.
"""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.machine.clock import TICK, TICK_HZ
from andabata.machine.ground_window import has_left
from andabata.machine.mujoco_contact import align_friction
from andabata.machine.mujoco_model import TOUCH_DISTANCE, MujocoConfig, MujocoModel, build_model
from andabata.machine.planar.mover_contact import Contact, walker_contact
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.machine.vectors import Axes, axes_of
from andabata.machine.wheel_contact import fit_wheel_plane, quaternion
from worlds.drag import PERIOD, SLOWEST, drag_at, drag_map
from worlds.walking import BELOW, WalkerTrack
from worlds.world import Start, World

_AROUND = 4.0
"""Distance from the robot to the edge of a walker up to which it has a body in the physics [m]."""

_DROP = 0.02
"""Height above the ground at which the body is put down [m]."""

_DAMPING = 1
"""Column of ``data.efc_KBIP``: acceleration per error of a constraint's speed [1/s]."""


class MujocoVehicle:
    """Rigid-body robot in a MuJoCo model of its own; deterministic."""

    def __init__(self, world: World, robot: RobotModel, config: MujocoConfig | None = None) -> None:
        """Place a robot at the origin of a world.

        Args:
            world: Ground and objects.
            robot: Parameters of the body.
            config: Parameters of the physics.
        """
        self._config = config or MujocoConfig()
        self._world, self._robot = world, robot
        self._heights = np.ascontiguousarray(world.ground.heights)
        self._drag = drag_map(world)
        corners = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
        self._corners = corners * [robot.wheelbase, robot.track]
        self._middle: tuple[float, float] | None = None
        self._sim: MujocoModel
        self._targets = np.zeros(4)
        self.place(Start(0.0, 0.0, 0.0))

    def _follow(self, x: float, y: float) -> None:
        """Have ground and objects around the robot, which moves on as it did."""
        if self._middle is not None and not has_left(self._middle, x, y):
            return
        before = self._sim.data
        self._build(x, y)
        after = self._sim.data
        after.qpos[:], after.qvel[:] = before.qpos, before.qvel
        after.qacc_warmstart[:] = before.qacc_warmstart
        after.mocap_pos[:] = before.mocap_pos

    def _build(self, x: float, y: float) -> None:
        """Make the model around a place in the map [m]."""
        self._middle = (x, y)
        self._sim = build_model(self._world, self._robot, self._config, self._middle)

    def place(self, start: Start) -> None:
        """Put the body down, let it come to rest, and set its time to zero."""
        # The same window whatever was driven before: the same bytes.
        if self._middle != (start.x, start.y):
            self._build(start.x, start.y)
        x, y, c, s = start.x, start.y, math.cos(start.yaw), math.sin(start.yaw)
        z, roll, pitch = fit_wheel_plane(
            self._heights, self._world.ground.cell, x, y, c, s, self._corners
        )
        turn = quaternion(roll, pitch, start.yaw)
        up = Rotation.from_quat(turn).apply([0.0, 0.0, self._robot.wheel_radius + _DROP])
        data = self._sim.data
        mujoco.mj_resetData(self._sim.model, data)
        data.qpos[:3] = np.add(up, [x, y, z])
        data.qpos[3:7] = turn[3], *turn[:3]
        data.mocap_pos[:] = BELOW
        self._ticks, self._tipped, self._work = 0, False, 0.0
        self.drive(WheelSpeeds(0.0, 0.0), round(self._config.settle_time / TICK))
        self._ticks, self._work, self._contact = 0, 0.0, Contact.NONE

    def drive(
        self, wheels: WheelSpeeds, ticks: int, walkers: WalkerTrack | None = None
    ) -> NDArray[np.float64]:
        """Drive with commanded wheel speeds for a number of ticks; see ``Vehicle.drive``.

        Raises:
            ValueError: If a wheel speed is not a finite number.
        """
        if not (math.isfinite(wheels.left) and math.isfinite(wheels.right)):
            raise ValueError(f"wheels: expected finite speeds [rad/s], got {wheels}")
        self._follow(*self._sim.data.qpos[:2].tolist())
        rows = np.empty((ticks, 9))
        self._targets = np.array([wheels.left, wheels.left, wheels.right, wheels.right])
        self._contact, upright, force = Contact.NONE, math.cos(self._config.tip_angle), 0.0
        for tick in range(ticks):
            if walkers is not None:
                self._move_walkers(walkers, tick)
            speed = 0.0 if walkers is None else self._speed()
            if tick % PERIOD == 0:
                force = self._plants() if self._drag.force.size else 0.0
            for _ in range(round(TICK / self._config.step)):
                self._brake(force)
                self._step()
            if self._contact is Contact.NONE:
                self._contact = self._met(speed, tick, walkers)
            rows[tick] = self._row()
            self._work += self._power() * TICK
            self._tipped |= self._axes().up[2] < upright
        self._ticks += ticks
        return rows

    def _step(self) -> None:
        """Do one step of the physics: MuJoCo's own stages, with two corrections in between."""
        model, data = self._sim.model, self._sim.data
        mujoco.mj_fwdKinematics(model, data)
        mujoco.mj_makeM(model, data)
        mujoco.mj_factorM(model, data)
        mujoco.mj_collision(model, data)
        self._align_friction()
        mujoco.mj_makeConstraint(model, data)
        mujoco.mj_transmission(model, data)
        mujoco.mj_projectConstraint(model, data)
        mujoco.mj_fwdVelocity(model, data)
        # Dry friction takes the speed of a wheel away: here what differs from the commanded one.
        motors = slice(len(self._targets))
        data.efc_aref[motors] += data.efc_KBIP[motors, _DAMPING] * self._targets
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        mujoco.mj_implicit(model, data)

    def _align_friction(self) -> None:
        """Turn the friction of all contacts of wheels along the wheels."""
        sim, config = self._sim, self._config
        if not sim.data.ncon:
            return
        contacts = sim.data.contact
        align_friction(
            contacts.frame,
            contacts.friction,
            contacts.solreffriction,
            contacts.geom,
            sim.data.xaxis[sim.wheels],
            sim.wheel_of,
            config.lateral_friction_ratio,
            config.friction_time,
        )

    def _plants(self) -> float:
        """Return the force of the plants that the body is in [N]."""
        x, y = self._sim.data.qpos[:2].tolist()
        forward, half = self._axes().forward, self._robot.length / 2
        return self._robot.width * drag_at(self._drag, x, y, forward[0], forward[1], half)

    def _brake(self, force: float) -> None:
        """Let plants act against the level motion of the body for one step."""
        data = self._sim.data
        if not force:
            data.xfrc_applied[self._sim.base, :2] = 0.0
            return
        u, v = data.qvel[:2].tolist()
        rate = force / max(math.hypot(u, v), SLOWEST)
        data.xfrc_applied[self._sim.base, :2] = -rate * u, -rate * v

    def _move_walkers(self, walkers: WalkerTrack, tick: int) -> None:
        """Put the walkers around the robot where they are, and the others below the ground."""
        data = self._sim.data
        places, _, radii = (array[tick] for array in walkers.movers)
        near = (radii > 0.0) & (np.hypot(*(places - data.qpos[:2]).T) - radii < _AROUND)
        middles = walkers.feet[tick] + walkers.heights / 2
        data.mocap_pos[:] = BELOW
        data.mocap_pos[near] = np.column_stack([places, middles])[near]

    def _met(self, speed: float, tick: int, walkers: WalkerTrack | None) -> Contact:
        """Return what the robot touches; what stands comes first.

        Args:
            speed: Speed of the robot along its x axis before [m/s].
            tick: Number of the tick.
            walkers: Walkers, or None.
        """
        sim, contacts = self._sim, self._sim.data.contact
        geoms = contacts.geom
        solid, walker = (what[geoms].any(axis=1) for what in (sim.is_solid, sim.is_walker))
        if not (solid.any() or walker.any()):
            return Contact.NONE
        touched = contacts.dist <= TOUCH_DISTANCE
        if any(self._struck(geoms[k], contacts.pos[k]) for k in np.flatnonzero(solid & touched)):
            return Contact.OBSTACLE
        if walkers is None or not (walker & touched).any():
            return Contact.NONE
        x, y = sim.data.qpos[:2].tolist()
        forward = self._axes().forward
        yaw = math.atan2(forward[1], forward[0])
        return walker_contact((x, y, yaw), speed, self._robot, tick, walkers.movers)

    def _struck(self, geoms: NDArray[np.int32], place: NDArray[np.float64]) -> bool:
        """Return true if a contact with a solid object is the body's, or too high for a wheel.

        Args:
            geoms: Numbers of both shapes, shape (2,).
            place: Place of the contact in the map [m], shape (3,).
        """
        if self._sim.wheel_of[geoms].max() < 0:
            return True
        ground = float(self._world.ground.height_at(place[0], place[1]))
        return bool(place[2] - ground > self._config.collision_height)

    def _axes(self) -> Axes:
        """Return the axes of the body in the map."""
        w, x, y, z = self._sim.data.qpos[3:7].tolist()
        return axes_of(np.array([x, y, z, w]))

    def _speed(self) -> float:
        """Return the speed along the body's x axis [m/s]."""
        return float(np.dot(self._sim.data.qvel[:3], self._axes().forward))

    def _row(self) -> tuple[float, ...]:
        """Return the pose of ``base_footprint`` and the speeds of the wheels: 9 numbers."""
        data, up, below = self._sim.data, self._axes().up, self._robot.wheel_radius
        x, y, z, q_w, q_x, q_y, q_z = data.qpos[:7].tolist()
        # MuJoCo's base is at the height of the axles; base_footprint lies under it.
        place = x - up[0] * below, y - up[1] * below, z - up[2] * below
        left, rear_left, right, rear_right = data.qvel[self._sim.speeds].tolist()
        speeds = (left + rear_left) / 2, (right + rear_right) / 2
        return *place, q_x, q_y, q_z, q_w, *speeds

    def _power(self) -> float:
        """Return the power of the motors [W]; they do not recuperate."""
        data = self._sim.data
        power = data.qvel[self._sim.speeds] * data.efc_force[: len(self._targets)]
        return float(np.maximum(power, 0.0).sum())

    @property
    def state(self) -> VehicleState:
        """True state of the body."""
        row, velocity = np.array(self._row()), self._sim.data.qvel
        # MuJoCo has the velocity of the axles' height in the map, and the turning in the body.
        spin = velocity[3:6].copy()
        lever = np.array([0.0, 0.0, -self._robot.wheel_radius])
        return VehicleState(
            stamp=self._ticks / TICK_HZ,
            pose=Pose(row[:3], row[3:7]),
            linear=np.array(self._axes()) @ velocity[:3] + np.cross(spin, lever),
            angular=spin,
            wheels=WheelSpeeds(*row[7:].tolist()),
            collided=self._contact is not Contact.NONE,
            tipped=self._tipped,
            work=self._work,
            contact=self._contact,
        )

    def close(self) -> None:
        """Do nothing: MuJoCo's memory goes with the plant."""
