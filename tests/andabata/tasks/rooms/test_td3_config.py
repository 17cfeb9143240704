"""TD3's settings: rooms that train and judge, the states of the papers, names."""

import numpy as np
import pytest

from andabata.tasks.rooms.td3_config import (
    GDAE_RADIUS,
    JUDGES,
    SCENES,
    STATES,
    Td3TaskConfig,
    td3_config,
)
from worlds.rooms.catalogue import make_room


def test_what_judges_is_not_trained_in():
    """The rooms of the comparison and the scenes are judges; the default pool holds none."""
    assert all(make_room(name).judges for name in (*JUDGES, *SCENES))
    assert not set(Td3TaskConfig().all_rooms) & {*JUDGES, *SCENES}
    assert not any(make_room(name).judges for name in Td3TaskConfig(random_rooms=3).all_rooms)


def test_the_defaults_are_those_of_gdae():
    """500 steps of 0.1 s at up to 1 m/s and 1 rad/s, goals of 0.3 m, no points."""
    config = Td3TaskConfig()
    assert (config.task, config.capacity) == ("td3", 0)
    assert config.terminations.time_limit / config.robot.period == pytest.approx(500)
    robot = config.robot
    assert (robot.radius, robot.max_speed, robot.max_yaw_rate) == (0.2, 1.0, 1.0)
    assert config.terminations.goal_radius == 0.3
    assert config.lidar.count == 360
    assert GDAE_RADIUS == 0.35


@pytest.mark.parametrize(
    ("state", "terms", "beams"),
    [
        ("scaled", {"windows": 40, "goal": 3, "velocity": 2}, 360),
        ("printed", {"ranges": 40, "goal": 2, "velocity": 2}, 360),
        ("gdae", {"ranges": 20, "goal": 2, "velocity": 2}, 181),
    ],
)
def test_states_are_those_of_the_papers(state, terms, beams):
    """44 values of the improved TD3, 24 of GDAE, in their order; ours has the goal's sine too."""
    config = td3_config(state=state)
    assert {term.name: term.size for term in config.observations.terms} == terms
    assert config.observations.size == sum(terms.values())
    assert config.lidar.count == beams
    assert all(term.high == 10.0 for term in config.observations.terms if term.name == "ranges")


def test_front_windows_fit_the_front_laser():
    """GDAE's 20 ranges lie within the laser's field of view, nine degrees each."""
    config = td3_config(state="gdae")
    assert config.terms.window_fov == pytest.approx(np.radians(config.lidar.fov_deg))


def test_named_rooms_take_the_pools_place():
    """With names there is no pool; settings and state go together; others are refused."""
    config = td3_config("gdae", None, "gdae")
    assert config.all_rooms == ("gdae",)
    base = Td3TaskConfig(random_rooms=5, earlier_scan=2)
    assert td3_config(config=base) == base
    assert td3_config(lidar="ten-beams", config=base).lidar.count == 10
    assert td3_config(state="printed", config=base).earlier_scan == 2
    assert set(STATES) == {"scaled", "printed", "gdae"}
    with pytest.raises(ValueError, match="state: expected one of scaled, printed, gdae, got 'raw'"):
        td3_config(state="raw")
