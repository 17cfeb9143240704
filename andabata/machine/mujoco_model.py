"""What MuJoCo computes with: a robot, and ground, solid objects and walkers around it.

The robot comes from the same URDF as in bullet: a wheel meets the ground as a sphere, and solid
objects as a cylinder. Objects are the convex meshes that the rays see. They are those of a window
that follows the robot, as the ground is: each shape costs time in every step.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.ground_window import REACH, ground_around
from andabata.machine.robot import RobotModel
from terrain.classes import TRAITS
from terrain.objects import SceneObject, bounds
from worlds.world import World

WHEELS = ("front_left", "rear_left", "front_right", "rear_right")
"""Names of the wheels, in the order of ``MujocoModel.wheels``."""

TOUCH_DISTANCE = 0.005
"""Largest distance of two bodies that counts as contact [m]."""

_GROUND, _SOLID = 1, 2
"""Bits of what a shape meets."""

_BASE = 1.0
"""Thickness of the ground under its lowest point [m]."""

_FLAT = 1e-3
"""Least range of heights that a heightfield may have [m]."""


class MujocoConfig(BaseModel):
    """Parameters of the physics; sizes, friction and limits are those of bullet.

    Attributes:
        step: Physics step [s].
        friction: Coulomb friction of tyres on soil along the wheel (assumption).
        lateral_friction_ratio: Friction along the axle as a share of that along the wheel: the
            ratio of the axes of the friction ellipse. Bullet's 0.5 is that of a rectangle; this one
            turns the robot on flat ground as bullet does, and holds it on cross slopes of 26
            degrees instead of 24.
        body_friction: Coulomb friction of the body on ground and objects (assumption).
        contact_time: Time in which a wheel's contact takes penetration away [s].
        impedance: Share of a wheel's contact in what it takes to be rigid, MuJoCo's ``solimp``. A
            stiffer one hops when it slides; this one sinks in by less than 1 mm.
        friction_time: Time in which friction takes slip of a wheel away [s].
        friction_impedance: Stiffness of friction as a multiple of that of the normal force,
            MuJoCo's ``impratio``: soft friction lets a body creep down a slope on which it stands.
        motor_time: Time in which a motor takes an error of its speed away [s]; two steps are the
            least that MuJoCo allows.
        motor_impedance: Share of a motor in what it takes to be rigid.
        armature: Inertia of a motor at its wheel [kg m2] (assumption).
        settle_time: Time for the body to come to rest after it is put down [s].
        collision_height: Height above the ground from which contact of a wheel with a solid object
            is a collision [m]; a wheel climbs what is lower.
        tip_angle: Tilt beyond which the body has rolled over for good [rad].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    step: float = Field(default=0.005, gt=0, le=0.01)
    friction: float = Field(default=0.9, gt=0)
    lateral_friction_ratio: float = Field(default=0.55, gt=0, le=1)
    body_friction: float = Field(default=0.4, ge=0)
    contact_time: float = Field(default=0.02, gt=0)
    impedance: float = Field(default=0.5, gt=0, lt=1)
    friction_time: float = Field(default=0.1, gt=0)
    friction_impedance: float = Field(default=100.0, gt=0)
    motor_time: float = Field(default=0.01, gt=0)
    motor_impedance: float = Field(default=0.99, gt=0, lt=1)
    armature: float = Field(default=0.01, ge=0)
    settle_time: float = Field(default=0.5, ge=0)
    collision_height: float = Field(default=0.05, gt=0)
    tip_angle: float = Field(default=np.deg2rad(60.0), gt=0)


