"""The journey from world to wheels: sensors, clouds, cells, scan, steering, physics, evaluation."""

import hashlib

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.evaluation.trial import run_trial
from andabata.models import Models, shipped_forest, shipped_policy
from andabata.navigation.map_observation import sees_map
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import frustum
from traversability.dataset import cell_samples
from traversability.features import cell_features
from traversability.files import cloud_to_bytes
from traversability.forest_training import ForestConfig, train_forest
from traversability.grid import PolarGrid
from traversability.labels import CellState, label_cells
from traversability.scores import CellScores
from worlds.world import Start, Task

GRID = PolarGrid()


@pytest.fixture(scope="module")
def clouds(scenes):
    return [
        labelled_cloud(scenes.get("natural", seed), CloudsConfig(), np.random.default_rng(seed))
        for seed in range(6)
    ]


def test_a_world_becomes_labelled_clouds(clouds):
    """Clouds of a world lie in base_footprint, with as many points as its beams can give."""
    for cloud in clouds:
        assert cloud.frame == "base_footprint"
        # Two thirds of the beams of half a turn look up, and few of them hit a tree.
        assert 15_000 < len(cloud) < 133 * 1081 * 2 / 3
        assert 0 < cloud.nontraversable.mean() < 1
        trunks = cloud.classes == SemanticClass.TRUNK
        assert cloud.nontraversable[trunks].all()


def test_the_same_seed_gives_the_same_cloud(scenes, clouds):
    """Equal seeds give equal bytes."""
    again = labelled_cloud(scenes.get("natural", 2), CloudsConfig(), np.random.default_rng(2))
    digest = [hashlib.sha256(cloud_to_bytes(cloud)).hexdigest() for cloud in (again, clouds[2])]
    assert digest[0] == digest[1]


def test_clouds_become_a_forest_that_classifies_an_unseen_world(clouds):
    """A forest of five worlds' clouds has a balanced accuracy above 0.7 in a sixth."""
    samples = cell_samples(clouds[:5], GRID)
    forest = train_forest(samples, GRID, ForestConfig(trees=40), 0)
    cloud = clouds[5]
    truth = label_cells(cloud.points, cloud.nontraversable, GRID)
    called = forest.classify(cell_features(cloud.points, GRID), GRID)
    assert CellScores.of(truth, called).balanced_accuracy > 0.7


def test_the_robot_drives_round_trunks_and_arrives(make_scene):
    """From sweeps to wheels in bullet, with and without the planner; blindly it collides."""
    trunks = [frustum(SemanticClass.TRUNK, (0.0, y, 0.0), (0.2, 0.2), 3.0) for y in (-0.4, 0.4)]
    scene = make_scene(objects=trunks, size=40.0)
    config = SimulatedRobotConfig()
    task = Task(Start(-6.0, 0.0, 0.0), ((6.0, 0.0),))
    outcomes = {}
    for name in ("policy+planner", "reactive", "imitation", "straight"):
        simulated_robot = SimulatedRobot(
            scene, config, Models(), make_steering(name, scene.world, config)
        )
        (attempt,) = run_trial(
            simulated_robot, task, TerminationConfig(time_limit=90.0), np.random.default_rng(3)
        )
        outcomes[name] = attempt
        simulated_robot.close()
    assert outcomes["straight"].outcome is Outcome.COLLISION
    assert outcomes["imitation"].outcome is Outcome.GOAL
    for name in ("policy+planner", "reactive"):
        assert outcomes[name].outcome is Outcome.GOAL
        assert 12.0 - 1.0 - 0.5 < outcomes[name].distance < 20.0


def test_the_shipped_policy_steers_round_a_block_of_cells():
    """Blocked on the left it steers to the right, and the other way round."""
    policy = shipped_policy()
    ahead_left = np.full(35, 10.0, dtype=np.float32)
    ahead_left[32:] = 0.0
    ahead_left[16:24] = 1.5
    ahead_right = ahead_left.copy()
    ahead_right[:32] = ahead_left[:32][::-1]
    assert policy.act(ahead_left) < 0 < policy.act(ahead_right)


def test_the_shipped_models_are_small_and_fit_together():
    """Files below 5 MB, one grid, policies of the algorithms that they are named after."""
    assert len(shipped_forest().to_bytes()) < 5e6
    assert shipped_forest().grid == GRID
    for name, algorithm in (("policy", "sac"), ("actor-critic", "actor-critic")):
        policy = shipped_policy(name)
        assert len(policy.to_bytes()) < 5e6
        assert policy.observations.term("ranges").shape == (GRID.n_sectors,)
        assert policy.info["config"]["learner"]["algorithm"] == algorithm
    imitation = shipped_policy("imitation")
    assert len(imitation.to_bytes()) < 5e6
    assert sees_map(imitation.observations)
    cells = np.full((32, 10), CellState.TRAVERSABLE)
    assert cells.shape == (GRID.n_sectors, GRID.n_rings)
