"""Labels of whole drives: the teacher's prices of the true state, beside what the robot knew."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.sensor_readings import VehicleState
from andabata.navigation.map_observation import action_table
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.training.action_prices import ActionPrices
from andabata.training.map_labels import LabelledController, MapLabelsConfig, drive_and_label
from tests.support.situations import GRID, ROBOT, pose_at, situation
from tests.support.true_maps import map_of_blocks

CONFIG = MapLabelsConfig(
    presets=("natural-test",), goals=1, terminations=TerminationConfig(time_limit=6.0)
)
TABLE = action_table(ROBOT)


def controller(student=None, share=1.0, **changes):
    """Return a controller that labels, in a world with one wall."""
    config = CONFIG.model_copy(update={"random_share": 0.0} | changes)
    teacher = ActionPrices(map_of_blocks([(12.0, 13.0, 5.0, 15.0)]), ROBOT, TABLE)
    made = LabelledController(config, teacher, student, share, np.random.default_rng(0))
    made.reset()
    return made


def seen_at(pose, believed=None, goal=(9.0, 10.0)):
    """Return a situation whose true pose may differ from the believed one."""
    state = VehicleState(
        0.0, pose, np.zeros(3), np.zeros(3), np.zeros(2), collided=False, tipped=False
    )
    believed = believed or pose
    given = situation(pose=believed, odometry=believed, goal_distance=5.0, truth=state)
    return LocalPlanner(GRID, robot=ROBOT).guide(given._replace(goal=np.array(goal)), None)


def labels_of(goal, believed=None):
    """Return the labels of one true pose, believed as it is and elsewhere."""
    made = controller()
    pose = pose_at(4.0, 10.0)
    made.act(seen_at(pose, goal=goal))
    made.act(seen_at(pose, believed or pose_at(4.5, 10.4, 0.1), goal))
    return made.labels()


class Ahead:
    """Student that always drives ahead."""

    def reset(self):
        """Nothing is remembered."""

    def act(self, situation):
        """Return a speed."""
        return Twist(0.3, 0.0)


def test_the_teacher_drives_its_cheapest_action():
    """And the label says why."""
    made = controller()
    command = made.act(seen_at(pose_at(4.0, 10.0)))
    labels = made.labels()
    assert [command.linear, command.angular] == TABLE[np.argmin(labels.prices[0])].tolist()
    assert labels.prices.shape == (1, 19)


def test_prices_are_of_the_true_pose():
    """A believed pose that is off changes what is seen, and no price far from the goal."""
    labels = labels_of(goal=(15.0, 10.0))
    np.testing.assert_array_equal(labels.prices[0], labels.prices[1])
    assert not np.array_equal(labels.observations[0], labels.observations[1])


def test_near_the_goal_the_believed_one_is_headed_for():
    """The robot believes itself further ahead, so that it stops short of the true goal."""
    labels = labels_of(goal=(9.0, 10.0), believed=pose_at(7.0, 10.0))
    ahead = np.flatnonzero((TABLE[:, 0] > 0.5) & (TABLE[:, 1] == 0))[0]
    assert labels.prices[0, ahead] - labels.prices[1, ahead] == pytest.approx(3.0 / 0.6, abs=0.5)


def test_a_believed_goal_in_an_obstacle_is_not_headed_for():
    """The goal itself is, then: no way leads into an obstacle."""
    labels = labels_of(goal=(9.0, 10.0), believed=pose_at(0.5, 10.0))
    np.testing.assert_array_equal(labels.prices[0], labels.prices[1])


def test_a_student_drives_and_the_teacher_labels():
    """The command is the student's; so many are labelled as are made."""
    made = controller(Ahead(), share=0.0)
    commands = [made.act(seen_at(pose_at(4.0, 10.0, 3.0))) for _ in range(3)]
    assert commands == [Twist(0.3, 0.0)] * 3
    assert TABLE[np.argmin(made.labels().prices[0]), 1] != 0.0
    assert len(made.labels().prices) == 3


def test_random_actions_are_as_frequent_as_asked_for():
    """All of them: none of the student's."""
    made = controller(Ahead(), share=0.0, random_share=1.0)
    commands = {made.act(seen_at(pose_at(4.0, 10.0))).angular for _ in range(30)}
    assert len(commands) > 3


def test_a_whole_drive_is_labelled_and_the_same_again():
    """Two decisions a second from the first scan on; the same number, the same labels."""
    first, again = (drive_and_label(CONFIG, 5, None, 1.0, 2) for _ in range(2))
    assert first.outcomes == ("timeout",)
    assert 5 <= len(first.labels.prices) <= 12
    np.testing.assert_array_equal(first.labels.observations, again.labels.observations)
    np.testing.assert_array_equal(first.labels.prices, again.labels.prices)


def test_truth_is_asked_for():
    """There is no teacher in a recording."""
    with pytest.raises(ValueError, match="expected the true state"):
        controller().act(situation())
