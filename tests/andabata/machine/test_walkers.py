"""Walkers and the robot: contacts in all plants, beams at their time, and no cost without any."""

import numpy as np
import pytest

from andabata.machine.beams import BeamTables, place_beams
from andabata.machine.kinematics import SkidSteer
from andabata.machine.lidar import LidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import PoseTrack
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from terrain.classes import SemanticClass
from terrain.objects import frustum
from tests.support.plants import ALL_PLANTS, needs_bullet
from tests.support.walking_worlds import agent, heading_west, peopled, walker
from worlds.rays.scene import RayScene
from worlds.world import Start

ROBOT = RobotModel()
STILL, AHEAD = WheelSpeeds(0.0, 0.0), SkidSteer(ROBOT).wheel_speeds(0.3, 0.0)
EXACT = LidarConfig(noise=0.0, dropout=0.0, mixed=0.0)
ORIGIN = Start(0.0, 0.0, 0.0)


@pytest.fixture(params=ALL_PLANTS)
def plant(request):
    return request.param


def simulator(world, plant="kinematic", seed=0, reach=np.inf, **sensing):
    """Return a simulator without proprioception that is put down at the origin."""
    config = SensingConfig(**({"proprioception": None, "scanner": "horizontal"} | sensing))
    rng = np.random.default_rng(seed)
    made = Simulator(world, RayScene(world), ROBOT, plant, config, rng, reach)
    made.reset(ORIGIN)
    return made


def until_contact(made, wheels, seconds):
    """Drive until something is touched; return readings of the last period, or None."""
    for _ in range(round(10 * seconds)):
        readings = made.step(wheels)
        if readings.truth.collided:
            return readings
    return None


@pytest.mark.parametrize(
    ("wheels", "place", "velocity", "contact"),
    [
        (STILL, (2.0, 0.0), (-0.8, 0.0), Contact.HIT_AT_REST),
        (STILL, (0.1, 2.0), (0.0, -0.8), Contact.HIT_AT_REST),
        (AHEAD, (1.5, 0.0), (0.0, 0.0), Contact.MOVER),
        (AHEAD, (1.5, 0.0), (-0.2, 0.0), Contact.MOVER),
        (AHEAD, (3.0, 0.0), (-0.8, 0.0), Contact.HIT),
        (AHEAD, (-2.0, 0.0), (1.0, 0.0), Contact.HIT),
    ],
)
def test_who_drove_into_whom_is_told_apart(make_ground, plant, wheels, place, velocity, contact):
    """A robot that stands was hit; else the larger share of the closing speed decides."""
    made = simulator(peopled(make_ground(), walker(place, velocity)), plant)
    readings = until_contact(made, wheels, 9.0)
    made.close()
    assert readings.truth.contact == contact
    # They meet at 0.25 m; then a walker goes on for the rest of the period, a body is pushed.
    x, y = readings.truth.pose.position[:2]
    places = made.walkers.track.last(10).movers.places[:, 0]
    gap = np.hypot(
        np.maximum(np.abs(places[:, 0] - x) - ROBOT.length / 2, 0.0),
        np.maximum(np.abs(places[:, 1] - y) - ROBOT.width / 2, 0.0),
    )
    assert 0.25 - 0.1 * np.hypot(*velocity) - 0.01 < gap.min() < 0.28


def test_a_vehicle_strikes_a_robot_that_stands(make_ground, plant):
    """At its own radius, a metre, and it drives on for the rest of the period at most."""
    made = agent("vehicle", (4.0, 0.0), radius=1.0, track=((4.0, 0.0), (-5.0, 0.0)))
    simulated = simulator(peopled(make_ground(), made), plant)
    readings = until_contact(simulated, STILL, 5.0)
    simulated.close()
    assert readings.truth.contact == Contact.HIT_AT_REST
    gap = readings.walkers[0, 0] - readings.truth.pose.position[0] - ROBOT.length / 2
    assert 1.0 - 0.1 - 0.01 < gap < 1.03


def test_a_vehicle_that_stands_is_driven_into(make_ground, plant):
    """The robot's is the whole closing speed."""
    made = agent("vehicle", (2.0, 0.0), speed=0.0, radius=1.0, track=((2.0, 0.0), (3.0, 0.0)))
    simulated = simulator(peopled(make_ground(), made), plant)
    readings = until_contact(simulated, AHEAD, 5.0)
    simulated.close()
    assert readings.truth.contact == Contact.MOVER


