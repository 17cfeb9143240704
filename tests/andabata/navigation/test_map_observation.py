"""Observations and actions of policies that see the map: terms, mirror images, what is missing."""

import math

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.models import shipped_policy
from andabata.navigation.map_observation import (
    action_shares,
    action_table,
    check_map_policy,
    goal_in_robot,
    map_actions,
    map_observations,
    mirrored_actions,
    mirrored_observations,
    place_of,
    sees_map,
)
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.policy_controller import observation_of
from rl.crop_actor import CropActor
from rl.spaces import ObservationSpec, steering_observations
from tests.support.situations import GRID, ROBOT, between, pose_at, scan_of, situation

SPEC = map_observations(ROBOT, has_subgoal=True)
TABLE = action_table(ROBOT)


def seen_by(ranges, **changes):
    """Return the observation of a robot that has seen some ranges from where it stands."""
    planner = LocalPlanner(GRID, robot=ROBOT)
    given = situation(scan_of(ranges), **changes)
    for _ in range(60):
        guided = planner.guide(given, None)
    return observation_of(SPEC, guided)


def part(observation, name):
    """Return a term of an observation in its shape."""
    return observation[SPEC.slice_of(name)].reshape(SPEC.term(name).shape)


@pytest.mark.parametrize("name", ["goal", "subgoal"])
def test_places_can_be_read_from_their_terms(name):
    """Ahead and to the left, in metres."""
    seen = seen_by(between(-40, 40, 4.0))
    ahead, left = place_of(part(seen, name))
    cosine, sine, nearness = part(seen, name).tolist()
    assert math.hypot(ahead, left) == pytest.approx(4.0 / nearness - 4.0, rel=1e-4)
    assert math.atan2(left, ahead) == pytest.approx(math.atan2(sine, cosine), abs=1e-5)
    if name == "goal":
        expected = goal_in_robot(situation(scan_of(between(-40, 40, 4.0))))
        np.testing.assert_allclose([ahead, left], expected, atol=1e-3)


def test_the_map_shows_a_wall_ahead():
    """Blocked cells lie ahead in both crops, free ones before the wall."""
    seen = seen_by(between(-40, 40, 4.0))
    near, far = part(seen, "map_near"), part(seen, "map_far")
    assert near[0, 30:].max() > 0.5
    assert near[0, :20].max() < 0.5
    assert far[0, 15:20].max() > 0.5
    assert near[1, 20:28, 20:28].min() > 0


def test_goal_and_tilt():
    """Bearing and nearness of the goal itself; pitch and roll as the pose has them."""
    pose = Pose.from_euler(np.array([3.0, -2.0, 0.0]), 0.1, -0.2, 0.7)
    seen = seen_by(np.inf, pose=pose, odometry=pose, heading_error=0.5, goal_distance=4.0)
    np.testing.assert_allclose(part(seen, "goal"), [math.cos(0.5), math.sin(0.5), 0.5], atol=1e-6)
    np.testing.assert_allclose(part(seen, "tilt"), [-0.2, 0.1], atol=1e-6)


def test_the_subgoal_leads_round_a_wall():
    """Where the goal lies behind a wall the sub-goal is another place."""
    seen = seen_by(between(-60, 60, 3.0), goal_distance=9.0)
    assert part(seen, "goal")[0] == pytest.approx(1.0)
    assert part(seen, "subgoal")[0] < 0.95


def test_motion_is_seen():
    """Last speed and yaw rates, in SI units, and for how long the robot has come no nearer."""
    motion = {"previous_speed": 0.45, "previous_steering": (0.3, -0.2)}
    seen = seen_by(np.inf, stalled_time=20.0, **motion)
    assert part(seen, "stalled_time")[0] == 20.0
    assert part(seen_by(np.inf, stalled_time=900.0), "stalled_time")[0] == 60.0
    assert part(seen, "previous_speed")[0] == pytest.approx(0.45)
    np.testing.assert_allclose(part(seen, "previous_actions"), [0.3, -0.2], atol=1e-6)


