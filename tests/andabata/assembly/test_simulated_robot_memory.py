"""A control step works in memory that it has: what it allocates is small, and is not kept."""

import gc
import tracemalloc

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.models import Models
from andabata.navigation.controller import Steering
from andabata.navigation.reactive import ReactiveController

CLOUD = 40_000 * 12
"""Bytes of a cloud's points: the size of one copy of it, or of the beams of a step."""


@pytest.fixture
def drive(scenes):
    """Return a function that drives some steps, after the first clouds and all compilation."""
    scene, config = scenes.get("natural-test", 7), SimulatedRobotConfig(plant="kinematic")
    steering = Steering(ReactiveController(config.robot, config.grid))
    robot = SimulatedRobot(scene, config, Models(), steering)
    task = scene.world.tasks[0]
    readings = robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))

    def advance(steps):
        nonlocal readings
        for _ in range(steps):
            readings = robot.step(readings)

    advance(100)
    yield advance
    robot.close()


def test_a_step_copies_no_cloud_and_keeps_nothing(drive):
    """A step allocates less than half a cloud, and hundreds of steps keep less than one."""
    tracemalloc.start()
    try:
        drive(140)  # Memory of before is replaced: from here on all is counted.
        peaks, kept = [], []
        for _ in range(20):
            before, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            drive(1)
            after, peak = tracemalloc.get_traced_memory()
            peaks.append(peak - before)
            kept.append(after - before)
        # Most of it is a step's beams, which stay for the next cloud.
        assert np.median(peaks) < CLOUD / 2
        assert np.median(kept) < CLOUD / 8
        drive(133 * 3)  # The largest cloud of the way sets the memory of the next ones.
        gc.collect()
        first, _ = tracemalloc.get_traced_memory()
        drive(133 * 3)  # Whole turns of the head: as much of the next cloud is there again.
        gc.collect()
        last, _ = tracemalloc.get_traced_memory()
        assert last - first < CLOUD
    finally:
        tracemalloc.stop()
