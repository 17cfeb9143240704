"""Rigid-body motion on ray-cast wheels: free fall, energy, motors, repeats."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.wheels.body import GRAVITY, SUB_STEP
from andabata.machine.wheels.vehicle import WheelsVehicle
from worlds.world import Start

ROBOT = RobotModel()
STILL = WheelSpeeds(0.0, 0.0)


@pytest.fixture
def vehicle(make_ground):
    return WheelsVehicle(make_ground(size=10.0), ROBOT)


def test_it_falls_freely(vehicle):
    """In the air it falls as semi-implicit Euler says, and its angular momentum stays."""
    state = vehicle._state
    state.place[2] += 5.0
    state.momentum[:] = 0.3, -0.2, 0.4
    before, momentum = state.place.copy(), state.momentum.copy()
    vehicle.drive(STILL, 30)
    n = 60
    fallen = GRAVITY * SUB_STEP**2 * n * (n + 1) / 2
    np.testing.assert_allclose(state.place, before - [0.0, 0.0, fallen], atol=1e-9)
    assert state.velocity[2] == pytest.approx(-GRAVITY * n * SUB_STEP)
    np.testing.assert_allclose(state.momentum, momentum, rtol=1e-12)
    assert np.linalg.norm(state.quaternion) == pytest.approx(1.0)


def test_what_speeds_wheels_up_turns_the_body_back(vehicle):
    """In the air the momentum of wheels and body about the axles stays nought."""
    state, body = vehicle._state, vehicle._body
    state.place[2] += 5.0
    vehicle.drive(WheelSpeeds(3.0, 3.0), 20)
    left = Rotation.from_quat(state.quaternion).apply([0.0, 1.0, 0.0])
    wheels = body.tyres.inertia * state.speeds.sum()
    assert wheels > 0
    assert state.momentum @ left == pytest.approx(-wheels, rel=1e-6)


def mechanical_energy(vehicle):
    """Return kinetic energy, potential energy and that of the tyres' springs at most [J]."""
    state, body = vehicle._state, vehicle._body
    turned = Rotation.from_quat(state.quaternion).inv().apply(state.momentum)
    kinetic = body.mass * state.velocity @ state.velocity / 2
    return kinetic + (turned**2 / body.inertia).sum() / 2 + body.mass * GRAVITY * state.place[2]


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.3, 0.2), (np.pi, 0.0), (1.5, 0.4)])
def test_a_fall_gives_no_energy_back(vehicle, tilt):
    """Whatever it falls on, wheels, corners or roof, it never rises above where it was let go."""
    state = vehicle._state
    state.place[2] += 0.8
    state.quaternion[:] = Rotation.from_euler("xy", tilt).as_quat()
    energies = [mechanical_energy(vehicle)]
    for _ in range(300):
        vehicle.drive(STILL, 1)
        energies.append(mechanical_energy(vehicle))
    # Semi-implicit Euler swings a little about the energy of free fall: by m g v h / 2.
    assert max(energies) <= energies[0] + 0.5 * ROBOT.mass * GRAVITY * 4.0 * SUB_STEP
    assert energies[-1] < energies[0] - 50.0
    assert np.ptp(energies[-50:]) < 1.0


def test_a_motor_holds_its_speed_within_its_torque(make_ground):
    """Wheels turn at once as they are told; a weak motor is stopped by the weight uphill."""
    world = make_ground(lambda x, y: np.tan(np.deg2rad(20.0)) * x)
    for torque, climbs in ((20.0, True), (2.0, False)):
        vehicle = WheelsVehicle(world, ROBOT.model_copy(update={"wheel_torque": torque}))
        vehicle.place(Start(0.0, 0.0, 0.0))
        vehicle.drive(WheelSpeeds(3.0, 3.0), 200)
        wheels = vehicle.state.wheels
        assert bool(wheels.left > 2.9) is climbs
        assert bool(vehicle.state.linear[0] > 0.25) is climbs


@pytest.mark.parametrize("wheels", [(1e300, -1e300), (12.0, -12.0), (-1e9, 0.0)])
def test_no_command_makes_a_state_that_is_no_number(vehicle, wheels):
    """Wheels turn no faster than they can, and the body stays in the world of numbers."""
    rows = vehicle.drive(WheelSpeeds(*wheels), 400)
    assert np.isfinite(rows).all()
    assert np.abs(rows[:, 7:]).max() <= ROBOT.max_wheel_speed
    assert np.abs(rows[:, :3]).max() < 20.0


def test_a_repeat_is_equal_to_the_bit(make_ground):
    """A drive is a function of start and commands, whatever was driven before."""
    bumps = np.random.default_rng(3).normal(size=(101, 101)) * 0.02
    world = make_ground(lambda x, y: bumps, size=10.0)
    fresh, used = WheelsVehicle(world, ROBOT), WheelsVehicle(world, ROBOT)
    used.drive(WheelSpeeds(5.0, 2.0), 100)
    drives = []
    for vehicle in (fresh, used):
        vehicle.place(Start(1.0, 0.5, 0.7))
        commands = WheelSpeeds(3.0, 4.0), WheelSpeeds(-2.0, 3.0)
        drives.append([vehicle.drive(wheels, 50) for wheels in commands])
    np.testing.assert_array_equal(*drives)


def test_left_and_right_are_mirror_images(make_ground):
    """Swapped commands on mirrored ground drive the mirrored path."""
    slope = 0.15
    paths = []
    for side in (1, -1):
        vehicle = WheelsVehicle(make_ground(lambda x, y, s=side: s * slope * y), ROBOT)
        vehicle.place(Start(0.0, 0.0, 0.2 * side))
        wheels = WheelSpeeds(2.0, 4.0) if side > 0 else WheelSpeeds(4.0, 2.0)
        rows = vehicle.drive(wheels, 300)
        paths.append(rows * [1, side, 1, side, 1, side, 1, 1, 1])
    np.testing.assert_allclose(paths[0][:, :7], paths[1][:, :7], atol=1e-5)
