"""Reference plant: a rigid body on four driven wheels in pybullet.

A wheel meets the ground as a sphere, and solid objects as a cylinder. On a heightfield the
cylinder's edges catch on the triangles: it climbs a step higher than its axle, and hardly slides
down a slope that is too steep for its friction. It also takes two and a half times as long.
"""

import math
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial.transform import Rotation

from andabata.machine.bullet_ground import GroundWindow
from andabata.machine.clock import TICK, TICK_HZ
from andabata.machine.planar.mover_contact import Contact, walker_contact
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.machine.wheel_contact import fit_wheel_plane, quaternion
from worlds.bodies import build_solids, build_walkers, move_walker
from worlds.drag import PERIOD, SLOWEST, drag_at, drag_map
from worlds.quiet_pybullet import pybullet
from worlds.walking import BELOW, WalkerTrack
from worlds.world import Start, World

_WHEELS = ("front_left", "rear_left", "front_right", "rear_right")
"""Names of the wheels, in the order of ``BulletVehicle._wheels``."""

_CONTACT_LINK, _CONTACT_POSITION, _CONTACT_DISTANCE = 3, 6, 8
"""Columns of pybullet's contact points: link of the robot, position in the map [m], distance
[m]."""

_TOUCH_DISTANCE = 0.005
"""Largest distance of two bodies that counts as contact [m]."""

_AROUND = 4.0
"""Distance from the robot to the edge of a walker up to which it has a body in the physics [m]."""

_DROP = 0.02
"""Height above the ground at which the body is put down [m]."""

_UP = 8
"""Element of a rotation matrix, row by row: vertical component of the body's z axis."""


