"""A control step works in memory that it has: what it allocates is small, and is not kept."""

import gc
import tracemalloc

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.models import shipped_forest
from andabata.navigation.reactive import ReactiveController

CLOUD = 40_000 * 12
"""Bytes of a cloud's points: what one copy of it, or of the beams of a step, would take."""


@pytest.fixture
def drive(scenes):
    """A function that drives some steps, the first clouds and all compiling behind it."""
    scene, config = scenes.get("natural-test", 7), SimulatedRobotConfig(plant="kinematic")
    simulated_robot = SimulatedRobot(
        scene, config, shipped_forest(), ReactiveController(config.robot, config.grid)
    )
    task = scene.world.tasks[0]
    readings = simulated_robot.place(task.start, np.array(task.goals[0]), np.random.default_rng(0))

    def advance(steps):
        nonlocal readings
        for _ in range(steps):
            readings = simulated_robot.simulator.step(simulated_robot.navigator.step(readings))

    advance(100)
    yield advance
    simulated_robot.close()


def test_a_step_copies_no_cloud_and_keeps_nothing(drive):
    tracemalloc.start()
    try:
        drive(140)  # What was there before is replaced: from here on all is counted.
        peaks, kept = [], []
        for _ in range(20):
            before, _ = tracemalloc.get_traced_memory()
            tracemalloc.reset_peak()
            drive(1)
            after, peak = tracemalloc.get_traced_memory()
            peaks.append(peak - before)
            kept.append(after - before)
        # Most is what stays of a step's beams, to become the next cloud.
        assert np.median(peaks) < CLOUD / 2
        assert np.median(kept) < CLOUD / 8
        drive(133 * 3)  # The largest cloud of the way sets what is kept for the next ones.
        gc.collect()
        first, _ = tracemalloc.get_traced_memory()
        drive(133 * 3)  # Whole turns of the head: as much of the next cloud is there again.
        gc.collect()
        last, _ = tracemalloc.get_traced_memory()
        assert last - first < CLOUD
    finally:
        tracemalloc.stop()
