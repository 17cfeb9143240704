"""Laws that all plants obey: climbing, contact, refusal; the fast ones drive as the reference."""

import numpy as np
import pytest

from andabata.machine.kinematic_vehicle import KinematicConfig, KinematicVehicle
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.vehicle import make_vehicle
from andabata.machine.wheels.vehicle import WheelsVehicle
from terrain.classes import SemanticClass
from terrain.generators import smooth_noise
from terrain.objects import box, frustum
from tests.support.driven_plants import ROBOT, slope, twist
from tests.support.plants import ALL_PLANTS, needs_bullet
from worlds.world import Start

ORIGIN = Start(0.0, 0.0, 0.0)


@pytest.fixture(params=ALL_PLANTS)
def plant(request):
    return request.param


def vehicle_tipped(rows):
    x, y = rows[-1, 3:5]
    return 1 - 2 * (x * x + y * y) < np.cos(np.deg2rad(60))


@pytest.fixture(scope="module")
def rough(make_ground):
    """Return rough ground that rises along x."""
    bumps = 0.25 * smooth_noise((301, 301), 0.1, 4.0, np.random.default_rng(4))
    return make_ground(lambda x, y: bumps + 0.08 * x, size=30.0)


RATES = (0.0, 0.4, 0.0, -0.4, 0.3, -0.2)
STARTS = tuple(Start(0.0, -2.0, yaw) for yaw in (0.3, 2.0, -1.2))


@pytest.fixture(scope="module")
def reference(rough):
    """Return the rows of three drives in the reference plant, five seconds at each yaw rate."""
    vehicle, drives = make_vehicle("bullet", rough, ROBOT, np.random.default_rng(0)), []
    for start in STARTS:
        vehicle.place(start)
        drives.append([twist(vehicle, 0.3, rate, 5.0) for rate in RATES])
    vehicle.close()
    return drives


@needs_bullet
@pytest.mark.parametrize(("name", "most_tilt"), [("wheels", 1.2), ("kinematic", 2.0)])
def test_fast_plants_are_calibrated_against_the_reference(rough, reference, name, most_tilt):
    """Stated difference on rough ground: degrees of tilt (rms), 5 % of speed and of turn."""
    if name == "wheels":
        fast = WheelsVehicle(rough, ROBOT)
    else:
        exact = KinematicConfig(slip_sigma=0.0)
        fast = KinematicVehicle(rough, ROBOT, np.random.default_rng(0), exact)
    tilts, driven, turned = [], np.zeros(2), np.zeros(2)
    for start, drive in zip(STARTS, reference, strict=True):
        fast.place(start)
        for rate, expected in zip(RATES, drive, strict=True):
            rows = expected, twist(fast, 0.3, rate, 5.0)
            driven += [np.hypot(*np.diff(r[:, :2], axis=0).T).sum() for r in rows]
            turned += [np.sign(rate) * wrap(yaw(r[-1]) - yaw(r[0])) for r in rows]
            # The reference's places, as the fast plant would stand there.
            for row in (*expected[::20], expected[-1]):
                fast.place(Start(row[0], row[1], yaw(row)))
                tilts.append(np.subtract(tilt(row), tilt(fast.drive(WheelSpeeds(0, 0), 1)[-1])))
    assert (np.rad2deg(np.sqrt(np.mean(np.square(tilts), axis=0))) < most_tilt).all()
    assert driven[0] == pytest.approx(driven[1], rel=0.05)
    assert turned[0] == pytest.approx(turned[1], rel=0.05)


def yaw(pose):
    x, y, z, w = pose[3:7]
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def tilt(pose):
    x, y, z, w = pose[3:7]
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return roll, np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))


@pytest.mark.parametrize("angle", [10, 20, 25])
def test_it_climbs(make_ground, plant, angle):
    """All plants climb slopes at the commanded speed."""
    vehicle = make_vehicle(plant, make_ground(slope(angle)), ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 4.0)
    vehicle.close()
    climbed = (rows[-1, 0] - rows[99, 0]) / 3.0
    assert climbed == pytest.approx(0.3 * np.cos(np.deg2rad(angle)), rel=0.12)
    assert not vehicle_tipped(rows)