@dataclass(frozen=True)
class MujocoModel:
    """A compiled model and the numbers of its parts.

    Attributes:
        model: MuJoCo's model.
        data: Its state.
        base: Number of the robot's body.
        wheels: Numbers of the wheels' joints, in the order of ``WHEELS``, shape (4,).
        speeds: Places of the wheels' speeds in ``data.qvel``, shape (4,). Their motors are the
            first constraints, in the same order.
        wheel_of: Wheel of each shape, -1 for others, shape (number of shapes,).
        is_solid: True for each shape of a solid object, shape (number of shapes,).
        is_walker: True for each shape of a walker, shape (number of shapes,).
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    base: int
    wheels: NDArray[np.int64]
    speeds: NDArray[np.int64]
    wheel_of: NDArray[np.int64]
    is_solid: NDArray[np.bool_]
    is_walker: NDArray[np.bool_]


def build_model(
    world: World, robot: RobotModel, config: MujocoConfig, middle: tuple[float, float]
) -> MujocoModel:
    """Return a robot and what is around a place of a world.

    Args:
        world: Ground, objects and walkers.
        robot: Parameters of the body.
        config: Parameters of the physics.
        middle: Place in the map around which ground and objects are taken [m].
    """
    spec = _robot(robot, config)
    ground, place = ground_around(world.ground, *middle)
    low, rise = float(ground.heights.min()), max(float(np.ptp(ground.heights)), _FLAT)
    nx, ny = ground.heights.shape
    size = [ground.width / 2, ground.depth / 2, rise, _BASE]
    heights = (ground.heights.T.ravel() - low) / rise
    spec.add_hfield(name="ground", nrow=ny, ncol=nx, size=size, userdata=heights)
    spec.worldbody.add_geom(
        **{"type": mujoco.mjtGeom.mjGEOM_HFIELD, "hfieldname": "ground"},
        **{"pos": [*place, low], "contype": 0, "conaffinity": _GROUND},
    )
    solids = [_add_solid(spec, each, k) for k, each in enumerate(_solids_near(world, middle))]
    walkers = [
        _add_walker(spec, mover.plan.radius, mover.plan.height / 2, k)
        for k, mover in enumerate(world.movers)
    ]
    model = spec.compile()
    return _numbered(model, solids, walkers)


def _numbered(model: mujoco.MjModel, solids: list[str], walkers: list[str]) -> MujocoModel:
    """Return a compiled model with the numbers of its parts, by the names of some shapes."""
    wheels = np.array([model.joint(f"{name}_joint").id for name in WHEELS])
    wheel_of = np.full(model.ngeom, -1)
    for wheel, name in enumerate(WHEELS):
        wheel_of[model.geom_bodyid == model.body(name).id] = wheel
    is_solid, is_walker = np.zeros((2, model.ngeom), dtype=np.bool_)
    is_solid[[model.geom(name).id for name in solids]] = True
    is_walker[[model.geom(name).id for name in walkers]] = True
    return MujocoModel(
        model=model,
        data=mujoco.MjData(model),
        base=model.body("base_link").id,
        wheels=wheels,
        speeds=model.jnt_dofadr[wheels].astype(np.int64),
        wheel_of=wheel_of,
        is_solid=is_solid,
        is_walker=is_walker,
    )


def _robot(robot: RobotModel, config: MujocoConfig) -> mujoco.MjSpec:
    """Return the robot alone: its URDF with motors, friction and what its shapes meet."""
    spec = mujoco.MjSpec.from_string(robot.to_urdf())
    spec.compiler.fusestatic = False
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.timestep = config.step
    spec.option.impratio = config.friction_impedance
    base = spec.body("base_link")
    base.add_freejoint()
    for geom in base.geoms:
        _let_meet(geom, _GROUND | _SOLID, config.body_friction)
    for name in WHEELS:
        _prepare_wheel(spec, name, robot, config)
    return spec


def _prepare_wheel(spec: mujoco.MjSpec, name: str, robot: RobotModel, config: MujocoConfig) -> None:
    """Give a wheel its sphere, its contacts and its motor.

    MuJoCo's velocity actuators are springs of the speed, whose torque it knows before the contacts'
    and which stall or shake the wheel. The dry friction of a joint is a torque up to a limit that
    takes its speed away, found together with the contacts: of a speed less the commanded one it is
    bullet's motor.
    """
    wheel = spec.body(name)
    (cylinder,) = wheel.geoms
    size = [robot.wheel_radius, 0.0, 0.0]
    sphere = wheel.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, mass=0.0)
    for geom, others in ((cylinder, _SOLID), (sphere, _GROUND)):
        _let_meet(geom, others, config.friction)
        geom.solref[:] = [config.contact_time, 1.0]
        geom.solimp[:] = _constant(config.impedance)
    joint = spec.joint(f"{name}_joint")
    joint.armature, joint.frictionloss = config.armature, robot.wheel_torque
    joint.solref_friction[:] = [config.motor_time, 1.0]
    joint.solimp_friction[:] = _constant(config.motor_impedance)


def _constant(impedance: float) -> list[float]:
    """Return MuJoCo's ``solimp`` of an impedance that does not depend on the distance."""
    return [impedance, impedance, 0.001, 0.5, 2.0]


def _let_meet(geom: mujoco.MjsGeom, others: int, friction: float) -> None:
    """Set what a shape of the robot meets, and its friction; the robot's own shapes never meet.

    Its friction is that of its contacts, whatever it meets.
    """
    geom.contype, geom.conaffinity = others, 0
    geom.friction, geom.priority = [friction, 0.0, 0.0], 1


def _solids_near(world: World, middle: tuple[float, float]) -> list[SceneObject]:
    """Return the solid objects in the window around a place."""
    solids = [each for each in world.objects if TRAITS[each.semantic].solid]
    least, most = bounds(solids)
    near = (least[:, :2] < np.add(middle, REACH)).all(axis=1)
    near &= (most[:, :2] > np.subtract(middle, REACH)).all(axis=1)
    return [solids[k] for k in np.flatnonzero(near).tolist()]


def _add_solid(spec: mujoco.MjSpec, solid: SceneObject, number: int) -> str:
    """Add a solid object, which is felt from ``TOUCH_DISTANCE`` on, and return its name."""
    name = f"solid_{number}"
    mesh = spec.add_mesh(name=name, uservert=solid.vertices.astype(np.float64).ravel())
    # Thin ones have next to no volume; nothing that stands needs a mass.
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.worldbody.add_geom(
        **{"name": name, "type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name},
        **{"contype": 0, "conaffinity": _SOLID},
        gap=TOUCH_DISTANCE,
    )
    return name


def _add_walker(spec: mujoco.MjSpec, radius: float, half: float, number: int) -> str:
    """Add an upright cylinder that nothing pushes, and return the name of its shape."""
    name = f"walker_{number}"
    body = spec.worldbody.add_body(name=name, mocap=True)
    body.add_geom(
        **{"name": name, "type": mujoco.mjtGeom.mjGEOM_CYLINDER, "size": [radius, half, 0.0]},
        **{"contype": 0, "conaffinity": _SOLID},
        gap=TOUCH_DISTANCE,
    )
    return name
