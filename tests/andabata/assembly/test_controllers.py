"""Controllers by name: what steers, with or without a planner, and how often it decides."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly import controllers
from andabata.assembly.controllers import (
    CONTROLLERS,
    MAPLESS_CONTROLLERS,
    default_controller,
    driven_robot,
    make_steering,
    refuse_unused_policy,
)
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.models import Models, shipped_policy
from andabata.navigation.controller import NoPlanner
from andabata.navigation.map_observation import map_actions, map_observations
from andabata.navigation.null_controllers import AwayController, RandomController
from andabata.navigation.oracle import OracleController
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from andabata.navigation.policy_controller import PolicyController
from andabata.navigation.reactive import ReactiveController, StraightController
from rl.crop_actor import CropActor
from rl.driving import DRIVING_REPEAT
from rl.policy import with_info
from tests.support.situations import between, scan_of, situation
from worlds.world import MapDatum

CONFIG = SimulatedRobotConfig(robot=RobotModel(speed=0.4))
KINDS = {
    "policy+planner": (PolicyController, True, 5),
    "policy": (PolicyController, False, 1),
    "imitation+planner": (PolicyController, True, 5),
    "imitation": (PolicyController, True, 5),
    "actor-critic": (PolicyController, False, 1),
    "planner": (StraightController, True, 5),
    "reactive": (ReactiveController, False, 1),
    "reactive+planner": (ReactiveController, True, 5),
    "straight": (StraightController, False, 1),
    "random+planner": (RandomController, True, 5),
    "away+planner": (AwayController, True, 5),
    "oracle": (OracleController, False, 5),
}
"""Controller, presence of a planner and action repeat of each name."""


@pytest.mark.parametrize("name", KINDS)
def test_each_name_stands_for_one_steering(make_ground, name):
    """A name with a planner has the local planner and its action repeat around the controller."""
    kind, has_planner, repeat = KINDS[name]
    steering = make_steering(name, make_ground(), SimulatedRobotConfig())
    assert type(steering.controller) is kind
    assert type(steering.planner) is (LocalPlanner if has_planner else NoPlanner)
    assert steering.action_repeat == repeat


def test_all_names_are_listed():
    """The oracle alone needs the true map."""
    assert set(CONTROLLERS) == set(KINDS)
    assert set(CONTROLLERS) - set(MAPLESS_CONTROLLERS) == {"oracle"}
    assert len(CONTROLLERS) == len(KINDS)


_AT_THE_ROBOTS_SPEED = [
    name for name in MAPLESS_CONTROLLERS if "policy" not in name and "imitation" not in name
]


@pytest.mark.parametrize("name", _AT_THE_ROBOTS_SPEED)
def test_controllers_drive_at_the_robots_speed(name):
    """The configured speed reaches the command."""
    assert make_steering(name, None, CONFIG).controller.act(situation()).linear == 0.4


def test_unknown_names_are_refused():
    """Errors list the known names, and say why there is no oracle."""
    with pytest.raises(
        ValueError, match=r"--controller: expected policy\+planner, .* got 'pilot'$"
    ):
        make_steering("pilot", None, CONFIG)
    with pytest.raises(ValueError, match="got 'oracle'; the oracle needs the true map"):
        make_steering("oracle", None, CONFIG)


def test_a_policy_controller_drives_the_models_policy():
    """``policy`` takes the given one; others always the shipped one of their name."""
    other = with_info(shipped_policy(), {"name": "another"})
    models = replace(Models(), policy=other)
    for name in ("policy", "policy+planner"):
        assert make_steering(name, None, CONFIG, models).controller._policy is other
    for name in ("actor-critic", "imitation", "imitation+planner"):
        shipped = make_steering(name, None, SimulatedRobotConfig(), models).controller._policy
        assert shipped is shipped_policy(name.removesuffix("+planner"))


OWN = replace(Models(), policy=with_info(shipped_policy(), {"name": "another"}))


def test_the_planner_steers_where_nothing_is_named():
    """A policy of one's own drives inside it."""
    assert default_controller(Models()) == "planner"
    assert default_controller(OWN) == "policy+planner"


@pytest.mark.parametrize("names", [("planner", "reactive"), ("actor-critic",), ("imitation",)])
def test_a_policy_that_no_controller_drives_by_is_refused(names):
    """The shipped one is there unasked."""
    refuse_unused_policy(names, Models(), "--controllers")
    for others in (("policy",), ("planner", "policy+planner"), ("own.py:Own",)):
        refuse_unused_policy(others, OWN, "--controllers")
    with pytest.raises(ValueError, match=r"got .*; add `--controllers policy\+planner`, or leave"):
        refuse_unused_policy(names, OWN, "--controllers")