def test_the_mirror_image_is_that_of_a_mirrored_place():
    """What is seen of a mirrored wall is the mirrored observation."""
    left = seen_by(between(5, 40, 3.0), heading_error=0.4, previous_steering=(0.2, 0.1))
    right = seen_by(between(-40, -5, 3.0), heading_error=-0.4, previous_steering=(-0.2, -0.1))
    image = mirrored_observations(left[None], SPEC)[0]
    assert np.abs(image - right).mean() < 0.01
    np.testing.assert_array_equal(mirrored_observations(image[None], SPEC)[0], left)


def test_actions_are_within_their_bounds_and_have_images():
    """19 of them, each with its own mirror image; none lies in the dead zone."""
    actions, images = map_actions(ROBOT), mirrored_actions(TABLE)
    assert len(TABLE) == 19
    assert np.all(actions.low <= TABLE)
    assert np.all(actions.high >= TABLE)
    np.testing.assert_allclose(actions.scaled(action_shares(ROBOT)), TABLE, atol=1e-6)
    np.testing.assert_array_equal(images[images], np.arange(19))
    rates = np.abs(TABLE[:, 1])
    assert np.all((rates == 0) | (rates >= ROBOT.dead_zone))
    with pytest.raises(ValueError, match="mirror image"):
        mirrored_actions(TABLE[1:])


def test_a_map_is_asked_for():
    """Without a planner a policy that sees the map says what is missing."""
    with pytest.raises(ValueError, match="expected a planner that keeps a map"):
        observation_of(SPEC, situation())
    assert sees_map(SPEC)
    assert not sees_map(steering_observations(32, 10.0, 0.5))


def test_a_goal_underfoot_is_ahead():
    """Distance zero has a bearing all the same."""
    given = situation(goal_distance=0.0, pose=pose_at(1.0, 2.0, 0.3))
    np.testing.assert_allclose(goal_in_robot(given), [0.0, 0.0], atol=1e-9)


def policy_of(observations=SPEC, actions=None):
    """Return an untrained policy of a layout."""
    return CropActor(observations, actions or map_actions(ROBOT), action_shares(ROBOT)).policy({})


def test_a_policy_of_this_robot_is_accepted():
    """With the planner's sub-goal among its numbers, and without it."""
    check_map_policy(policy_of(), ROBOT)
    check_map_policy(policy_of(map_observations(ROBOT, has_subgoal=False)), ROBOT)


def test_a_policy_that_learnt_in_another_body_is_refused():
    """The shipped one is of the paper's robot; a policy that does not say is taken."""
    check_map_policy(shipped_policy("imitation"), RobotModel())
    long = RobotModel().model_copy(update={"length": 0.99})
    with pytest.raises(ValueError, match=r"expected body, length and width"):
        check_map_policy(shipped_policy("imitation"), long)
    check_map_policy(policy_of(), ROBOT.model_copy(update={"length": 0.99}))


def test_a_policy_of_another_robot_is_refused_by_what_differs():
    """Its limits, an unknown number, a missing one."""
    fast = ROBOT.model_copy(update={"speed": 0.5})
    with pytest.raises(ValueError, match="expected previous_speed as this robot has them"):
        check_map_policy(policy_of(), fast)
    slow = map_actions(ROBOT).model_copy(update={"high": (0.3, 0.5)})
    with pytest.raises(ValueError, match="expected actions as this robot has them"):
        check_map_policy(policy_of(actions=slow), ROBOT)
    unknown = SPEC.terms[-1].model_copy(update={"name": "altitude"})
    with pytest.raises(ValueError, match="altitude"):
        check_map_policy(policy_of(ObservationSpec(terms=(*SPEC.terms, unknown))), ROBOT)
    fewer = ObservationSpec(terms=SPEC.terms[:-1])
    with pytest.raises(ValueError, match="none of stalled_time"):
        check_map_policy(policy_of(fewer), ROBOT)
