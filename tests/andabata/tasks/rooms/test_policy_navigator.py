"""A policy of rooms on another robot: similar readings give similar commands."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.dynamic_window import VEHICLE_MAP
from andabata.tasks.rooms.policy_navigator import (
    RoomPolicyNavigator,
    SimilarityConfig,
    scaled_lidar,
)
from andabata.tasks.rooms.td3_config import Td3TaskConfig
from rl.goal_laws import HeadingPolicy
from rl.policies.deterministic import DeterministicPolicy
from tests.support.room_policies import window_policy

LIDAR = PlanarLidarConfig(fov_deg=270, resolution_deg=1.0, max_range=4.0, x=0.1)
FAST = PlanarVehicleConfig(max_speed=10.0, max_wheel_speed=20.0)


def navigator(length=1.0, rate=1.0, has_map=False, law=False):
    task = Td3TaskConfig(lidar=scaled_lidar(scaled_lidar(LIDAR, 1 / length), length))
    policy = window_policy("td3")
    assert isinstance(policy, DeterministicPolicy)
    if law:
        policy = HeadingPolicy({}, task.observations, task.actions)
    made = RoomPolicyNavigator(
        FAST,
        policy,
        task,
        SimilarityConfig(length=length, rate=rate),
        VEHICLE_MAP if has_map else None,
        np.random.default_rng(0),
    )
    made.reset(scaled_lidar(LIDAR, 1 / length), (3.0 * length, 1.0 * length))
    return made


def readings(length=1.0, rate=1.0, ranges=None):
    rng = np.random.default_rng(1)
    ranges = rng.uniform(0.5, 4.0, LIDAR.count) if ranges is None else ranges
    return PlanarReadings(
        stamp=0.0,
        odometry=PlanarPose(0.2 * length, -0.1 * length, 0.3),
        velocity=Twist(0.4 * length * rate, -0.2 * rate),
        ranges=(ranges * length).astype(np.float32),
    )


@pytest.mark.parametrize(("length", "rate"), [(1.5, 1.0), (1.0, 2.0), (1.4, 1.4)])
def test_a_similar_robot_drives_a_similar_path(length, rate):
    """Lengths by one factor and times by another: the yaw rate has its own, the speed both."""
    own = navigator().act(readings())
    other = navigator(length, rate).act(readings(length, rate))
    assert own.linear > 0.01
    assert other.linear == pytest.approx(length * rate * own.linear, rel=1e-4)
    assert other.angular == pytest.approx(rate * own.angular, rel=1e-4)


def test_beams_without_a_return_and_without_a_measurement_count_as_the_largest_range():
    """Infinite and missing ranges give the command of the open."""
    far = np.full(LIDAR.count, LIDAR.max_range)
    open_ranges, silent = far.copy(), far.copy()
    silent[::2], silent[1::3] = np.inf, np.nan
    assert navigator().act(readings(ranges=silent)) == navigator().act(readings(ranges=open_ranges))


def test_a_decision_is_held_as_long_as_in_training():
    """The policy decides every 0.1 s; at twice the pace in each period of 0.05 s."""
    near, far = readings(ranges=np.full(LIDAR.count, 0.4)), readings()
    for rate, held in ((1.0, True), (2.0, False)):
        made = navigator(rate=rate)
        commands = [made.act(far), made.act(near)]
        assert (commands[0] == commands[1]) == held


def test_the_map_gives_sub_goals_beside_what_stands_in_the_way():
    """A wall across the straight way turns a law that sees no obstacle, only with the map."""
    bearings = LIDAR.bearings
    wall = np.where(np.abs(bearings) < 1.0, 1.2 / np.cos(np.clip(bearings, -1.1, 1.1)), np.inf)
    seen = readings(ranges=wall)
    straight, around = navigator(law=True), navigator(law=True, has_map=True)
    assert abs(straight.act(seen).angular) < 0.3
    assert abs(around.act(seen).angular) > 0.5


def test_commands_stay_within_the_limits_of_the_robot():
    """What the policy wants beyond them is cut."""
    made = navigator(length=8.0, rate=8.0)
    command = made.act(readings(8.0, 8.0))
    assert FAST.limited(command) == command


@pytest.mark.parametrize("name", ["tracked_movers", "earlier_scan"])
def test_a_policy_that_reads_what_this_robot_does_not_keep_is_refused(name):
    """The error names the setting to train without."""
    task = Td3TaskConfig(lidar=LIDAR, **{name: 3})
    policy, rng = window_policy(**{name: 3}), np.random.default_rng(0)
    with pytest.raises(ValueError, match=rf"without {name}.*{name}=0"):
        RoomPolicyNavigator(FAST, policy, task, SimilarityConfig(), None, rng)
