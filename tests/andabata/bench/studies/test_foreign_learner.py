"""Foreign learners: both learn on the registered environment and are tested alike."""

import numpy as np

from andabata.bench.studies.foreign_learner import fixed_tasks_reached, ours, stable_baselines
from andabata.tasks.rooms.spn_config import SpnConfig
from rl.goal_laws import ProportionalPolicy


def test_both_learners_run_and_fill_their_rows():
    """A few steps of each are learnt from, and all 16 tasks are tried."""
    for learner in (ours, stable_baselines):
        row = learner(1200, 0)
        assert row["control steps"] >= 1200
        assert 0 <= row["fixed tasks of 16"] <= 16


def test_a_policy_that_drives_straight_does_the_open_tasks():
    """The proportional controller reaches some fixed tasks, and standing still none."""
    config = SpnConfig(rooms=("spn-env0", "spn-env1"))
    straight = ProportionalPolicy({}, config.observations, config.actions)
    reached, mean = fixed_tasks_reached(config, straight)
    assert 3 <= reached < 8
    assert 25 < mean < 60

    class Still:
        observations, actions, info = config.observations, config.actions, {}

        def best_many(self, rows):
            return np.tile([-1.0, 0.0], (len(rows), 1))

    assert fixed_tasks_reached(config, Still())[0] == 0