def test_a_trunk_stops_it_and_is_a_collision(make_ground, plant):
    """A trunk stops all plants and counts as a collision."""
    trunk = frustum(SemanticClass.TRUNK, (2.0, 0.1, 0.0), (0.15, 0.15), 3.0)
    vehicle = make_vehicle(plant, make_ground(objects=[trunk]), ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    for _ in range(80):
        row = twist(vehicle, 0.3, 0.0, 0.1)[-1]
        if vehicle.state.collided:
            break
    vehicle.close()
    assert row[0] + ROBOT.length / 2 == pytest.approx(1.85, abs=0.12)


def test_grass_and_bushes_let_it_pass(make_ground, plant):
    """Plants do not stop the body."""
    grass = box(SemanticClass.HIGH_GRASS, (2.0, 0.0, 0.3), (1.0, 2.0, 0.6))
    bush = box(SemanticClass.BUSH, (4.0, 0.0, 0.3), (0.5, 2.0, 0.6))
    world = make_ground(objects=[grass, bush])
    vehicle = make_vehicle(plant, world, ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    rows = twist(vehicle, 0.3, 0.0, 20.0)
    assert rows[-1, 0] > 5.0
    assert not vehicle.state.collided
    assert world.truth.forbidden_at(2.0, 0.0)  # Trespass, not contact.
    vehicle.close()


@pytest.mark.parametrize(
    ("height", "aside", "hit"),
    [(0.075, 0.0, False), (0.075, 0.23, True), (0.13, 0.0, True), (0.13, 0.23, True)],
)
def test_a_low_rock_passes_between_the_wheels(make_ground, plant, height, aside, hit):
    """Only wheels strike a low rock, the whole body a high one."""
    rock = box(SemanticClass.ROCK, (1.5, aside, 0.0), (0.12, 0.12, 2 * height))
    world = make_ground(objects=[rock])
    assert world.truth.forbidden_at(1.5, aside)
    vehicle = make_vehicle(plant, world, ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    touched = False
    for _ in range(80):
        twist(vehicle, 0.3, 0.0, 0.1)
        touched |= vehicle.state.collided
    vehicle.close()
    assert touched is hit


@pytest.mark.parametrize("wheels", [WheelSpeeds(np.nan, 0.0), WheelSpeeds(0.0, np.inf)])
def test_speeds_that_are_no_numbers_are_refused(make_ground, plant, wheels):
    """Speeds that are not finite are an error."""
    vehicle = make_vehicle(plant, make_ground(size=4.0), ROBOT, np.random.default_rng(0))
    with pytest.raises(ValueError, match="expected finite speeds"):
        vehicle.drive(wheels, 1)
    vehicle.close()


def test_an_unknown_plant_is_refused(make_ground):
    """A plant of another name is an error that lists the known ones."""
    with pytest.raises(
        ValueError, match="expected one of bullet, mujoco, wheels, kinematic, got 'hover'"
    ):
        make_vehicle("hover", make_ground(size=4.0), ROBOT, np.random.default_rng(0))


def test_time_starts_at_zero_and_advances_by_ticks(make_ground, plant):
    """Stamps of all plants count ticks since the body was put down, and rows have one per tick."""
    vehicle = make_vehicle(plant, make_ground(size=4.0), ROBOT, np.random.default_rng(0))
    vehicle.place(ORIGIN)
    assert vehicle.state.stamp == 0.0
    rows = vehicle.drive(WheelSpeeds(0.0, 0.0), 7)
    assert rows.shape == (7, 9)
    assert vehicle.state.stamp == 0.07
    np.testing.assert_allclose(vehicle.state.pose.position, rows[-1, :3])
    vehicle.close()