def test_a_policy_alone_holds_its_actions_as_long_as_it_says():
    """As it was trained; with a planner the rollouts decide how long."""
    models = replace(Models(), policy=with_info(shipped_policy(), {DRIVING_REPEAT: 4}))
    repeats = [
        make_steering(name, None, CONFIG, models).action_repeat
        for name in ("policy", "policy+planner", "actor-critic")
    ]
    assert repeats == [4, 5, 1]


def test_the_planner_counts_decisions_and_not_control_steps():
    """Intervals of the configuration are divided by the action repeat."""
    config = CONFIG.model_copy(
        update={
            "rollouts": TrajectoryRolloutsConfig(action_repeat=4),
            "local_planner": LocalPlannerConfig(
                replan_every=9, occupancy=OccupancyGridConfig(update_every=8, driven_memory=100)
            ),
        }
    )
    steering = make_steering("planner", None, config)
    assert steering.action_repeat == 4
    planner = steering.planner.config
    assert planner.replan_every == 2
    assert planner.occupancy.update_every == 2
    assert planner.occupancy.driven_memory == 25


def test_a_policy_that_sees_the_map_alone_has_a_planner_that_checks_nothing():
    """It keeps the map; beside the word planner it checks commands, and keeps their speed."""
    spec, robot = map_observations(CONFIG.robot, has_subgoal=True), CONFIG.robot
    shares = np.zeros((19, 2), dtype=np.float32)
    models = Models(policy=CropActor(spec, map_actions(robot), shares).policy({}))
    seeing = make_steering("policy", None, CONFIG, models)
    checked = make_steering("policy+planner", None, CONFIG, models)
    blind = make_steering("policy", None, CONFIG)
    command = Twist(0.6, 0.5)
    wall = situation(scan_of(between(-180, 180, 0.7)))
    for steering in (seeing, checked):
        guided = [steering.planner.guide(wall, None) for _ in range(40)][-1]
        assert guided.around is not None
    assert seeing.planner.select(guided, command) is command
    assert checked.planner.select(guided, command) != command
    checked.planner.reset()
    open_ground = [checked.planner.guide(situation(), None) for _ in range(40)][-1]
    # A command with a speed of its own is not made faster where it is clear.
    slow = Twist(0.2, 0.1)
    assert checked.planner.select(open_ground, slow) == slow
    assert seeing.action_repeat == checked.action_repeat == 5
    assert isinstance(blind.planner, NoPlanner)


def test_noise_comes_from_the_given_source():
    """The same seed gives the same noise; without one it is the same each time."""
    rates = [
        make_steering("random+planner", None, CONFIG, rng=rng).controller.act(situation()).angular
        for rng in (np.random.default_rng(3), np.random.default_rng(3), None, None)
    ]
    assert rates[0] == rates[1] != rates[2] == rates[3]


def test_the_oracle_alone_drives_a_robot_that_knows_its_pose():
    """Without any error; a filter that is lost would stop the upper bound."""
    for name in MAPLESS_CONTROLLERS:
        assert driven_robot(name, CONFIG) is CONFIG
    robot = driven_robot("oracle", CONFIG)
    assert robot.localizer == "truth"
    sigmas = robot.errors.position_sigma, robot.errors.yaw_sigma, robot.errors.tilt_sigma
    assert sigmas == (0.0, 0.0, 0.0)
    assert (robot.robot, robot.rollouts) == (CONFIG.robot, CONFIG.rollouts)


def test_a_prior_map_is_read_around_the_world_that_is_driven(make_scene, monkeypatch):
    """A planner looks for its elevation model where the world lies on Earth."""
    datum = MapDatum(latitude_deg=46.0, longitude_deg=7.7, altitude=1200.0)
    world, asked = replace(make_scene().world, datum=datum), []
    monkeypatch.setattr(controllers, "make_prior_map", lambda config, _: asked.append(config))
    make_steering("planner", world, CONFIG)
    make_steering("planner", None, CONFIG)
    places = [each.sensing.geo_reference.latitude_deg for each in asked]
    assert places == [46.0, CONFIG.sensing.geo_reference.latitude_deg]
