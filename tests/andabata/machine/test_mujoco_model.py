"""MuJoCo's model of a robot and what is around it: masses, shapes, and what meets what."""

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from terrain.classes import SemanticClass
from terrain.objects import box, frustum
from tests.support.walking_worlds import peopled, walker

pytest.importorskip("mujoco", reason="mujoco is not installed (extra `mujoco`)")

import mujoco

from andabata.machine.mujoco_model import WHEELS, MujocoConfig, build_model

ROBOT = RobotModel()


def built(world, middle=(0.0, 0.0)):
    return build_model(world, ROBOT, MujocoConfig(), middle)


def test_the_robot_weighs_what_it_does_and_has_its_wheels(make_ground):
    """Mass, centre of mass, and the four joints in their order."""
    sim = built(make_ground())
    assert sim.model.body_mass.sum() == pytest.approx(ROBOT.mass)
    assert [sim.model.joint(int(k)).name for k in sim.wheels] == [f"{n}_joint" for n in WHEELS]
    assert sim.speeds.tolist() == [6, 7, 8, 9]
    assert (sim.model.dof_frictionloss[sim.speeds] == ROBOT.wheel_torque).all()
    lever = sim.model.body("base_link").ipos[2]
    assert lever == pytest.approx(ROBOT.centre_of_mass - ROBOT.wheel_radius)


def test_the_ground_has_the_heights_of_the_world(make_ground):
    """Rays from above end on the surface, in a window away from the middle."""
    world = make_ground(lambda x, y: 0.3 * x - 0.1 * y + np.sin(x), size=60.0, cell=0.5)
    sim = built(world, (12.0, -9.0))
    mujoco.mj_forward(sim.model, sim.data)
    for x, y in ((12.0, -9.0), (18.3, -3.1), (5.2, -16.4)):
        shape = np.array([-1], dtype=np.int32)
        start, down = np.array([x, y, 50.0]), np.array([0.0, 0.0, -1.0])
        far = mujoco.mj_ray(sim.model, sim.data, start, down, None, 1, -1, shape)
        assert 50.0 - far == pytest.approx(float(world.ground.height_at(x, y)), abs=1e-4)


def test_what_stands_in_the_window_is_there_and_plants_are_not(make_ground):
    """Solid objects within 8 m, also those that reach in from outside; no bush."""
    objects = [
        box(SemanticClass.ROCK, (1.0, 0.0, 0.0), (0.3, 0.3, 0.3)),
        box(SemanticClass.WALL, (10.0, 0.0, 0.5), (6.0, 0.2, 1.0)),
        frustum(SemanticClass.TRUNK, (9.0, 9.0, 0.0), (0.2, 0.2), 3.0),
        box(SemanticClass.BUSH, (-1.0, 0.0, 0.0), (0.3, 0.3, 0.3)),
    ]
    world = make_ground(objects=objects, size=40.0)
    assert built(world).is_solid.sum() == 2
    sim = built(world, (-3.0, 0.0))
    assert sim.is_solid.sum() == 1
    place = sim.model.geom_pos[np.flatnonzero(sim.is_solid)[0]]
    np.testing.assert_allclose(place, [1.0, 0.0, 0.0], atol=1e-6)


def test_spheres_meet_the_ground_and_wheels_meet_solids(make_ground):
    """Of the two shapes of a wheel each has contacts with its own kind of thing alone."""
    stone = box(SemanticClass.ROCK, (0.3, 0.23, 0.0), (0.3, 0.3, 0.06))
    sim = built(make_ground(objects=[stone]))
    sim.data.qpos[:3] = 0.0, 0.0, ROBOT.wheel_radius - 0.01
    mujoco.mj_forward(sim.model, sim.data)
    sphere = int(mujoco.mjtGeom.mjGEOM_SPHERE)
    met = set()
    for pair in sim.data.contact.geom:
        wheel = int(np.flatnonzero(sim.wheel_of[pair] >= 0)[0])
        is_sphere = sim.model.geom_type[pair[wheel]] == sphere
        met.add((bool(is_sphere), bool(sim.is_solid[pair].any())))
    assert met == {(True, False), (False, True)}


def test_walkers_are_cylinders_of_their_size(make_ground):
    """One of the world's walkers has a shape that nothing pushes."""
    world = peopled(make_ground(), walker((3.0, 0.0)))
    sim = built(world)
    (shape,) = np.flatnonzero(sim.is_walker)
    plan = world.movers[0].plan
    np.testing.assert_allclose(sim.model.geom_size[shape, :2], [plan.radius, plan.height / 2])
    assert sim.model.nmocap == 1