def test_a_large_walker_has_its_body_as_soon_as_its_edge_is_near(make_ground, plant):
    """Its middle is more than four metres away when it strikes."""
    made = walker((8.0, 0.0), (-1.0, 0.0), radius=4.5)
    simulated = simulator(peopled(make_ground(size=40.0), made), plant)
    readings = until_contact(simulated, STILL, 5.0)
    simulated.close()
    assert readings.truth.contact == Contact.HIT_AT_REST
    assert readings.walkers[0, 0] > 4.5


@pytest.mark.parametrize("yields", [False, True])
def test_who_gives_way_lets_a_robot_pass(make_ground, yields):
    """It sees where the robot truly is; one that does not give way strikes it."""
    made = heading_west((6.0, 0.0), yields=yields)
    readings = until_contact(simulator(peopled(make_ground(), made)), AHEAD, 9.0)
    if yields:
        assert readings is None
    else:
        assert readings.truth.contact == Contact.HIT


def test_a_walker_that_passes_is_no_contact(make_ground, plant):
    """One that keeps a hand's breadth touches nothing, and neither does one not there yet."""
    aside = walker((3.0, -0.27 - 0.25 - 0.08), (-0.8, 0.0))
    late = walker((0.3, 0.0), appears_at=30.0)
    made = simulator(peopled(make_ground(), aside, late), plant)
    assert until_contact(made, STILL, 6.0) is None
    made.close()


def test_a_walker_stops_the_body_as_a_trunk_does(make_ground, plant):
    """Nobody drives through one that stands, and it is not moved."""
    made = simulator(peopled(make_ground(), walker((1.2, 0.0))), plant)
    for _ in range(80):
        readings = made.step(AHEAD)
    made.close()
    assert readings.truth.collided
    front = readings.truth.pose.position[0] + ROBOT.length / 2
    assert front == pytest.approx(0.95, abs=0.06)
    np.testing.assert_array_equal(readings.walkers[0, :2], [1.2, 0.0])


def test_what_stands_comes_first(make_ground, plant):
    """A robot that stands against a trunk collides with it, whoever else comes."""
    trunk = frustum(SemanticClass.TRUNK, (1.0, 0.0, 0.0), (0.15, 0.15), 3.0)
    made = simulator(peopled(make_ground(objects=[trunk]), walker((-6.0, 0.0), (0.6, 0.0))), plant)
    contacts = [made.step(AHEAD).truth.contact for _ in range(60)]
    made.close()
    assert contacts[0] is Contact.NONE
    assert contacts[-1] is Contact.OBSTACLE


@needs_bullet
def test_bullet_forgets_walkers_when_the_robot_is_put_down_anew(make_ground):
    """The cylinder of the last drive does not stand where the robot is put down."""
    made = simulator(peopled(make_ground(), walker((3.0, 0.0), (-0.8, 0.0))), "bullet")
    assert until_contact(made, STILL, 9.0) is not None
    place = made.walkers.track.now[0, :2]
    made.reset(Start(float(place[0]), float(place[1]), 0.0))
    assert not made.step(STILL).truth.collided
    made.close()


