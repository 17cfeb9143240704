"""A navigator's parts: those that its settings name, made once, or a clear refusal."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.navigator import (
    NavigatorConfig,
    make_localizer,
    make_navigator,
    make_perception,
)
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.localization.noisy_ground_truth import NoisyGroundTruthLocalizer
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.kinematics import Twist
from andabata.machine.sensor_readings import SensorReadings
from andabata.machine.simulator import SensingConfig
from andabata.models import Models
from andabata.navigation.arrival import ArrivalConfig
from andabata.navigation.controller import Steering
from andabata.navigation.mover_perception import MoverPerceptionConfig
from andabata.navigation.perception import CloudPerception, HorizontalPerception
from tests.support.situations import StubController, pose_at

CONFIG = SimulatedRobotConfig()
FLAT = SimulatedRobotConfig(
    sensing=SensingConfig(scanner="horizontal", proprioception=None), localizer="truth"
)


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_the_localizer_is_the_filter_or_the_true_pose(rng):
    """``ukf`` gives the robot's filter, ``truth`` the true pose with errors."""
    assert isinstance(make_localizer(CONFIG, rng), UkfLocalizer)
    assert isinstance(make_localizer(FLAT, rng), NoisyGroundTruthLocalizer)


def test_the_filter_needs_its_sensors(rng):
    """A filter without proprioception is refused, and the way without it is named."""
    config = CONFIG.model_copy(update={"sensing": SensingConfig(proprioception=None)})
    with pytest.raises(
        ValueError, match=r"proprioception: expected the sensors.*localizer = truth"
    ):
        make_localizer(config, rng)


def test_the_perception_fits_the_scanner():
    """A horizontal scanner needs no classifiers, the rotating laser does."""
    assert isinstance(make_perception(FLAT, None, with_layers=True), HorizontalPerception)
    assert isinstance(make_perception(CONFIG, Models(), with_layers=False), CloudPerception)
    with pytest.raises(ValueError, match="models: expected classifiers"):
        make_perception(CONFIG, None, with_layers=False)


def test_layers_use_the_given_ground_classifier_and_the_perceptions_assembler():
    """The ground layer classifies with the models that it is given, on the planner's cells."""
    other = replace(Models().ground_classifier, summary={"name": "another"})
    models = replace(Models(), ground_classifier=other)
    perception = make_perception(CONFIG, models, with_layers=True)
    assert perception.layers.ground._classifier is other
    assert perception.layers._assembler is perception.assembler
    occupancy = CONFIG.local_planner.occupancy
    assert perception.layers.ground.log_odds.shape == (occupancy.cells, occupancy.cells)
    assert perception.layers.ground.cell == pytest.approx(occupancy.cell)


def test_movers_are_followed_where_settings_ask_for_it():
    """Perception and layers have the same ones; by default there are none."""
    settings = CONFIG.model_copy(update={"movers": MoverPerceptionConfig()})
    perception = make_perception(settings, Models(), with_layers=True)
    assert perception.movers is not None
    assert perception.layers.movers is perception.movers
    plain = make_perception(CONFIG, Models(), with_layers=True)
    assert plain.movers is None
    assert plain.layers.movers is None


@pytest.mark.parametrize(("name", "has_layers"), [("policy+planner", True), ("policy", False)])
def test_only_a_planner_gets_layers(rng, name, has_layers):
    """Without a planner no ground cells are classified."""
    parts = make_navigator(CONFIG, Models(), make_steering(name, None, CONFIG), rng)
    assert (parts.perception.layers is not None) == has_layers


def test_the_navigator_is_made_of_the_parts_that_are_returned(rng):
    """Readings that the navigator takes in reach the returned localizer and perception."""
    controller = StubController(Twist(0.3, 0.0))
    parts = make_navigator(FLAT, None, Steering(controller), rng)
    parts.navigator.reset(pose_at(), 0.0)
    row = np.array([[0.1, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    ranges = np.full(32, 3.0, dtype=np.float32)
    readings = SensorReadings(0.1, horizontal=ranges, true_track=row)
    result = parts.navigator.step(readings)
    assert controller.situations[0].pose is parts.localizer.pose
    assert parts.localizer.pose.position[0] == pytest.approx(2.0, abs=1.5)
    np.testing.assert_array_equal(parts.perception.scan(0.1, parts.localizer).ranges, ranges)
    assert result.twist == Twist(0.3, 0.0)


def test_without_steering_a_learner_drives(rng):
    """A navigator without a controller observes and executes."""
    parts = make_navigator(FLAT, None, None, rng)
    with pytest.raises(ValueError, match="controller: expected one"):
        parts.navigator.step(SensorReadings(0.1, true_track=np.empty((0, 8))))


def test_geofence_and_rules_of_arrival_are_settings(rng):
    """A navigator has those of its settings; none and the defaults without any."""
    fence = (-1.0, -2.0, 3.0, 4.0)
    settings = {"geofence": fence, "arrival": ArrivalConfig(distance=7.0)}
    navigator = make_navigator(FLAT.model_copy(update=settings), None, None, rng).navigator
    assert navigator.geofence == fence
    assert make_navigator(FLAT, None, None, rng).navigator.geofence is None
    controller = StubController(Twist(0.3, 0.0))
    for config, has_arrived in ((FLAT, False), (FLAT.model_copy(update=settings), True)):
        parts = make_navigator(config, None, Steering(controller), rng)
        parts.navigator.reset(pose_at(), 0.0)
        parts.navigator.set_goal(np.array([5.0, 0.0]))
        row = np.array([[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
        ranges = np.full(32, 3.0, dtype=np.float32)
        readings = SensorReadings(0.1, horizontal=ranges, true_track=row)
        assert parts.navigator.step(readings).has_arrived is has_arrived


@pytest.mark.parametrize("fence", [(3.0, 0.0, 1.0, 4.0), (0.0, 4.0, 1.0, 4.0)])
def test_a_geofence_that_holds_no_place_is_refused(fence):
    """The error gives the order of the numbers, what came, and what to do."""
    with pytest.raises(ValueError, match="geofence: expected x_min, y_min, x_max, y_max"):
        NavigatorConfig(geofence=fence)