class BulletConfig(BaseModel):
    """Parameters of the physics. With pybullet's own friction a skid-steer robot hardly turns.

    Attributes:
        step: Physics step [s].
        friction: Coulomb friction of tyres on soil (assumption).
        lateral_friction_ratio: Friction along the axle as a share of that along the wheel
            (assumption: tyres scrub over loose soil).
        settle_time: Time for the body to come to rest after it is put down [s].
        collision_height: Height above the ground from which contact of a wheel with a solid object
            is a collision [m]; a wheel climbs what is lower.
        tip_angle: Tilt beyond which the body has rolled over for good [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    step: float = Field(default=0.005, gt=0, le=0.01)
    friction: float = Field(default=0.9, gt=0)
    lateral_friction_ratio: float = Field(default=0.5, gt=0, le=1)
    settle_time: float = Field(default=0.5, ge=0)
    collision_height: float = Field(default=0.05, gt=0)
    tip_angle: float = Field(default=np.deg2rad(60.0), gt=0)


class BulletVehicle:
    """Rigid-body robot in a physics client of its own, without a window."""

    def __init__(self, world: World, robot: RobotModel, config: BulletConfig | None = None) -> None:
        """Build world and robot.

        Args:
            world: Ground and objects.
            robot: Parameters of the body.
            config: Parameters of the physics.
        """
        self._config = config or BulletConfig()
        self._robot = robot
        self._ground = world.ground
        self._heights = np.ascontiguousarray(world.ground.heights)
        self._client = pybullet.connect(pybullet.DIRECT)
        pybullet.setGravity(0, 0, -9.81, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._config.step, enableConeFriction=0, physicsClientId=self._client
        )
        self._window = GroundWindow(world.ground, self._client)
        self._solids = build_solids(world, self._client)
        self._walkers = build_walkers(world, self._client)
        self._drag = drag_map(world)
        for body in self._solids:
            pybullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=self._client)
        self._body = self._load(robot)
        self._wheels = [self._joints[f"{name}_joint"] for name in _WHEELS]
        self._spheres = [self._joints[f"{name}_sphere_joint"] for name in _WHEELS]
        self._divide_contacts()
        self._prepare_wheels()
        corners = np.array([[x, y] for x in (1, -1) for y in (1, -1)]) / 2
        self._contacts = corners * [robot.wheelbase, robot.track]
        self._ticks = 0
        self._contact = Contact.NONE
        self._is_out = np.zeros(len(self._walkers), dtype=np.bool_)
        self._tipped = False
        self._work = 0.0

    def _load(self, robot: RobotModel) -> int:
        """Load the robot from its URDF and return pybullet's number of the body."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            path.write_text(robot.to_urdf(spheres=True), encoding="utf-8")
            body: int = pybullet.loadURDF(
                str(path),
                basePosition=[0.0, 0.0, float(self._heights.max()) + 1.0],
                flags=pybullet.URDF_USE_INERTIA_FROM_FILE,
                physicsClientId=self._client,
            )
        self._joints = {}
        for joint in range(pybullet.getNumJoints(body, physicsClientId=self._client)):
            name = pybullet.getJointInfo(body, joint, physicsClientId=self._client)[1].decode()
            self._joints[name] = joint
        return body

    def _divide_contacts(self) -> None:
        """Let spheres meet the ground alone, and wheels everything else."""
        self._let_wheels_pass()
        others = (*self._solids, *self._walkers)
        for link, other in ((sphere, other) for sphere in self._spheres for other in others):
            pybullet.setCollisionFilterPair(
                self._body, other, link, -1, 0, physicsClientId=self._client
            )

    def _let_wheels_pass(self) -> None:
        """Let the wheels pass through the ground, which their spheres meet."""
        for wheel in self._wheels:
            pybullet.setCollisionFilterPair(
                self._body, self._window.body, wheel, -1, 0, physicsClientId=self._client
            )

    def _follow(self, x: float, y: float) -> None:
        """Have ground around a place in the map [m]."""
        if self._window.follow(x, y):
            self._let_wheels_pass()

    def _prepare_wheels(self) -> None:
        """Set anisotropic friction of the wheels and release the brakes of their motors."""
        for link in (*self._wheels, *self._spheres):
            pybullet.changeDynamics(
                self._body,
                link,
                lateralFriction=self._config.friction,
                # The axle is the wheel's own y; x and z turn with it and have to be equal.
                anisotropicFriction=[1.0, self._config.lateral_friction_ratio, 1.0],
                rollingFriction=0.0,
                spinningFriction=0.0,
                restitution=0.0,
                linearDamping=0.0,
                angularDamping=0.0,
                physicsClientId=self._client,
            )
        for wheel in self._wheels:
            pybullet.setJointMotorControl2(
                self._body,
                wheel,
                pybullet.VELOCITY_CONTROL,
                force=0.0,
                physicsClientId=self._client,
            )
        pybullet.changeDynamics(
            self._body,
            -1,
            lateralFriction=0.4,
            linearDamping=0.0,
            angularDamping=0.0,
            physicsClientId=self._client,
        )

    def place(self, start: Start) -> None:
        """Put the body down, let it come to rest, and set its time to zero."""
        x, y, c, s = start.x, start.y, np.cos(start.yaw), np.sin(start.yaw)
        height, roll, pitch = fit_wheel_plane(
            self._heights, self._ground.cell, x, y, c, s, self._contacts
        )
        turn = Rotation.from_quat(quaternion(roll, pitch, start.yaw))
        base = turn.apply([0.0, 0.0, self._robot.centre_of_mass + _DROP])
        self._follow(start.x, start.y)
        pybullet.resetBasePositionAndOrientation(
            self._body,
            (base + np.array([start.x, start.y, height])).tolist(),
            turn.as_quat().tolist(),
            physicsClientId=self._client,
        )
        pybullet.resetBaseVelocity(self._body, [0.0] * 3, [0.0] * 3, physicsClientId=self._client)
        for wheel in self._wheels:
            pybullet.resetJointState(self._body, wheel, 0.0, 0.0, physicsClientId=self._client)
        for walker in self._walkers:
            move_walker(walker, BELOW, (0.0, 0.0, 0.0), self._client)
        self._is_out = np.zeros(len(self._walkers), dtype=np.bool_)
        self._contact, self._tipped = Contact.NONE, False
        self.drive(WheelSpeeds(0.0, 0.0), round(self._config.settle_time / TICK))
        self._ticks, self._work = 0, 0.0
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
        pybullet.setJointMotorControlArray(
            self._body,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=[wheels.left, wheels.left, wheels.right, wheels.right],
            forces=[self._robot.wheel_torque] * 4,
            physicsClientId=self._client,
        )
        (x, y, *_), _ = self._footprint()
        self._follow(x, y)
        self._contact = Contact.NONE
        rows, upright, force = [], math.cos(self._config.tip_angle), 0.0
        for tick in range(ticks):
            near = [] if walkers is None else self._move_walkers(walkers, tick)
            speed = self._speed() if near else 0.0
            if tick % PERIOD == 0:
                force = self._plants() if self._drag.force.size else 0.0
            for _ in range(round(TICK / self._config.step)):
                if force:
                    self._brake(force)
                pybullet.stepSimulation(physicsClientId=self._client)
            if self._contact is Contact.NONE:
                if self._touches():
                    self._contact = Contact.OBSTACLE
                elif walkers is not None and self._touches_walker(near):
                    self._contact = self._walker_contact(speed, tick, walkers)
            pose, turn = self._footprint()
            speeds, power = self._wheels_now()
            rows.append(pose + speeds)
            self._work += power * TICK
            self._tipped |= turn[_UP] < upright
        self._ticks += ticks
        return np.array(rows).reshape(ticks, 9)

    def _plants(self) -> float:
        """Return the force of the plants that the body is in [N]."""
        (x, y, *_), turn = self._footprint()
        half = self._robot.length / 2
        return self._robot.width * drag_at(self._drag, x, y, turn[0], turn[3], half)

    def _brake(self, force: float) -> None:
        """Let plants act against the level motion of the body for one step."""
        (u, v, _), _ = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        rate = force / max(math.hypot(u, v), SLOWEST)
        place, _ = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._client)
        pybullet.applyExternalForce(
            self._body,
            -1,
            [-rate * u, -rate * v, 0.0],
            place,
            pybullet.WORLD_FRAME,
            physicsClientId=self._client,
        )

    def _touches(self) -> bool:
        """Return true if the body touches a solid object, or a wheel one that it cannot climb."""
        for solid in self._solids:
            for contact in pybullet.getContactPoints(
                self._body, solid, physicsClientId=self._client
            ):
                link, place = contact[_CONTACT_LINK], contact[_CONTACT_POSITION]
                distance = contact[_CONTACT_DISTANCE]
                if distance > _TOUCH_DISTANCE:
                    continue
                if link not in self._wheels:
                    return True
                ground = float(self._ground.height_at(place[0], place[1]))
                if place[2] - ground > self._config.collision_height:
                    return True
        return False

    def _move_walkers(self, walkers: WalkerTrack, tick: int) -> list[int]:
        """Put the walkers around the robot where they are, and return their bodies.

        Each call of the physics costs as much as many a step of it: who is far away, or not there
        at all, waits below the ground.
        """
        (x, y, _), _ = pybullet.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        places, velocities, radii = (array[tick] for array in walkers.movers)
        away = np.hypot(places[:, 0] - x, places[:, 1] - y) - radii
        near = (radii > 0.0) & (away < _AROUND)
        for m in np.flatnonzero(self._is_out & ~near).tolist():
            move_walker(self._walkers[m], BELOW, (0.0, 0.0, 0.0), self._client)
        for m in np.flatnonzero(near).tolist():
            middle = float(walkers.feet[tick, m] + walkers.heights[m] / 2)
            place = (float(places[m, 0]), float(places[m, 1]), middle)
            velocity = (float(velocities[m, 0]), float(velocities[m, 1]), 0.0)
            move_walker(self._walkers[m], place, velocity, self._client)
        self._is_out = near
        return [self._walkers[m] for m in np.flatnonzero(near).tolist()]

    def _touches_walker(self, near: list[int]) -> bool:
        """Return true if body or wheels touch one of some bodies of walkers."""
        return any(
            contact[_CONTACT_DISTANCE] <= _TOUCH_DISTANCE
            for walker in near
            for contact in pybullet.getContactPoints(
                self._body, walker, physicsClientId=self._client
            )
        )

    def _walker_contact(self, speed: float, tick: int, walkers: WalkerTrack) -> Contact:
        """Return who drove into whom; ``speed`` is the robot's before they touched [m/s]."""
        (x, y, *_), turn = self._footprint()
        yaw = math.atan2(turn[3], turn[0])
        return walker_contact((x, y, yaw), speed, self._robot, tick, walkers.movers)

    def _speed(self) -> float:
        """Return the speed along the body's x axis [m/s]."""
        linear, _ = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        _, turn = self._footprint()
        return float(linear[0] * turn[0] + linear[1] * turn[3] + linear[2] * turn[6])

    def _footprint(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return the pose of ``base_footprint``, 7 numbers, and its rotation, row by row."""
        (x, y, z), orientation = pybullet.getBasePositionAndOrientation(
            self._body, physicsClientId=self._client
        )
        turn = pybullet.getMatrixFromQuaternion(orientation)
        # pybullet's base is the centre of mass; base_footprint lies under it on the base's own z.
        up = self._robot.centre_of_mass
        return (x - turn[2] * up, y - turn[5] * up, z - turn[_UP] * up, *orientation), turn

    def _wheels_now(self) -> tuple[tuple[float, float], float]:
        """Return the mean speed of the wheels of each side [rad/s], and the motors' power [W].

        Motors do not recuperate: negative power of a wheel counts as zero.
        """
        joints = pybullet.getJointStates(self._body, self._wheels, physicsClientId=self._client)
        left, rear_left, right, rear_right = (joint[1] for joint in joints)
        power = sum(max(joint[1] * joint[3], 0.0) for joint in joints)
        return ((left + rear_left) / 2, (right + rear_right) / 2), power

    @property
    def state(self) -> VehicleState:
        """True state of the body."""
        pose, rows = self._footprint()
        turn = np.array(rows).reshape(3, 3)
        linear, angular = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        spin = turn.T @ np.array(angular)
        # pybullet reports the velocity of the centre of mass; base_footprint lies below it.
        lever = np.array([0.0, 0.0, -self._robot.centre_of_mass])
        return VehicleState(
            stamp=self._ticks / TICK_HZ,
            pose=Pose(np.array(pose[:3]), np.array(pose[3:])),
            linear=turn.T @ np.array(linear) + np.cross(spin, lever),
            angular=spin,
            wheels=WheelSpeeds(*self._wheels_now()[0]),
            collided=self._contact is not Contact.NONE,
            tipped=self._tipped,
            work=self._work,
            contact=self._contact,
        )

    def close(self) -> None:
        """Disconnect the physics client."""
        if self._client >= 0:
            pybullet.disconnect(self._client)
            self._client = -1