def test_a_turning_laser_smears_a_walker(make_ground):
    """Its points lie on the cylinder at the time of each beam, and are labelled as a walker's."""
    world = peopled(make_ground(), walker((3.0, 0.0), (0.0, 0.5), radius=0.25))
    made = simulator(world, scanner="rotating", lidar=EXACT)
    track = PoseTrack()
    track.append(0.0, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    seen = []
    for _ in range(45):
        sweeps = made.step(STILL).sweeps
        rows = np.flatnonzero(sweeps.classes.ravel() == SemanticClass.WALKER)
        points, times = place_beams(sweeps, track, ROBOT.lidar_height, BeamTables(), rows)
        seen.append(np.column_stack([points, times]))
    x, y, z, t = np.concatenate(seen).T
    assert len(x) > 300
    # From the side that faces the laser; beams of a period's end may go on into the next one.
    at = 0.5 * np.minimum(t, (np.floor(t * 10) + 1) / 10)
    np.testing.assert_allclose(np.hypot(x - 3.0, y - at), 0.25, atol=0.025)
    assert z.max() == pytest.approx(1.7, abs=0.1)
    # Two half turns see it in two places.
    assert np.ptp(y) > 1.5


def test_the_reach_of_the_laser_changes_nothing_near_walkers(make_ground):
    """With mixed pixels and noise, returns within the reach are the same to the bit."""
    trunk = frustum(SemanticClass.TRUNK, (7.0, 1.0, 0.0), (0.3, 0.3), 3.0)
    made = walker((3.0, 0.0), (0.0, 0.5)), walker((6.0, 0.5), (0.1, 0.2)), walker((8.0, -3.0))
    world = peopled(make_ground(objects=[trunk]), *made)
    far, near = (
        simulator(world, scanner="rotating", reach=reach, lidar=LidarConfig(mixed=0.5))
        for reach in (np.inf, 5.0)
    )
    for _ in range(40):
        a, b = far.step(STILL).sweeps, near.step(STILL).sweeps
        within = a.ranges < 4.8
        np.testing.assert_array_equal(a.ranges[within], b.ranges[within])
        np.testing.assert_array_equal(a.classes[within], b.classes[within])


def test_past_sweeps_see_walkers_where_they_were(make_ground):
    """Sweeps of a skipped period are those of that period."""
    world = peopled(make_ground(), walker((2.0, -1.0), (0.0, 0.6)))
    scanned, skipped = (simulator(world, scanner="rotating", lidar=EXACT) for _ in range(2))
    expected = [scanned.step(STILL).sweeps for _ in range(34)]
    for _ in range(34):
        skipped.step(STILL, skip_scan=True)
    for k in (3, 17, 20, 32):
        again = skipped.sweeps(k / 10, (k + 1) / 10)
        np.testing.assert_allclose(again.ranges[:3], expected[k].ranges[:3], atol=1e-4)


def test_horizontal_beams_meet_walkers(make_ground):
    """The scanner of stage 1 sees where they are at the end of the period."""
    along = np.array([np.cos(np.pi / 32), np.sin(np.pi / 32)])  # Middle of the sector on the left.
    made = simulator(peopled(make_ground(), walker(tuple(4.0 * along), tuple(-along))))
    ranges = [made.step(STILL).horizontal[16] for _ in range(5)]
    np.testing.assert_allclose(ranges, 3.75 - 0.1 * np.arange(1, 6), atol=0.01)


def test_walkers_far_away_change_nothing(make_ground, plant):
    """A drive and its sweeps are the same to the bit as in the world without them."""
    bare = make_ground(lambda x, y: 0.02 * np.sin(x))
    lone = simulator(bare, plant, scanner="rotating")
    crowded = simulator(peopled(bare, walker((-8.0, -8.0))), plant, reach=6.0, scanner="rotating")
    for _ in range(10):
        a, b = lone.step(AHEAD), crowded.step(AHEAD)
        np.testing.assert_array_equal(a.true_track, b.true_track)
        within = a.sweeps.ranges < 5.8
        np.testing.assert_array_equal(a.sweeps.ranges[within], b.sweeps.ranges[within])
        assert a.walkers is None
        assert b.walkers.shape == (1, 5)
    for made in (lone, crowded):
        made.close()


def test_the_same_seed_gives_the_same_readings_among_walkers(make_ground):
    """A drive is a function of its seed and its commands, after a longer one too."""
    world = peopled(make_ground(), walker((2.0, 0.5), (-0.3, 0.0)), walker((0.0, 5.0), (0.4, 0.1)))
    fresh, used = simulator(world, seed=4), simulator(world, seed=4)
    for _ in range(30):
        used.step(AHEAD)
    for made in (fresh, used):
        made._rng.bit_generator.state = np.random.PCG64(9).state
        made.reset(ORIGIN)
    for _ in range(20):
        a, b = fresh.step(AHEAD), used.step(AHEAD)
        np.testing.assert_array_equal(a.true_track, b.true_track)
        np.testing.assert_array_equal(a.horizontal, b.horizontal)
        np.testing.assert_array_equal(a.walkers, b.walkers)
