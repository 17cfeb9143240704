"""Numbers of a robot as the plant of ray-cast wheels takes them: mass, inertia, wheels, hull.

Springs and dampers are as stiff as a sub-step of semi-implicit Euler integrates them: with the
largest eigenvalue ``e`` of the inverse mass matrix times all contacts of the wheels at once, a
spring ``k`` and a damper ``c`` are stable where ``k e h^2 + 2 c e h < 4``. So each robot, large or
small, has the same margin, and the one number that follows from it is the static sag. A tyre is
larger than the wheel by the sag, so that a robot at rest stands as high as it is built.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.clock import TICK
from andabata.machine.robot import RobotModel
from andabata.machine.vectors import Vector

GRAVITY = 9.81
"""Acceleration of free fall [m/s2]."""

SUB_STEPS = 2
"""Number of sub-steps of a tick."""

SUB_STEP = TICK / SUB_STEPS
"""Time of a sub-step [s]: 200 Hz, as in the reference plant."""

_SPRING, _DAMPER = 0.5, 1.0
"""Terms ``k e h^2`` and ``c e h`` of the wheels: 2.5 of the 4 that are stable, the rest is for
contacts of the hull."""

_FAN_DEG = (-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0)
"""Angles of the rays of a wheel to the ground, from straight down [deg]."""


class WheelsConfig(BaseModel):
    """Parameters of the plant of ray-cast wheels; friction and limits are those of bullet.

    Attributes:
        friction: Coulomb friction of tyres on soil along the wheel (assumption).
        lateral_friction_ratio: Friction along the axle as a share of that along the wheel: the
            ratio of the axes of the friction ellipse.
        relaxation: Way that a wheel rolls until its patch of tyre is renewed [m] (assumption).
        hull_friction: Coulomb friction of the hull on ground and objects (assumption).
        settle_time: Time for the body to come to rest after it is put down [s].
        collision_height: Height above the ground from which contact of a wheel with a solid object
            is a collision [m]; a wheel climbs what is lower.
        touch_distance: Largest distance that counts as contact [m].
        tip_angle: Tilt beyond which the body has rolled over for good [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    friction: float = Field(default=0.9, gt=0)
    lateral_friction_ratio: float = Field(default=0.5, gt=0, le=1)
    relaxation: float = Field(default=0.1, gt=0)
    hull_friction: float = Field(default=0.4, ge=0)
    settle_time: float = Field(default=0.5, ge=0)
    collision_height: float = Field(default=0.05, gt=0)
    touch_distance: float = Field(default=0.005, ge=0)
    tip_angle: float = Field(default=np.deg2rad(60.0), gt=0)


class Tyres(NamedTuple):
    """The four wheels; each touches the ground with the two rims of its width.

    Attributes:
        rims: Centres of the rims from the centre of mass, wheel by wheel in the order front left,
            rear left, front right, rear right [m], shape (8, 3).
        radius: Radius of the wheels, and of a tyre under its share of the weight [m].
        sag: Difference to the radius of a tyre without load [m].
        inertia: Moment of inertia of a wheel about its axle [kg m2].
        torque: Largest torque of a motor [N m].
        max_speed: Largest wheel speed [rad/s].
        stiffness: Stiffness of a rim, along the ground's normal and along the wheel [N/m].
        damping: Damping of a rim in both directions [N s/m].
        friction: Coulomb friction along the wheel.
        lateral: Friction along the axle as a share of that along the wheel.
        relaxation: Way that a wheel rolls until its patch is renewed [m].
        fan: Directions of the rays to the ground along the body's x and z axis, shape (k, 2).
    """

    rims: NDArray[np.float64]
    radius: float
    sag: float
    inertia: float
    torque: float
    max_speed: float
    stiffness: float
    damping: float
    friction: float
    lateral: float
    relaxation: float
    fan: NDArray[np.float64]


class Hull(NamedTuple):
    """The body without its wheels: two boxes, the lower one between the wheels.

    Attributes:
        boxes: Middle from the centre of mass and half of the edges of each box [m], shape (2, 6).
        points: Points that touch the ground, from the centre of mass [m], shape (n, 3).
        friction: Coulomb friction.
        reach: Distance of its furthest corner from the centre of mass [m].
    """

    boxes: NDArray[np.float64]
    points: NDArray[np.float64]
    friction: float
    reach: float


class WheelsBody(NamedTuple):
    """A robot as compiled code takes it.

    Attributes:
        mass: Mass with the wheels [kg].
        inertia: Moments of inertia about the centre of mass along the axes of the body, the wheels'
            spin left out [kg m2].
        height: Height of the centre of mass above ``base_footprint`` [m].
        tyres: The wheels.
        hull: The body without its wheels.
        collision_height: ``WheelsConfig.collision_height``.
        touch_distance: ``WheelsConfig.touch_distance``.
        upright: Cosine of the tilt beyond which the body has rolled over.
    """

    mass: float
    inertia: Vector
    height: float
    tyres: Tyres
    hull: Hull
    collision_height: float
    touch_distance: float
    upright: float


def wheels_body(robot: RobotModel, config: WheelsConfig) -> WheelsBody:
    """Return the numbers of a robot: the masses and shapes of its URDF as one rigid body.

    Args:
        robot: Parameters of the body.
        config: Friction and limits.
    """
    height, inertia = _mass_properties(robot)
    rims = _rims(robot, height)
    eigenvalue = _largest_eigenvalue(robot, height, inertia, rims)
    stiffness = _SPRING / (eigenvalue * SUB_STEP**2)
    tyres = Tyres(
        rims=rims,
        radius=robot.wheel_radius,
        sag=robot.mass * GRAVITY / (len(rims) * stiffness),
        inertia=robot.wheel_mass * robot.wheel_radius**2 / 2,
        torque=robot.wheel_torque,
        max_speed=robot.max_wheel_speed,
        stiffness=stiffness,
        damping=_DAMPER / (eigenvalue * SUB_STEP),
        friction=config.friction,
        lateral=config.lateral_friction_ratio,
        relaxation=config.relaxation,
        fan=_directions(_FAN_DEG),
    )
    return WheelsBody(
        mass=robot.mass,
        inertia=inertia,
        height=height,
        tyres=tyres,
        hull=_hull(robot, height, config.hull_friction),
        collision_height=config.collision_height,
        touch_distance=config.touch_distance,
        upright=float(np.cos(config.tip_angle)),
    )


def _mass_properties(robot: RobotModel) -> tuple[float, Vector]:
    """Return height of the centre of mass [m] and moments of inertia about it [kg m2]."""
    wheels, r, w = 4 * robot.wheel_mass, robot.wheel_radius, robot.wheel_width
    hull = robot.mass - wheels
    height = (hull * robot.centre_of_mass + wheels * r) / robot.mass
    # The hull's mass lies low: inertia of a box half as high as the hull, as in the URDF.
    x, y, z = robot.length, robot.width - 0.1, (robot.height - robot.clearance) / 2
    lift = hull * (robot.centre_of_mass - height) ** 2 + wheels * (r - height) ** 2
    across = wheels * (3 * r * r + w * w) / 12
    along_x, along_y = wheels * (robot.wheelbase / 2) ** 2, wheels * (robot.track / 2) ** 2
    return height, (
        hull * (y * y + z * z) / 12 + across + lift + along_y,
        hull * (x * x + z * z) / 12 + lift + along_x,
        hull * (x * x + y * y) / 12 + across + along_x + along_y,
    )


def _rims(robot: RobotModel, height: float) -> NDArray[np.float64]:
    """Return ``Tyres.rims``."""
    level = robot.wheel_radius - height
    return np.array(
        [
            (x * robot.wheelbase / 2, (y * robot.track + w * robot.wheel_width) / 2, level)
            for y in (1, -1)
            for x in (1, -1)
            for w in (1, -1)
        ]
    )


def _largest_eigenvalue(
    robot: RobotModel, height: float, inertia: Vector, rims: NDArray[np.float64]
) -> float:
    """Return the largest eigenvalue of the inverse mass matrix times the rims' contacts [1/kg]."""
    roots = 1 / np.sqrt([robot.mass] * 3 + list(inertia))
    total = np.zeros((6, 6))
    for x, y, _ in rims:
        # Velocity of the lowest point by velocity and rotation of the body.
        z = -height
        arm = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
        jacobian = np.hstack([np.eye(3), arm]) * roots
        total += jacobian.T @ jacobian
    return float(np.linalg.eigvalsh(total)[-1])


def _directions(angles_deg: tuple[float, ...]) -> NDArray[np.float64]:
    """Return rays at angles from straight down, positive ahead, as x and z, shape (k, 2)."""
    angles = np.deg2rad(angles_deg)
    return np.column_stack([np.sin(angles), -np.cos(angles)])


def _hull(robot: RobotModel, height: float, friction: float) -> Hull:
    """Return the two boxes of the URDF, cut where they overlap, and points of their surface."""
    shoulder = min(robot.clearance + 2 * robot.wheel_radius, robot.height)
    shell = max(robot.track - robot.wheel_width - 0.02, 0.1 * robot.track)
    boxes = [
        _box(robot.length, shell, robot.clearance - height, shoulder - height),
        _box(robot.length, robot.width, shoulder - height, robot.height - height),
    ]
    floor = [
        (x * robot.length / 2, y * shell / 2, robot.clearance - height)
        for x in (-1.0, -0.5, 0.0, 0.5, 1.0)
        for y in (-1.0, 0.0, 1.0)
    ]
    corners = [
        (x * robot.length / 2, y * robot.width / 2, z - height)
        for x in (-1, 1)
        for y in (-1, 1)
        for z in (shoulder, robot.height)
    ]
    points = np.array(floor + corners)
    return Hull(np.array(boxes), points, friction, float(np.linalg.norm(points, axis=1).max()))


def _box(length: float, width: float, low: float, high: float) -> tuple[float, ...]:
    """Return middle and half of the edges of a box about the body's z axis [m]."""
    return 0.0, 0.0, (low + high) / 2, length / 2, width / 2, (high - low) / 2
