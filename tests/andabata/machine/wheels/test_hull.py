"""Hull of a body on ray-cast wheels: objects, ground and walkers push it away."""

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.machine.solid_contact import build_solids
from andabata.machine.vectors import axes_of
from andabata.machine.wheels.body import WheelsConfig, wheels_body
from andabata.machine.wheels.contact import Motion
from andabata.machine.wheels.hull import meet_walkers, scrape_hull, strike_hull
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rooms.mover_motion import Movers
from worlds.walking import WalkerTrack

ROBOT = RobotModel()
BODY = wheels_body(ROBOT, WheelsConfig())
LEVEL = axes_of(np.array([0.0, 0.0, 0.0, 1.0]))
ZERO = (0.0, 0.0, 0.0)
FLAT = np.zeros((41, 41), dtype=np.float32), 0.1
FRONT = ROBOT.length / 2


def motion(x=0.0, z=BODY.height, velocity=ZERO):
    return Motion((x, 0.0, z), LEVEL, velocity, ZERO)


@pytest.fixture(scope="module")
def wall(make_ground):
    """Return a wall whose face is at x = 1."""
    made = box(SemanticClass.WALL, (1.5, 0.0, 1.0), (1.0, 6.0, 4.0))
    return build_solids(make_ground(objects=[made], size=8.0))


@pytest.mark.parametrize(
    ("gap", "touches", "pushes"),
    [(0.01, False, False), (0.004, True, False), (-0.01, True, True)],
)
def test_a_wall_touches_at_five_millimetres_and_pushes_when_overlapped(wall, gap, touches, pushes):
    """The force is along the wall's normal, away from it."""
    loads = np.zeros(10)
    struck = strike_hull(motion(1.0 - FRONT - gap), BODY, wall, np.array([0]), loads)
    assert struck is touches
    assert bool(loads[0] < 0.0) is pushes
    np.testing.assert_allclose(loads[1:3], 0.0, atol=1e-9)


def test_a_contact_undoes_a_share_of_the_closing_speed_by_the_mass_it_feels(wall):
    """At a wall as high as the body the contact is above the centre of mass: less than the mass."""
    loads = np.zeros(10)
    strike_hull(
        motion(1.0 - FRONT + 1e-9, velocity=(1.0, 0.0, 0.0)), BODY, wall, np.array([0]), loads
    )
    place = np.array(loads[:3])
    assert 0.0 < -place[0] * 0.005 < 0.4 * ROBOT.mass
    spin = loads[4] / BODY.inertia[1] * 0.005
    lever = loads[4] / loads[0]
    # Speed at the contact after the sub-step, of 1 m/s before.
    after = 1.0 + place[0] / ROBOT.mass * 0.005 + spin * lever
    assert after == pytest.approx(1 - 0.4, abs=1e-3)


def test_walls_rub(wall):
    """Friction is against the slip, a share of the force, and never reverses the motion."""
    for slip in (1.0, 1e-4):
        loads = np.zeros(10)
        moving = motion(1.0 - FRONT + 0.01, velocity=(0.0, slip, 0.0))
        strike_hull(moving, BODY, wall, np.array([0]), loads)
        assert loads[1] < 0.0
        assert -loads[1] <= 0.4 * -loads[0] + 1e-9
        assert -loads[1] / ROBOT.mass * 0.005 < slip


def test_the_floor_rests_on_the_ground_only_when_it_reaches_it():
    """A body on its wheels has its floor in the air."""
    loads = np.zeros(10)
    scrape_hull(motion(), BODY, FLAT, loads)
    np.testing.assert_array_equal(loads, 0.0)
    scrape_hull(motion(z=BODY.height - ROBOT.clearance - 0.01), BODY, FLAT, loads)
    assert loads[2] > 0.0
    np.testing.assert_allclose(np.delete(loads, 2), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("gap", "radius", "foot", "touches"),
    [
        (0.01, 0.3, 0.0, False),
        (0.0, 0.3, 0.0, True),
        (0.0, 0.0, 0.0, False),
        (0.0, 0.3, 3.0, False),
    ],
)
def test_a_walker_touches_the_rectangle_of_the_hull(gap, radius, foot, touches):
    """One that is not there, or far above, touches nothing."""
    places = np.array([[[FRONT + radius + gap, 0.1]]])
    movers = Movers(places, np.zeros((1, 1, 2)), np.full((1, 1), radius))
    track = WalkerTrack(movers, np.full((1, 1), foot), np.full(1, 1.7), 0, 100.0)
    assert meet_walkers(motion(), BODY, track, 0, np.zeros(10)) is touches


def test_a_walker_pushes_with_its_own_speed():
    """The force grows with the speed at which it comes."""
    forces = []
    for speed in (0.0, 1.0):
        places = np.array([[[FRONT + 0.3 - 0.01, 0.0]]])
        movers = Movers(places, np.array([[[-speed, 0.0]]]), np.full((1, 1), 0.3))
        track = WalkerTrack(movers, np.zeros((1, 1)), np.full(1, 1.7), 0, 100.0)
        loads = np.zeros(10)
        meet_walkers(motion(), BODY, track, 0, loads)
        forces.append(-loads[0])
    assert 0.0 < forces[0] < forces[1]
