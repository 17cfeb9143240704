"""Any laser: the same assembler, grid and forest on beam patterns that are data."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.app.settings import with_parts
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.machine.lidar import LidarConfig
from andabata.machine.lidar_models import UnknownSensorError, sensor_names, sensor_settings
from andabata.models import shipped_forest
from andabata.training.plans import load_plan
from terrain.classes import SemanticClass
from terrain.objects import frustum
from traversability.scanner import TraversabilityScanner
from worlds.world import Start

BEAMS = {
    "hdl-32e": 32,
    "hdl-64e": 64,
    "livox-rosette": 100,
    "os0-128": 128,
    "os0-32": 32,
    "os1-64": 64,
    "pandar-40p": 40,
    "rs-32": 32,
    "utm-30lx": 1081,
    "vlp-16": 16,
    "vlp-32c": 32,
    "xt-32": 32,
}


def test_the_known_lasers():
    assert set(sensor_names()) == set(BEAMS)
    with pytest.raises(UnknownSensorError, match="expected one of hdl-32e, hdl-64e, livox-rosette"):
        sensor_settings("mid-999")


def test_a_table_of_elevations_is_kept_beam_by_beam():
    table = (-25.0, -15.639, -4.0, 0.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0)
    lidar = LidarConfig(elevations_deg=table, beams=11, sweep_hz=18000.0)
    assert lidar.is_multibeam
    assert lidar.beam_period == 0.0
    found = 90.0 - np.rad2deg(lidar.elevations(0, 1).astype(np.float64))
    np.testing.assert_allclose(found, table, atol=1e-4)


@pytest.mark.parametrize(
    "fields",
    [
        {"elevations_deg": (0.0, 1.0), "beams": 11},
        {"elevations_deg": tuple(range(10, -1, -1)), "beams": 11},
        {"elevations_deg": tuple(range(85, 96)), "beams": 11},
        {"elevations_deg": tuple(range(11)), "beams": 11, "span_deg": (0.0, 10.0)},
    ],
)
def test_a_table_that_is_none_is_refused(fields):
    with pytest.raises(ValueError, match="elevations_deg: expected"):
        LidarConfig(**fields)


def test_the_widely_spaced_lasers_have_their_published_beams():
    for name, lowest in (("vlp-32c", (-25.0, -15.639, -11.31)), ("rs-32", (-25.0, -14.638))):
        table = sensor_settings(name)["sensing"]["lidar"]["elevations_deg"]
        assert tuple(table[: len(lowest)]) == lowest


@pytest.mark.parametrize("name", BEAMS)
def test_a_trunk_stands_where_it_is_in_every_lasers_cloud(name, make_scene):
    trunk = frustum(SemanticClass.TRUNK, (3.0, 1.0, 0.0), (0.15, 0.15), 3.0)
    scene = make_scene(objects=[trunk], size=30.0)
    config = with_parts(CloudsConfig, name).model_copy(update={"carry_time": 0.0})
    assert config.sensing.lidar.beams == BEAMS[name]
    cloud = labelled_cloud(scene, config, np.random.default_rng(0), Start(0.0, 0.0, 0.3))
    bearing = np.arctan2(cloud.points[:, 1], cloud.points[:, 0])
    hits = cloud.classes == SemanticClass.TRUNK
    assert hits.sum() > 20
    moved = 0.3 * 3.4  # At most, while the turning head completes its cloud.
    assert np.hypot(*cloud.points[hits, :2].mean(axis=0)) == pytest.approx(3.0, abs=moved)
    scan = TraversabilityScanner(shipped_forest()).scan(cloud.points)
    sector = int((np.median(bearing[hits]) + np.pi) / (2 * np.pi) * 32)
    assert 1.0 < scan.ranges[sector] < 3.3
    full_turn = np.histogram(bearing, 16, (-np.pi, np.pi))[0]
    assert (full_turn > 0.3 * full_turn.mean()).all()


def test_an_unknown_sensor_is_a_usage_error(tmp_path, capsys):
    code = main(["clouds", "generate", "--out", str(tmp_path), "--sensor", "sonar"])
    assert code == 2
    assert "--sensor: expected one of" in capsys.readouterr().err


def test_clouds_of_another_laser_are_generated(tmp_path, capsys):
    options = ["--train", "1", "--validation", "0", "--workers", "1", "--json"]
    out = str(tmp_path)
    assert main(["clouds", "generate", "--out", out, "--sensor", "vlp-16", *options]) == 0
    assert json.loads(capsys.readouterr().out)["clouds"] == 1


def test_a_run_learns_with_another_laser():
    stages = [plan.environment for plan in load_plan(sensor="os1-64").stages.values()]
    assert stages[0].simulated_robot.sensing.scanner == "horizontal"
    assert [stage.simulated_robot.sensing.lidar.beams for stage in stages[1:]] == [64, 64]
    assert stages[2].simulated_robot.plant == "kinematic"
    assert stages[2].simulated_robot.assembly.turn == pytest.approx(2 * np.pi)
