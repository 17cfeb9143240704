"""Skid-steered base: overshoot, brakes, deadband, steps, late commands, turns at speed."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.motion import SET_V, SET_W
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.skid_steer import SkidSteerConfig, swing_of, swung
from andabata.machine.planar.vehicle import PLANAR_VEHICLES, PlanarVehicle, PlanarVehicleConfig

NOTHING = Obstacles(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))
NEUTRAL = SkidSteerConfig(delay_jitter=0, braking=1, deadband=0, resolution=0, understeer=0)
EXACT = PlanarVehicleConfig(delay=0.0, gain_spread=0, slip=0, odometry_scale=0, odometry_turn=0)


def base(seed=0, vehicle=EXACT, **skid):
    """Return a base at rest that shows nothing but a swing and what is given."""
    config = vehicle.model_copy(update={"skid_steer": NEUTRAL.model_copy(update=skid)})
    return PlanarVehicle(config, PlanarPose(0, 0, 0), NOTHING, np.random.default_rng(seed))


def driven(robot, commands):
    """Return the parts of the state after each command."""
    states = []
    for v, w in commands:
        robot.step(Twist(v, w))
        states.append(robot.state.copy())
    return np.array(states)


@pytest.mark.parametrize(("damping", "over"), [(0.3, 0.3723), (0.5, 0.1630), (0.8, 0.0152)])
def test_a_step_is_overshot_as_the_damping_says(damping, over):
    """By exp(-pi z / sqrt(1 - z2)); its mean delay is the lag, and it settles at the step."""
    swing, dt = swing_of(damping, 0.15, 0.001), 0.001
    speed, rate, speeds = 0.0, 0.0, []
    for _ in range(5000):
        speed, rate = swung(speed, rate, 1.0, swing)
        speeds.append(speed)
    assert max(speeds) - 1.0 == pytest.approx(over, abs=2e-4)
    assert np.sum(1.0 - np.array(speeds)) * dt == pytest.approx(0.15, abs=dt)
    assert speeds[-1] == pytest.approx(1.0, abs=5e-3)


def test_long_steps_swing_as_short_ones():
    """The step is in closed form: its length changes nothing."""
    short, long = swing_of(0.5, 0.15, 0.001), swing_of(0.5, 0.15, 0.1)
    speed, rate = 0.3, -1.0
    for _ in range(100):
        speed, rate = swung(speed, rate, 1.0, short)
    assert (speed, rate) == pytest.approx(swung(0.3, -1.0, 1.0, long))


def test_what_is_neutral_asks_as_a_plain_robot_does():
    """The speeds that the controller asks for are the same; those of the body swing."""
    commands = np.random.default_rng(0).uniform(-2, 2, (60, 2)).tolist()
    plain = PlanarVehicle(EXACT, PlanarPose(0, 0, 0), NOTHING, np.random.default_rng(0))
    asked = [SET_V, SET_W]
    np.testing.assert_allclose(
        driven(base(), commands)[:, asked], driven(plain, commands)[:, asked]
    )
    over = driven(base(), [(1.0, 0.0)] * 40)[:, 3]
    assert 1.03 < over.max() < 1.163
    assert over[-1] == pytest.approx(1.0, abs=1e-3)


def test_brakes_are_weaker_than_the_drive():
    """Towards zero at half of 3 m/s2 and 8 rad/s2, forwards and backwards; away from it at all."""
    for sign in (1.0, -1.0):
        robot = base(braking=0.5)
        up = driven(robot, [(sign * 0.3, sign * 0.8)] * 2)
        np.testing.assert_allclose(up[:, SET_V], [sign * 0.15, sign * 0.3])
        np.testing.assert_allclose(up[:, SET_W], [sign * 0.4, sign * 0.8])
        down = driven(robot, [(0.0, 0.0)] * 4)
        np.testing.assert_allclose(down[:, SET_V], sign * np.array([0.225, 0.15, 0.075, 0.0]))
        np.testing.assert_allclose(down[:, SET_W], sign * np.array([0.6, 0.4, 0.2, 0.0]), atol=1e-9)


def test_wheels_have_a_deadband_and_whole_steps():
    """Each side by itself: slow ones stand, the others go to the nearest step."""
    skid = NEUTRAL.model_copy(update={"deadband": 0.05, "resolution": 0.02})
    assert skid.followed(Twist(0.05, 0.0), 0.28) == Twist(0.0, 0.0)
    assert skid.followed(Twist(0.0, 0.17), 0.28) == Twist(0.0, 0.0)
    assert skid.followed(Twist(0.507, 0.0), 0.28).linear == pytest.approx(0.50)
    # The left side has 0.02 m/s and stands, the right one 0.30 m/s.
    turning = skid.followed(Twist(0.16, 0.5), 0.28)
    assert (turning.linear, turning.angular) == pytest.approx((0.15, 0.30 / 0.56))
    exact = NEUTRAL.followed(Twist(0.507, 0.3), 0.28)
    assert (exact.linear, exact.angular) == pytest.approx((0.507, 0.3))


def test_delays_jitter_and_late_commands_count_no_more():
    """Effects come 0.05 to 0.15 s late, by draws; what is in effect never goes back."""
    quick = EXACT.model_copy(update={"delay": 0.05, "substeps": 10, "acceleration": 100})
    first = []
    for seed in range(200):
        robot = base(seed, quick, delay_jitter=0.10)
        # One command after another, each larger: the speed that is asked for tells which acts.
        asked = driven(robot, [(0.1 * k, 0.0) for k in range(1, 15)])[:, SET_V]
        assert (np.diff(asked) >= 0).all()
        late = np.arange(1, 15) - np.round(asked * 10)
        assert late.min() >= 1
        assert late.max() <= 3
        first.append(np.argmax(asked > 0))
    assert np.mean(np.equal(first, 1)) == pytest.approx(0.5, abs=0.15)
    steady = driven(base(0, quick), [(0.1 * k, 0.0) for k in range(1, 15)])[:, SET_V]
    np.testing.assert_allclose(steady, 0.1 * np.arange(14), atol=1e-12)


def test_the_turn_rate_falls_with_speed():
    """At 1.5 m/s 1 / (1 + 0.1 1.5^2) of it is left, which the odometry sees; at rest all."""
    for speed in (0.0, 1.5):
        robot = base(understeer=0.1)
        driven(robot, [(speed, 0.5)] * 80)
        assert robot.velocity.angular == pytest.approx(0.5 / (1 + 0.1 * speed**2), abs=1e-4)
        assert robot.odometry.yaw == pytest.approx(robot.pose.yaw)


def test_the_same_seed_drives_the_same():
    """Every draw comes from the generator."""
    commands = np.random.default_rng(1).uniform(-1, 1, (40, 2)).tolist()
    ways = [
        driven(
            PlanarVehicle(
                PLANAR_VEHICLES["barn-skid"],
                PlanarPose(0, 0, 0),
                NOTHING,
                np.random.default_rng(seed),
            ),
            commands,
        )
        for seed in (3, 3, 4)
    ]
    assert (ways[0] == ways[1]).all()
    assert (ways[0] != ways[2]).any()


def test_a_swing_needs_a_lag():
    """A base without one, or with ranges that may give none, is refused."""
    with pytest.raises(ValueError, match="lag: expected above 0 with skid_steer"):
        PlanarVehicleConfig(lag=0.0, skid_steer=SkidSteerConfig())
    given = PLANAR_VEHICLES["barn-drawn"].model_dump() | {"skid_steer": SkidSteerConfig()}
    PlanarVehicleConfig.model_validate(given)
    given["ranges"]["lag"] = (0.0, 0.3)
    with pytest.raises(ValueError, match="lag: expected above 0"):
        PlanarVehicleConfig.model_validate(given)
