"""Measurements of a body in the reference plant."""

import numpy as np
import pytest
from scipy.stats import ks_2samp

from andabata.bench import vehicle
from andabata.bench.vehicle import (
    bench_vehicle,
    distribution_distance,
    flat_world,
    measured_yaw_rate,
    vehicle_tables,
)
from andabata.machine.plants import available_plants
from andabata.machine.robot import RobotModel
from andabata.machine.vehicle import make_vehicle
from tests.support.plants import MUJOCO, needs_bullet


def test_the_distance_of_distributions_is_scipys():
    """Kolmogorov and Smirnov's statistic, also of samples of unequal size with ties."""
    rng = np.random.default_rng(0)
    one, other = rng.integers(0, 20, 50).astype(float), rng.integers(3, 25, 80).astype(float)
    expected = ks_2samp(one, other).statistic
    assert distribution_distance(one, other) == pytest.approx(expected)
    assert distribution_distance(one, one) == 0.0


@pytest.mark.parametrize("plant", [MUJOCO, "wheels", "kinematic"])
@pytest.mark.parametrize("rate", [0.3, -0.5])
def test_other_plants_turn_at_the_commanded_rate_on_flat_ground(plant, rate):
    """The measured yaw rate has the command's sign and nearly its size."""
    robot = RobotModel()
    made = make_vehicle(plant, flat_world(), robot, np.random.default_rng(0))
    assert measured_yaw_rate(made, robot, rate, 1.0) == pytest.approx(rate, rel=0.1)


def test_tyres_that_do_not_slide_tip_over_at_the_geometric_limit():
    """In the plant of ray-cast wheels: the outer rims are half a wheel's width further out."""
    robot = RobotModel()
    grip = vehicle._gripping(robot, "wheels", flat_world)
    found = vehicle.tipping(robot, grip)
    rims = np.rad2deg(np.arctan((robot.track + robot.wheel_width) / 2 / robot.centre_of_mass))
    assert found["geometry_deg"] < found["tips_over_deg"] < rims + 3.0


def test_parts_are_run_in_their_order_and_counted(monkeypatch):
    """Each part lands under its name; where bullet is, the fast plants are compared with it."""
    monkeypatch.setattr(vehicle, "has_bullet", lambda: True)
    for name in ("turning", "slopes", "obstacles", "tipping"):
        monkeypatch.setattr(vehicle, name, lambda robot, make, name=name: name)
    monkeypatch.setattr(vehicle, "compare_plants", lambda robot, seed, plant: (plant, seed))
    monkeypatch.setattr(vehicle, "ground_drives", lambda robot, seed: [seed])
    steps = []
    found = bench_vehicle(RobotModel(), 7, lambda: steps.append(1))
    assert list(found) == ["turning", "slopes", "obstacles", "tipping", "plants", "ground"]
    assert found["ground"] == [7]
    assert found["slopes"] == "slopes"
    assert found["plants"] == [(plant, 7) for plant in available_plants() if plant != "bullet"]
    assert len(steps) == 6
    monkeypatch.setattr(vehicle, "has_bullet", lambda: False)
    assert bench_vehicle(RobotModel(), 7)["plants"] == []


def test_obstacles_of_a_table_are_called_so():
    """The key of the JSON is kept, the heading is plain."""
    row = {"obstacle": "step", "size_m": 0.1, "reached_m": 1.2, "contact": True}
    found = {"robot": "husky", "plant": "bullet", "turning": [], "slopes": [], "obstacles": [row]}
    tables = dict(vehicle_tables(found | {"tipping": {"a": 1}, "plants": [{"b": 2}], "ground": []}))
    assert list(tables["10 s towards an obstacle 1.5 m ahead"][0]) == [
        "obstacle",
        "size_m",
        "reached_m",
        "contact",
    ]
    assert tables["tipping over"] == [{"a": 1}]
    assert tables["other plants against bullet"] == [{"b": 2}]
    assert tables["10 s over ground 1.5 m ahead, in all plants"] == []


@needs_bullet
def test_a_physics_step_has_a_row_with_its_turn_ratios(monkeypatch):
    """The ratio is achieved over commanded, whatever the sign of the command."""
    from andabata.bench.studies.vehicle_rates import time_steps

    monkeypatch.setattr("andabata.bench.studies.vehicle_rates.STEPS", (0.01,))
    monkeypatch.setattr("andabata.bench.studies.vehicle_rates.RATES", (0.5, -0.5))
    monkeypatch.setattr("andabata.bench.studies.vehicle_rates.HEADINGS", (0.0,))
    (row,) = time_steps(RobotModel())
    assert row["physics step [ms]"] == 10.0
    assert 0.5 < row["lowest"] <= row["mean turn ratio"] <= row["highest"] < 1.5
