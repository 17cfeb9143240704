"""Labels of a teacher of policies that see the map, and the drives that they are of."""

import numpy as np

from andabata.navigation.map_observation import action_table
from andabata.tasks.episode_monitor import TerminationConfig
from andabata.training.map_labels import MapLabels, MapLabelsConfig

DRIVING = MapLabelsConfig(
    presets=("natural-test",), goals=1, terminations=TerminationConfig(time_limit=4.0)
)
SPEC = DRIVING.observations
TABLE = action_table(DRIVING.simulated_robot.robot)


def labels_that_turn_to_the_goal(count=400):
    """Return labels whose cheapest action turns to the side of the goal."""
    rng = np.random.default_rng(0)
    seen = np.zeros((count, SPEC.size), dtype=np.float16)
    side = rng.uniform(-1, 1, count)
    seen[:, SPEC.slice_of("goal").start + 1] = side
    prices = 2.0 * np.abs(TABLE[None, :, 1] - 0.5 * side[:, None]) + 5.0
    return MapLabels(seen, prices.astype(np.float32))
