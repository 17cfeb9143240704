"""View of a robot on a live graph: pages command it only where the user has allowed it."""

import numpy as np
import pytest

from andabata.assembly.controllers import make_steering
from andabata.assembly.navigator import make_navigator
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.models import Models
from andabata.viewer.options import ViewConfig
from andabata.viewer.robot_view import RobotView

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")

CONFIG = SimulatedRobotConfig(plant="kinematic")


@pytest.fixture(scope="module")
def parts():
    """Navigator of a robot."""
    models = Models()
    steering = make_steering("straight", None, CONFIG, models)
    return make_navigator(CONFIG, models, steering, np.random.default_rng(0))


@pytest.mark.parametrize("is_allowed", [False, True])
def test_a_robot_is_watched_and_commanded_only_if_that_is_allowed(parts, is_allowed):
    """Without permission the page has no control of the goal; with it the address has a token."""
    config, goals = ViewConfig(port=0, allow_commands=is_allowed), []
    with RobotView(config, lambda text: None) as view:
        view.watch_robot(parts, CONFIG, goals.append)
        handles = view.server.viser.gui._gui_input_handle_from_uuid.values()
        labels = {handle.label for handle in handles}
        assert "Follow" in labels
        assert ("Choose the goal" in labels) == is_allowed
        bare = f"http://127.0.0.1:{view.server.port}"
        secret = view.server.url.removeprefix(bare).strip("/")
        assert len(secret) == (43 if is_allowed else 0)


def test_each_view_has_another_token():
    """A link of yesterday opens nothing."""
    config = ViewConfig(port=0, allow_commands=True)
    with RobotView(config, print) as one, RobotView(config, print) as other:
        assert one.server.url.split("/")[3] != other.server.url.split("/")[3]
