"""What is left out for speed is nothing that the robot sees: the same to the bit."""

import numpy as np
import pytest

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.models import shipped_forest
from andabata.navigation.reactive import ReactiveController
from worlds.ray_walk import NO_CLASS


@pytest.mark.parametrize("name", ["natural-test", "park", "maze"])
def test_a_short_sighted_robot_drives_the_same(scenes, name):
    scene, config = scenes.get(name, 7), SimulatedRobotConfig(plant="kinematic")
    clouds, steps = [], []
    for far_sighted in (False, True):
        driver = ReactiveController(config.robot, config.grid)
        simulated_robot = SimulatedRobot(
            scene, config, shipped_forest(), driver, far_sighted=far_sighted
        )
        task, found = scene.world.tasks[0], []
        readings = simulated_robot.place(
            task.start, np.array(task.goals[0]), np.random.default_rng(3)
        )
        simulated_robot.navigator.watch(found.append)
        for _ in range(120):
            readings = simulated_robot.simulator.step(simulated_robot.navigator.step(readings))
        clouds.append(simulated_robot.last_cloud())
        steps.append(found)
        simulated_robot.close()
    np.testing.assert_array_equal(clouds[0].points, clouds[1].points)
    np.testing.assert_array_equal(clouds[0].classes, clouds[1].classes)
    moved = 0
    for near, far in zip(*steps, strict=True):
        assert near.wheels == far.wheels
        assert (near.view is None) == (far.view is None)
        if near.view is not None:
            moved += 1
            np.testing.assert_array_equal(near.view.scan.ranges, far.view.scan.ranges)
    assert moved > 60


@pytest.mark.parametrize("name", ["learned", "reactive"])
def test_a_robot_looks_when_it_decides_and_drives_the_same_when_watched(scenes, name):
    scene, config = scenes.get("natural-test", 7), SimulatedRobotConfig(plant="kinematic")
    drives, looks = [], []
    for watched in (False, True):
        driver = make_controller(name, None, config)
        simulated_robot = SimulatedRobot(scene, config, shipped_forest(), driver)
        seen, see = [], simulated_robot.perception.look
        simulated_robot.perception.look = lambda *now, seen=seen, see=see: (
            seen.append(see(*now)) or seen[-1]
        )
        steps, wheels = [], []
        if watched:
            simulated_robot.navigator.watch(steps.append)
        task = scene.world.tasks[0]
        readings = simulated_robot.place(
            task.start, np.array(task.goals[0]), np.random.default_rng(3)
        )
        for _ in range(150):
            wheels.append(simulated_robot.navigator.step(readings))
            readings = simulated_robot.simulator.step(wheels[-1])
        simulated_robot.close()
        drives.append(wheels)
        looks.append(sum(scan is not None for scan in seen))
        assert [step.view is not None for step in steps] == [
            scan is not None for scan in seen
        ] * watched
    assert drives[0] == drives[1]
    assert looks[1] > 100
    assert looks[0] == -(-looks[1] // driver.hold)


def test_rays_that_end_early_meet_what_endless_ones_meet(scenes):
    scene, rng = scenes.get("natural-test", 7), np.random.default_rng(0)
    rays, ground = scene.rays, scene.world.ground
    for _ in range(20):
        x, y = rng.uniform(-45, 45, 2)
        z = ground.height_at(np.array([x]), np.array([y]))[0] + 0.7
        origins = np.tile(np.array([[x, y, z]], dtype=np.float32), (2000, 1))
        directions = rng.normal(size=(2000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        beams = np.concatenate([origins, directions], axis=1).astype(np.float32)
        budgets = rng.standard_exponential(2000, dtype=np.float32)
        near, kinds = rays.cast(beams, budgets, 9.0)
        whole, all_kinds = rays.cast(beams, budgets)
        inside = whole <= 9.0
        np.testing.assert_array_equal(near[inside], whole[inside])
        np.testing.assert_array_equal(kinds[inside], all_kinds[inside])
        assert np.isinf(near[~inside]).all()
        assert (kinds[~inside] == NO_CLASS).all()
